"""The same scene twice gives the same files, to the last bit; so do one thread and two.

All of ``configs/scenes`` run as a user runs them, each in three processes: twice with one thread, once with two; where
it shall be quick, twice with one thread and coarse triangles, for a few steps, without pictures, two scenes at a time.
Files are compared by their bytes, checkpoints by their arrays, reports by the figures of the result.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

from taichi_tryon.bench.record import Record, absolute
from taichi_tryon.bench.simulate import FOLDER, scene_path
from taichi_tryon.bench.stability.kills import differing
from taichi_tryon.bench.stability.processes import end, start
from taichi_tryon.scene.load import load_scene

RUNS = {"first": 1, "again": 1, "two_threads": 2}
"""Name of a run's folder, and its threads; each is compared with the first."""
QUICK = ("mesh.edge_length_mm=40", "drape.duration_s=0.05", "settle.max_steps=0")
QUICK += ("output.images=false", "output.video=false")
"""Values set as by ``--set`` where it shall be quick."""


def records(quick: bool) -> Iterator[Record]:
    """Files that differ, of each scene."""
    scene_path("hang.yaml")  # raises where configs is not here
    scenes = [path.absolute() for path in sorted((FOLDER.parent / "scenes").glob("*.yaml"))]
    runs = {name: RUNS[name] for name in ("first", "again")} if quick else RUNS
    with ThreadPoolExecutor(2 if quick else 1) as pool:
        options = [_briefly(scene) if quick else () for scene in scenes]
        done = pool.map(_timed, scenes, options, [runs] * len(scenes))
        for scene, (found, seconds) in zip(scenes, done, strict=True):
            for name, files in found.items():
                if files:
                    print(f"same_bits: {scene.stem}, {name}: {', '.join(files)}")
                where = {"scene": scene.stem, "run": name}
                yield absolute("same_bits", where, "files_that_differ", "1", len(files), 0, 0, seconds)


def _briefly(scene: Path) -> tuple[str, ...]:
    """Options of ``run`` for a few steps of a scene: what moves goes a centimetre to the front."""
    spec, settings = load_scene(scene), QUICK
    if spec.motion:
        x, y, z = spec.pose.translation_cm
        there = spec.pose.model_copy(update={"name": "there", "translation_cm": [x, y, z + 1.0]})
        settings += (f"motion=[{{pose: {there.model_dump_json()}, duration_s: 0.05}}]",)
    return tuple(part for setting in settings for part in ("--set", setting))


def _timed(scene: Path, options: tuple[str, ...], runs: Mapping[str, int]) -> tuple[dict[str, list[str]], float]:
    begin = time.perf_counter()
    return compared(scene, *options, runs=runs), time.perf_counter() - begin


def compared(scene: Path, *options: str, runs: Mapping[str, int] = RUNS) -> dict[str, list[str]]:
    """Files in which the other ``runs`` (see RUNS) differ from the first. Raises RunError where one fails."""
    with TemporaryDirectory() as folder:
        outputs = {name: Path(folder) / name for name in runs}
        for name, threads in runs.items():
            # not a key of the scene, which all of them shall have alike
            end(start(scene, outputs[name], *options, OMP_NUM_THREADS=str(threads)), outputs[name])
        first, *others = runs
        return {name: differing(outputs[first], outputs[name]) for name in others}
