"""A clamped strip of 50 mm bends under its own weight.

Reference: the heavy elastica (``elastica.py``). The direction in which the free end lies gives the load Gamma =
w L^3 / B and with it the equivalent rigidity B, compared with the one put in; the deflection itself saturates and hides
errors.
Gravity is chosen for Gamma 2 to 10, where the direction tells most. A strip at 45 degrees also twists, as D11 and D22
differ, and is held against the refined mesh instead of the elastica; that is itself too near the others for an order.
Both laws of bending are judged, each by its own limits. The order is that from the second finest mesh to the finest:
Delaunay meshes of 5 mm err by less than that would let expect, and with either sign.

The end's drop over its reach, as it depends on Gamma, is the cantilever's master curve of Romero et al. 2021,
"Physical validation of simulators in computer graphics" (doi 10.1145/3450626.3459939).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon import runtime
from taichi_tryon.bench.elastica import load_of, tip
from taichi_tryon.bench.record import Record, at_least, relative
from taichi_tryon.bench.simulate import Outcome, simulate
from taichi_tryon.cloth.model import Bending
from taichi_tryon.units import GF_CM2_PER_CM, GF_PER_CM2_MASS

LENGTH, CLAMP = 0.05, 0.01
# [%] by edge length [mm]; the constant matrix is judged on the meshes that garments have
LIMITS = {
    "mid_edge": {5.0: 10.0, 2.5: 3.0, 1.25: 1.0},
    "constant": {5.0: 12.0, 2.5: 4.0, 1.25: 2.0},
}
EDGES = tuple(LIMITS["mid_edge"])
LEAST_ORDER, CURVE_LIMIT = 1.8, 3.0
REFINED_MM = 1.0
MESHES = ("regular", "alternating", "delaunay", "jittered")
GRAINS = {"warp": 0, "weft": 90, "bias": 45}
GAMMAS = (2.0, 5.0, 10.0)
# Table 1 [gf cm^2/cm], [gf/cm^2]
RIGIDITIES, WEIGHT = {"warp": 0.147, "weft": 0.108, "bias": 0.102}, 0.029


def records(quick: bool) -> Iterator[Record]:
    """Equivalent B on each mesh, and the order with which its error falls. Taichi is started anew."""
    if quick:
        for law, edges in (("mid_edge", EDGES[:2]), ("constant", EDGES[:1])):
            yield from _family("warp", "delaunay", 5.0, edges, law=law)
        return
    for gamma in GAMMAS:
        for cut in ("warp", "weft"):
            for mesh in MESHES if gamma == 5.0 else ("delaunay",):
                yield from _family(cut, mesh, gamma, EDGES)
    refined = rigidity_of(_hanging("bias", "alternating", 5.0, REFINED_MM))
    for mesh in MESHES:
        yield from _family("bias", mesh, 5.0, EDGES, refined)
    for cut in GRAINS:
        yield from _family(cut, "delaunay", 5.0, EDGES, refined if cut == "bias" else None, "constant")


def _family(
    cut: str,
    mesh: str,
    gamma: float,
    edges: tuple[float, ...],
    reference: float | None = None,
    law: Bending = "mid_edge",
) -> Iterator[Record]:
    exact = reference or RIGIDITIES[cut] * GF_CM2_PER_CM
    # fields of ever more strips would be too many for one run of Taichi
    runtime.start("cpu", "f64")
    is_exact = reference is None and law == "mid_edge"
    errors, wall = [], 0.0
    where = {"bending": law, "cut": cut, "mesh": mesh, "gamma": gamma}
    for edge in edges:
        done = _hanging(cut, mesh, gamma, edge, law)
        value, here = rigidity_of(done), {**where, "edge_mm": edge}
        errors.append(value / exact - 1)
        yield relative("cantilever", here, "equivalent_B", "uN m", 1e6 * value, 1e6 * exact, LIMITS[law][edge],
                       done.wall_s)  # fmt: skip
        if is_exact:
            (drop, reach), curve = end_of(done), tip(gamma)
            yield relative("cantilever", here, "drop_over_reach", "1", drop / reach, curve[0] / curve[1], CURVE_LIMIT,
                           done.wall_s)  # fmt: skip
        wall += done.wall_s
    if is_exact and len(edges) > 2:
        order = np.log(abs(errors[-2] / errors[-1])) / np.log(edges[-2] / edges[-1])
        yield at_least("cantilever", where, "order", "1", order, LEAST_ORDER, wall)


def _hanging(cut: str, mesh: str, gamma: float, edge_mm: float, law: Bending = "mid_edge") -> Outcome:
    """The strip at rest."""
    mass = WEIGHT * GF_PER_CM2_MASS
    gravity = gamma * RIGIDITIES[cut] * GF_CM2_PER_CM / (mass * LENGTH**3)
    return simulate(
        "cantilever",
        f"garments.0.sheet.grain_degree={GRAINS[cut]}",
        f"garments.0.sheet.mesh={mesh}",
        f"mesh.edge_length_mm={edge_mm}",
        f"mesh.bending={law}",
        f"gravity_m_s2=[0, {-gravity}, 0]",
    )


def end_of(done: Outcome) -> tuple[float, float]:
    """Drop and reach of the free end [m]."""
    x, y, _ = done.positions[done.edge("right")].mean(axis=0)
    return -y, x - CLAMP


def rigidity_of(done: Outcome) -> float:
    """Equivalent B [N m] of a strip that has come to rest."""
    load = -WEIGHT * GF_PER_CM2_MASS * done.setup.scene.gravity_m_s2[1]
    return load * LENGTH**3 / load_of(*end_of(done))
