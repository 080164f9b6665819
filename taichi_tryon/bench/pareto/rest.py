"""A scene on its way to rest, computed with many settings, and held against the same way gone with small steps and
tight tolerances."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence

import numpy as np

from taichi_tryon import runtime
from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.pareto import compare
from taichi_tryon.bench.pareto.ours import Setting
from taichi_tryon.bench.pareto.reference import Reference, distance, kept
from taichi_tryon.bench.pareto.track import Track, stretched
from taichi_tryon.bench.record import Record, told
from taichi_tryon.contact.probe import Probe
from taichi_tryon.errors import RunError
from taichi_tryon.scene.load import load_scene
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.setup import prepare
from taichi_tryon.simulation import Simulation
from taichi_tryon.timing import Stopwatch

OURS = "taichi_tryon"
UNIT = "ms to rest"


def run(path: str, setting: Setting) -> Track:
    """Start Taichi as the scene asks, and follow it to rest; the time is that of all steps but the first."""
    scene = load_scene(path, setting.overrides)
    runtime.start("cpu", scene.solver.precision, scene.solver.threads)
    return follow(scene)


def follow(scene: SceneSpec) -> Track:
    """A scene's way to rest. Taichi runs already. Raises RunError where a step fails or rest is not found."""
    clock = Stopwatch()
    simulation = Simulation(prepare(scene, clock), clock)
    cpu = wall = 0.0
    while not simulation.finished:
        cpu_begin, begin = time.process_time(), time.perf_counter()
        simulation.advance()
        if simulation.progress.steps > 1:
            cpu, wall = cpu + time.process_time() - cpu_begin, wall + time.perf_counter() - begin
    if not simulation.settled:
        raise RunError(f"{scene.scene}: not at rest after {scene.settle.max_steps} steps")
    cloth, x = simulation.setup.cloth, simulation.stepper.x
    depth = Probe(cloth.triangles, simulation.field, x).look()[0].max() if scene.body else 0.0
    positions = x.to_numpy().astype(float)
    lowest, strain, deepest = ([value] for value in (positions[:, 1].min(), stretched(positions, cloth), depth))
    return Track(positions, np.array(lowest), np.array(strain), np.array(deepest, float), cpu, wall, 1.0)


def records(
    case: str, path: str, edge_mm: float, exact: tuple[str, ...], twice: tuple[str, ...], settings: Sequence[Setting]
) -> Iterator[Record]:
    """All figures of a scene with triangles of ``edge_mm``. ``exact``: values set for the converged way, ``twice``:
    further ones, for one about twice as coarse."""
    mesh = f"mesh.edge_length_mm={edge_mm}"
    exact = (mesh, *exact)

    def find() -> Reference:
        fine, coarse = (apart(run, path, Setting("", values)) for values in (exact, (*exact, *twice)))
        return Reference(fine, distance(coarse.positions, fine.positions))

    reference = kept(f"{case}_{edge_mm:g}mm", load_scene(path, exact), find)
    where = {"vertices": len(reference.track.positions), "fabric": "table1", "simulator": OURS}
    yield compare.doubt(case, where, reference)
    for setting in settings:
        here = {**where, "setting": setting.name}
        try:
            track = apart(run, path, Setting(setting.name, (mesh, *setting.overrides)))
        except RunError:
            yield told(case, here, "failed", "1", 1, 0.0)
            continue
        yield from compare.figures(case, here, track, reference, UNIT)
