"""A clamped strip of 50 mm comes to rest under its own weight.

Reference: the same mesh at rest to 1e-7 of the weight, in double precision. How far that is from the elastica is the
business of ``bench accuracy``; here it is what coarse steps, loose tolerances and single precision cost.
"""

from __future__ import annotations

from collections.abc import Iterator

from taichi_tryon.bench.pareto import rest
from taichi_tryon.bench.pareto.falls import AS_IS, solver
from taichi_tryon.bench.pareto.ours import Setting
from taichi_tryon.bench.record import Record
from taichi_tryon.bench.simulate import scene_path

EDGES_MM = (5.0, 2.5, 1.25)
EXACT = (
    "settle.residual=1e-7",
    "settle.max_steps=2000",
    "solver.newton_tolerance=1e-6",
    "solver.linear_tolerance=1e-3",
)
TWICE = ("settle.residual=1e-6",)


def loose(residual: float) -> Setting:
    """Rest to a ``residual`` of the weight."""
    return Setting(f"residual {residual:g}", (f"settle.residual={residual}", f"solver.newton_tolerance={residual}"))


SETTINGS = (
    AS_IS,
    loose(1e-2),
    loose(1e-3),
    solver(step_s=1 / 240),
    solver(step_s=0.1),
    solver(linear_tolerance=1e-3),
    solver(preconditioner="block_jacobi"),
    Setting("precision f32", ("solver.precision=f32", *loose(1e-3).overrides)),
)


def records(quick: bool, peers: bool = False) -> Iterator[Record]:
    """Every setting on every mesh; no peer is asked."""
    path = str(scene_path("cantilever.yaml"))
    for edge_mm in EDGES_MM[:1] if quick else EDGES_MM:
        yield from rest.records("cantilever", path, edge_mm, EXACT, TWICE, SETTINGS[:2] if quick else SETTINGS)
