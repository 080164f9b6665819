"""The same scene twice gives the same files, to the last bit; so do one thread and two.

All of ``configs/scenes`` run as a user runs them, each in three processes: twice with one thread, once with two. Files
are compared by their bytes, checkpoints by their arrays, reports by the figures of the result.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from taichi_tryon.bench.record import Record, absolute
from taichi_tryon.bench.simulate import FOLDER, scene_path
from taichi_tryon.bench.stability.kills import differing
from taichi_tryon.bench.stability.processes import end, start

QUICK = ("quick",)
RUNS = {"first": 1, "again": 1, "two_threads": 2}
"""Name of a run's folder, and its threads; each is compared with the first."""


def records(quick: bool) -> Iterator[Record]:
    """Files that differ, of each scene."""
    scene_path("hang.yaml")  # raises where configs is not here
    for scene in sorted((FOLDER.parent / "scenes").glob("*.yaml")):
        if scene.stem in QUICK or not quick:
            begin = time.perf_counter()
            for name, found in compared(scene.absolute()).items():
                if found:
                    print(f"same_bits: {scene.stem}, {name}: {', '.join(found)}")
                where = {"scene": scene.stem, "run": name}
                yield absolute("same_bits", where, "files_that_differ", "1", len(found), 0, 0,
                               time.perf_counter() - begin)  # fmt: skip


def compared(scene: Path, *options: str, runs: Mapping[str, int] = RUNS) -> dict[str, list[str]]:
    """Files in which the other ``runs`` (see RUNS) differ from the first. Raises RunError where one fails."""
    with TemporaryDirectory() as folder:
        outputs = {name: Path(folder) / name for name in runs}
        for name, threads in runs.items():
            # not a key of the scene, which all of them shall have alike
            end(start(scene, outputs[name], *options, OMP_NUM_THREADS=str(threads)), outputs[name])
        first, *others = runs
        return {name: differing(outputs[first], outputs[name]) for name in others}
