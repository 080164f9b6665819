"""A woman with raised arms is dressed in the top, as ``run configs/scenes/quick.yaml`` does it.

Reference: the same mesh and dressing, draped with TR-BDF2 in steps of 1/240 s and settled to a residual of 1e-4. With
friction a garment has many equilibria near each other; the way decides which is found, and so the error of coarse steps
is partly another choice.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from taichi_tryon.bench.pareto import rest
from taichi_tryon.bench.pareto.falls import AS_IS, solver
from taichi_tryon.bench.pareto.ours import Setting
from taichi_tryon.bench.record import Record
from taichi_tryon.errors import InputError

SCENE = "configs/scenes/quick.yaml"
EDGES_MM = (25.0, 12.0)
EXACT = (
    "solver.scheme=tr_bdf2",
    "solver.step_s=0.0041666666666666666",
    "solver.newton_tolerance=1e-3",
    "solver.max_newton_iterations=30",
    "settle.residual=1e-4",
    "settle.max_steps=1000",
)
TWICE = ("solver.step_s=0.008333333333333333",)
SETTINGS = (
    AS_IS,
    solver(precision="f32"),
    solver(step_s=1 / 30),
    solver(step_s=1 / 120),
    solver(scheme="tr_bdf2"),
    solver(max_newton_iterations=1),
    solver(max_newton_iterations=10, newton_tolerance=1e-3),
    solver(linear_tolerance=0.1),
    Setting("residual 0.001", ("settle.residual=1e-3",)),
    Setting("drape 0.3 s", ("drape.duration_s=0.3",)),
    Setting("bending constant", ("mesh.bending=constant",)),
)


def records(quick: bool, peers: bool = False) -> Iterator[Record]:
    """Every setting on both meshes; no peer has patterns, seams and a body."""
    if not Path(SCENE).is_file():
        raise InputError(f"{SCENE}: no such file; start bench in the project's folder")
    if quick:
        yield from rest.records("shirt", SCENE, 50.0, (*EXACT, "solver.step_s=0.016666"), TWICE, SETTINGS[:2])
        return
    for edge_mm in EDGES_MM:
        yield from rest.records("shirt", SCENE, edge_mm, EXACT, TWICE, SETTINGS)
