"""Pictures, film and maps that nobody asked for: a disk on a ball, run and written as ``run`` does; in quick runs not
settled. Reference: all of them written. Limit: the same bits.
"""

import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.record import Record, absolute, told
from taichi_tryon.bench.skip.course import FOLDER
from taichi_tryon.output.checkpoint import NAME
from taichi_tryon.run import run_scene
from taichi_tryon.scene.load import load_scene

SCENE = "validation/sphere.yaml"
OUTPUTS = ("images", "video", "maps")
ASKED = {"images": "true", "video": "true", "maps": "[strain_warp, strain_weft, shear, pressure, gap]"}


def records(quick: bool) -> Iterator[Record]:
    """Without output, with each kind alone where not ``quick``, and with all."""
    kinds = {"all": OUTPUTS} if quick else {**{name: (name,) for name in OUTPUTS}, "all": OUTPUTS}
    course = ("settle.max_steps=0",) if quick else ()
    plain, least = apart(written, (), course)
    yield told("output", {"asked for": "nothing"}, "run", "s", least, least)
    for name, kind in kinds.items():
        positions, seconds = apart(written, kind, course)
        where = {"asked for": name}
        yield told("output", where, "run", "s", seconds, seconds)
        yield told("output", where, "with_over_without", "1", least / seconds, seconds)
        distance = 1000 * np.linalg.norm(positions - plain, axis=1).max()
        yield absolute("output", where, "distance_of_results", "mm", distance, 0.0, 0.0, seconds)


def written(kinds: tuple[str, ...], course: tuple[str, ...]) -> tuple[np.ndarray, float]:
    """Run the scene, with values set for its course, and with some kinds of output: positions (nv, 3) [m] at its end,
    and the seconds that it took."""
    settings = [*course, *(f"output.{name}={ASKED[name]}" for name in kinds)]
    scene = load_scene(FOLDER / SCENE, settings)
    with TemporaryDirectory() as folder:
        begin = time.perf_counter()
        run_scene(scene, Path(folder), arch="cpu")
        seconds = time.perf_counter() - begin
        with np.load(Path(folder) / NAME) as state:
            return state["positions"], seconds
