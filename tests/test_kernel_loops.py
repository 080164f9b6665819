"""Loops that stay on the thread that launches them go through their turns in order; those handed over do not."""

import subprocess
import sys
import textwrap

# restarting Taichi would take the other tests' fields away: a process of its own
PROGRAM = """
    import sys

    import numpy as np
    import taichi as ti

    from taichi_tryon import kernel_loops, runtime
    from taichi_tryon.kernel_loops import FEW, shared, shared_if_many

    TURNS = 1 << 20


    def in_order(mark):
        place, turn = ti.field(ti.i32, TURNS), ti.field(ti.i32, 1)

        @ti.kernel
        @mark
        def go():
            for i in range(TURNS):
                place[ti.atomic_add(turn[0], 1)] = i

        go()
        turns = place.to_numpy()
        assert (np.sort(turns) == np.arange(TURNS)).all()
        return bool((np.diff(turns) > 0).all())


    runtime.start("cpu", threads=int(sys.argv[1]))
    cases = [(lambda kernel: kernel, FEW), (shared_if_many, FEW - 1), (shared_if_many, FEW), (shared, 1)]
    for mark, vertices in cases:
        kernel_loops.compile_for(vertices)
        print(in_order(mark))
"""


def orders(tmp_path, threads: int) -> list[str]:
    program = tmp_path / "program.py"
    program.write_text(textwrap.dedent(PROGRAM))
    done = subprocess.run(
        [sys.executable, str(program), str(threads)], capture_output=True, text=True, timeout=60, check=True
    )
    return done.stdout.split()


def test_what_is_worth_it_is_handed_to_all_threads(tmp_path):
    assert orders(tmp_path, 2) == ["True", "True", "False", "False"]


def test_one_thread_is_handed_nothing(tmp_path):
    assert orders(tmp_path, 1) == ["True"] * 4
