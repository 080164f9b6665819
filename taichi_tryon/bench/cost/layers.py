"""What contact of cloth with cloth costs: the time of a step with it over that of one without.

A sheet that falls on a ball, where no cloth meets cloth, and a skirt that is twirled, whose folds touch; both of about
10,000 vertices. The scene is led with contact to where the frames begin; from there it goes on with and without,
through the same frames in one process, in turns, so that what else the machine does meets both alike. The cost is the
median over the frames of the ratio of their times: all steps of a frame count, also those that are tried in vain.
Limits are our own.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from taichi_tryon import runtime
from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.record import Record, absolute, at_least, told
from taichi_tryon.bench.simulate import FOLDER, scene_path
from taichi_tryon.errors import RunError
from taichi_tryon.scene.load import load_scene
from taichi_tryon.setup import prepare
from taichi_tryon.simulation import Simulation
from taichi_tryon.timing import Stopwatch

TOUCHING = 50
"""Pairs that must touch at once in a case of folds."""
TWIRL = ("drape.duration_s=0", "motion.0.duration_s=0.5")
WITH, WITHOUT = "contact.layers={}", "contact.layers=null"


@dataclass(frozen=True)
class Case:
    """``frames`` frames of ``frame_s`` [s] of a ``phase`` of a scene, after its first ``skipped`` ones, with an edge
    length [mm] and ``settings`` as by ``--set``; ``touches``: whether cloth meets cloth in them; the ratio that is
    allowed."""

    scene: str
    settings: tuple[str, ...]
    edge_mm: float
    quick_edge_mm: float
    phase: str
    frame_s: float
    skipped: int
    frames: int
    touches: bool
    limit: float


CASES = {
    "nothing touches": Case("validation/drop_on_sphere.yaml", (), 10.101, 20.408, "drape", 1 / 60, 2, 16, False, 1.3),
    # while the turn, begun as soon as it is dressed and twice as fast, winds the skirt up; a frame is a step or two
    "folds": Case("scenes/skirt_twirl.yaml", TWIRL, 10.5, 16, "move", 1 / 240, 66, 8, True, 3.0),
}


@dataclass(frozen=True)
class Pair:
    """Wall time [s] of each frame (nf,) with contact of cloth and without; ``touching`` pairs of vertices, edges and
    triangles touched at once, at the most."""

    vertices: int
    layered: np.ndarray
    plain: np.ndarray
    touching: int


def records(quick: bool) -> Iterator[Record]:
    """Both cases."""
    scene_path("fold.yaml")  # raises where configs is not here
    for name, case in CASES.items():
        yield from of(name, case, apart(paired, case, case.quick_edge_mm if quick else case.edge_mm))


def paired(case: Case, edge_mm: float) -> Pair:
    """Start Taichi, and follow both. Raises RunError where a step fails or a simulation ends before its frames."""
    scene = load_scene(FOLDER.parent / case.scene)
    runtime.start("cpu", scene.solver.precision, scene.solver.threads)
    return followed(case, edge_mm)


def followed(case: Case, edge_mm: float) -> Pair:
    """The same; Taichi runs already."""
    both = [_simulation(case, edge_mm, layers) for layers in (WITH, WITHOUT)]
    _advance(both[0], case, case.skipped)
    both[1].restore(both[0].state())
    times, touching = np.zeros((case.frames, 2)), 0
    for frame in range(case.frames):
        # who goes first finds the other's data in the caches
        for which in (0, 1) if frame % 2 else (1, 0):
            begin = time.perf_counter()
            _advance(both[which], case, case.skipped + frame + 1)
            times[frame, which] = time.perf_counter() - begin
        touching = max(touching, int(both[0].stepper.layers.touching.sum()))
    return Pair(both[0].setup.cloth.vertex_count, *times.T, touching)


def of(name: str, case: Case, pair: Pair) -> Iterator[Record]:
    """Records of a case."""
    where, wall = {"cloth": name, "vertices": pair.vertices}, float(pair.layered.sum() + pair.plain.sum())
    ratio = np.median(pair.layered / pair.plain)
    for which, seconds in (("with", pair.layered), ("without", pair.plain)):
        yield told("layers", where, f"frame_{which}", "ms a frame", 1000 * np.median(seconds), wall)
    if case.touches:  # else there was nothing to be found out
        yield at_least("layers", where, "pairs_in_contact", "1", pair.touching, TOUCHING, wall)
    else:
        yield absolute("layers", where, "pairs_in_contact", "1", pair.touching, 0, 0, wall)
    yield absolute("layers", where, "with_over_without", "1", ratio, 0.0, case.limit, wall)


def _simulation(case: Case, edge_mm: float, layers: str) -> Simulation:
    clock = Stopwatch()
    settings = (*case.settings, f"mesh.edge_length_mm={edge_mm:g}", layers)
    return Simulation(prepare(load_scene(FOLDER.parent / case.scene, settings), clock), clock)


def _advance(simulation: Simulation, case: Case, frames: int) -> None:
    """Go on until so many frames of a case's phase are over."""
    p = simulation.progress
    while p.phase != case.phase or p.phase_time < frames * case.frame_s - 1e-9:
        if simulation.finished:
            raise RunError(f"{simulation.scene.scene}: phase {case.phase} has not as many frames as {frames}")
        simulation.advance()
