"""Cloth that lies and winds on itself never passes through itself, not between two frames either.

A strip that falls onto itself in folds and a sheet wound up by three turns. After every step all pairs of triangles
that pass through each other are counted, by the signs of tetrahedra's volumes alone: no part of the contact is asked.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

from taichi_tryon import runtime
from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.record import Record, absolute, at_least
from taichi_tryon.bench.simulate import simulate
from taichi_tryon.dressing.check import crossings

SCENES = ("folded_sheet", "twisted_sheet")
QUICK = "mesh.edge_length_mm=20"


def records(quick: bool) -> Iterator[Record]:
    """The most crossings after any step, and pairs that touched at once, each in both precisions."""
    for name in SCENES:
        for precision in ("f64", "f32"):
            begin = time.perf_counter()
            worst, touching, steps = apart(watched, name, precision, (QUICK,) if quick else ())
            where, wall = {"scene": name, "precision": precision, "steps": steps}, time.perf_counter() - begin
            yield absolute("crossings", where, "crossing_triangle_pairs", "1", worst, 0, 0, wall)
            # else there was nothing to be crossed
            yield at_least("crossings", where, "pairs_in_contact", "1", touching, 10, wall)


def watched(name: str, precision: str, overrides: tuple[str, ...]) -> tuple[int, int, int]:
    """Start Taichi and run a scene: most crossings after a step, most pairs in contact, steps."""
    runtime.start("cpu", precision)
    return followed(name, overrides)


def followed(name: str, overrides: tuple[str, ...]) -> tuple[int, int, int]:
    """The same; Taichi runs already."""
    worst = touching = 0

    def look(simulation) -> None:
        nonlocal worst, touching
        positions, triangles = simulation.stepper.x.to_numpy(), simulation.setup.cloth.triangles
        worst = max(worst, len(crossings(positions.astype(float), triangles)))
        touching = max(touching, simulation.stepper.layers.count)

    done = simulate(name, *overrides, watch=look)
    return worst, touching, done.simulation.progress.steps
