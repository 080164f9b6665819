"""Broken files: none may start a run, hang, or end in a traceback; each is refused with file, line and field.

Seeded mutations of the shipped scenes and of all their parts (see ``text_mutations``, ``value_mutations``,
``garment_mutations``), one at a time, in a copy of the folder ``configs``. Each is read as a run would read it; those
that are accepted though nothing about them can be right, and one in BUILT of the other accepted ones, are meshed and
dressed as well, with coarse triangles. All counts but the first shall be 0.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from taichi_tryon.bench.record import Record, counted
from taichi_tryon.bench.simulate import FOLDER, scene_path
from taichi_tryon.bench.stability.judge import Verdict, judge
from taichi_tryon.bench.stability.mutants import Mutant, laid_out, lay_traps, mutants
from taichi_tryon.bench.stability.watch import Crashed, Hung, Watched

SCENES = (
    "scenes/quick", "scenes/shirt_raising_arms", "scenes/trousers_step", "validation/fold", "validation/cusick",
    "validation/tube", "validation/incline",
)  # fmt: skip
LIMIT_S = 10.0
BUILT = 8
"""One in so many accepted scenes is built: that takes ten times as long as reading it."""
FAULTS = ("tracebacks", "hangs", "crashes", "messages_without_a_place", "wrong_data_accepted")


def records(quick: bool) -> Iterator[Record]:
    count, begin = 200 if quick else 2000, time.perf_counter()
    counts = dict.fromkeys(("tried", "refused", "accepted", "built", *FAULTS), 0)
    scene_path("fold.yaml")  # raises where configs is not here
    with TemporaryDirectory() as folder, Watched(judge, LIMIT_S) as watched:
        configs = Path(folder) / "configs"
        shutil.copytree(FOLDER.parent, configs)
        scenes = [configs / f"{name}.yaml" for name in SCENES]
        for scene in scenes:
            lay_traps(scene)
        for mutant in mutants(scenes, count):
            verdict, found = tried(mutant, watched)
            counts["tried"] += 1
            counts["built"] += verdict is not None and verdict.stage == "built"
            if verdict is not None and verdict.outcome in counts:
                counts[verdict.outcome] += 1
            for fault, what in found:
                counts[fault] += 1
                print(f"{fault}: {mutant.name}: {what}")
    yield from counted("bad_input", counts, FAULTS, time.perf_counter() - begin)


def tried(mutant: Mutant, judged: Watched) -> tuple[Verdict | None, list[tuple[str, str]]]:
    """The verdict on a mutant, None where there is none, and what went wrong: which of FAULTS, and how."""
    build = mutant.wrong or mutant.number % BUILT == 0
    try:
        with laid_out(mutant) as scene:
            verdict = judged(scene, build)
    except Hung as fault:
        return None, [("hangs", str(fault))]
    except Crashed as fault:
        return None, [("crashes", str(fault))]
    if verdict.outcome == "broken":
        fault = "tracebacks" if "Traceback" in verdict.messages[0] else "wrong_data_accepted"
        return verdict, [(fault, verdict.messages[0])]
    if verdict.outcome == "accepted" and mutant.wrong:
        return verdict, [("wrong_data_accepted", f"as {verdict.stage}")]
    return verdict, [("messages_without_a_place", message) for message in verdict.unplaced[:1]]
