"""Of a loop that is handed over, one turn can wait for a later one; in a loop that stays, it would wait for ever."""

import subprocess
import sys
import textwrap

# restarting Taichi would take the other tests' fields away: a process of its own
PROGRAM = """
    import sys

    import taichi as ti

    from taichi_tryon import kernel_loops, runtime
    from taichi_tryon.kernel_loops import FEW, shared, shared_if_many

    TURNS, PATIENCE = 1 << 16, 100_000_000


    def stays(mark):
        # whether the last turn has not come when the first gives up, which looks for it for about a second
        last, seen = ti.field(ti.i32, ()), ti.field(ti.i32, ())

        @ti.kernel
        @mark
        def go():
            for i in range(TURNS):
                if i == TURNS - 1:
                    last[None] = 1
                if i == 0:
                    looks = 0
                    while ti.atomic_add(last[None], 0) == 0 and looks < PATIENCE:
                        looks += 1
                    seen[None] = last[None]

        go()
        return seen[None] == 0


    runtime.start("cpu", threads=int(sys.argv[1]))
    cases = [(lambda kernel: kernel, FEW), (shared_if_many, FEW - 1), (shared_if_many, FEW), (shared, 1)]
    for mark, vertices in cases:
        kernel_loops.compile_for(vertices)
        print(stays(mark))
"""


def staying(tmp_path, threads: int) -> list[str]:
    program = tmp_path / "program.py"
    program.write_text(textwrap.dedent(PROGRAM))
    done = subprocess.run(
        [sys.executable, str(program), str(threads)], capture_output=True, text=True, timeout=60, check=True
    )
    return done.stdout.split()


def test_what_is_worth_it_is_handed_to_all_threads(tmp_path):
    assert staying(tmp_path, 2) == ["True", "True", "False", "False"]


def test_one_thread_is_handed_nothing(tmp_path):
    assert staying(tmp_path, 1) == ["True"] * 4
