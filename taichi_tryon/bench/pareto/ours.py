"""A problem as the product computes it."""

from __future__ import annotations

import time
from dataclasses import dataclass

from taichi_tryon import runtime
from taichi_tryon.bench.pareto.problem import Problem
from taichi_tryon.bench.pareto.track import Track, Tracker
from taichi_tryon.bench.simulate import scene_path
from taichi_tryon.scene.load import load_scene
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.setup import prepare
from taichi_tryon.simulation import Simulation
from taichi_tryon.timing import Stopwatch


@dataclass(frozen=True)
class Setting:
    """Values set in the scene, as by ``--set``, and what records call them."""

    name: str
    overrides: tuple[str, ...] = ()


def scene_of(problem: Problem, setting: Setting) -> SceneSpec:
    """The scene with all values set."""
    return load_scene(scene_path(f"{problem.scene}.yaml"), (*problem.overrides, *setting.overrides))


def run(problem: Problem, setting: Setting) -> Track:
    """Start Taichi as the scene asks, and follow the problem to its end."""
    scene = scene_of(problem, setting)
    runtime.start("cpu", scene.solver.precision, scene.solver.threads)
    return follow(problem, scene)


def follow(problem: Problem, scene: SceneSpec) -> Track:
    """The problem's course. Taichi runs already. Raises RunError where a step fails."""
    clock = Stopwatch()
    simulation = Simulation(prepare(scene, clock), clock)
    setup, stepper = simulation.setup, simulation.stepper
    tracker = Tracker(setup.cloth, setup.positions, setup.velocities, problem)
    cpu = wall = first = 0.0
    while not simulation.finished:
        cpu_begin, begin = time.process_time(), time.perf_counter()
        simulation.advance()
        if first:
            cpu, wall = cpu + time.process_time() - cpu_begin, wall + time.perf_counter() - begin
        # the clock of the phase counts every part of a step, and starts again with the next phase
        now = problem.duration if simulation.finished else simulation.progress.phase_time
        first = first or now
        tracker.seen(now, stepper.x.to_numpy().astype(float), stepper.v.to_numpy().astype(float))
    return tracker.track(cpu, wall, problem.duration - first)
