"""What single precision costs: exact cases run in f32 and, otherwise the same, in f64.

Reference: the figure in f64. Positions are rounded to 2^-24 of their distance from the origin, and stretch makes forces
of that on every vertex, which bounds how far a cloth can settle. Each run goes on for the same number of steps, or to
the scene's own residual if it gets there; the residual it reached is told, but not judged.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from taichi_tryon import runtime
from taichi_tryon.bench.accuracy import cantilever
from taichi_tryon.bench.record import Record, relative, told
from taichi_tryon.bench.simulate import Outcome, simulate
from taichi_tryon.errors import RunError

# what f32 may change [%]
LIMIT = 0.5
STEPS = 30
FIGURES: dict[str, tuple[str, str, Callable[[Outcome], float]]] = {
    "uniaxial": ("force", "N", lambda done: done.simulation.reactions()["right"][0]),
    "hanging_strip": ("extension", "mm", lambda done: -1e3 * done.positions[done.edge("bottom"), 1].mean()),
    "sphere": ("force_up", "N", lambda done: done.contact_forces.sum(axis=0)[1]),
    "cantilever": ("equivalent_B", "uN m", lambda done: 1e6 * cantilever.rigidity_of(done)),
}


def records(quick: bool) -> Iterator[Record]:
    """Each figure in f32 against f64, and what residual was reached. Taichi is left running in f64."""
    for name in ("uniaxial",) if quick else FIGURES:
        quantity, unit, figure = FIGURES[name]
        found = {}
        for precision in ("f32", "f64"):
            runtime.start("cpu", precision)
            done = _as_far_as_it_settles(name)
            found[precision] = figure(done)
            residual = done.simulation.progress.residual
            where = {"of": name, "precision": precision}
            yield told("precision", where, "residual", "of weight", residual, done.wall_s)
        yield relative("precision", {"of": name}, quantity, unit, found["f32"], found["f64"], LIMIT, done.wall_s)


def _as_far_as_it_settles(name: str) -> Outcome:
    """A validation scene after STEPS steps of settling at the most."""
    begin, seen = time.perf_counter(), []
    try:
        return simulate(name, f"settle.max_steps={STEPS}", watch=lambda running: seen.append(running))
    except RunError:
        return Outcome(seen[-1], time.perf_counter() - begin)
