"""The linear solve of a step by itself: the first of a step of 1/60 s, set-up of the preconditioner included.

Two sheets of 10,000 vertices: one that swings by two corners, and one that has fallen over a ball and lies in folds.
Reference: the same system solved to single precision's end; the solve is timed with the loosest tolerance, of those
from 0.1 downwards by a tenth each, that ends within 0.03 mm of it (root mean square over the vertices). Limits are our
own.
"""

import time
from collections.abc import Iterator

import numpy as np
import taichi as ti

from taichi_tryon import runtime
from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.pareto import hang, sphere
from taichi_tryon.bench.pareto.ours import Setting, scene_of
from taichi_tryon.bench.pareto.problem import Problem
from taichi_tryon.bench.record import Record, absolute, told
from taichi_tryon.setup import prepare
from taichi_tryon.simulation import Simulation
from taichi_tryon.timing import Stopwatch
from taichi_tryon.units import MM

COUNT, QUICK_COUNT = 100, 50
"""Vertices along a side."""
CASES = {"swinging": (hang, 8, 40.0), "folded": (sphere, 90, 60.0)}
"""Scene, steps before, and limit [ms]."""
NEAR = 0.03 * MM
EXACT, MOST, REPEATS, FINER = 1e-6, 5000, 9, 0.9


def records(quick: bool) -> Iterator[Record]:
    """Both cases, each in a process of its own."""
    count = QUICK_COUNT if quick else COUNT
    for name, (scene, steps, limit) in CASES.items():
        yield from of(name, apart(measured, scene.problem(count, "table1", 10.0), steps), limit)


def of(name: str, found: dict[str, float], limit: float) -> Iterator[Record]:
    """Records of what was ``measured``."""
    where, seconds = {"cloth": name, "vertices": int(found["vertices"])}, found["seconds"]
    yield told("linear", where, "iterations", "1", found["iterations"], seconds)
    yield told("linear", where, "distance", "mm", found["distance"] / MM, seconds)
    yield absolute("linear", where, "solve", "ms", 1000 * seconds, 0.0, limit, seconds)


def measured(problem: Problem, steps: int) -> dict[str, float]:
    """Start Taichi, go so many steps, and solve the next one's first system."""
    runtime.start("cpu")
    return solved(problem, steps)


def solved(problem: Problem, steps: int) -> dict[str, float]:
    """The same; Taichi runs already."""
    clock = Stopwatch()
    simulation = Simulation(prepare(scene_of(problem, Setting("")), clock), clock)
    for _ in range(steps):
        simulation.advance()
    linear, found = simulation.stepper.newton.linear, {}
    solve = linear.solve

    def look_closer(*given):
        linear.solve = solve
        found.update(_closer(linear))
        return solve(*given)

    linear.solve = look_closer
    simulation.advance()
    return found


def _closer(linear) -> dict[str, float]:
    """Seconds, iterations and distance [m] of the loosest solve that is near enough."""
    linear.solve(EXACT, MOST)
    exact, tolerance, distance = linear.d.to_numpy(), 0.1 / FINER, np.inf
    while distance > NEAR and tolerance > EXACT:
        tolerance *= FINER
        iterations, _ = linear.solve(tolerance, MOST)
        distance = float(np.sqrt(((linear.d.to_numpy() - exact) ** 2).sum(axis=1).mean()))
    times = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        linear.solve(tolerance, MOST)
        ti.sync()
        times.append(time.perf_counter() - begin)
    return {"vertices": linear.nv, "seconds": min(times), "iterations": iterations, "distance": distance}
