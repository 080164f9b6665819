"""Friction and damping within the fabric, which figures of 0 leave out: a hanging sheet with constant bending, and the
same with figures that do nothing, 1e-9. Limit: 10 um, our own;
the one's matrix has more blocks than the other's, and rounds otherwise.
"""

from collections.abc import Iterator

from taichi_tryon.bench.record import Record
from taichi_tryon.bench.skip.compare import Trial, compared

TRIAL = Trial(
    "fabric_friction",
    "validation/hang.yaml",
    without=(
        "garments.0.fabric.damping_time_s=1e-9",
        "garments.0.fabric.shear_hysteresis_gf_per_cm=1e-9",
        "garments.0.fabric.bending_hysteresis_warp_gf_cm_per_cm=1e-9",
        "garments.0.fabric.bending_hysteresis_weft_gf_cm_per_cm=1e-9",
    ),
    overrides=(
        "mesh.bending=constant",
        "garments.0.fabric.damping_time_s=0",
        "solver.newton_tolerance=1e-4",
        "solver.linear_tolerance=1e-4",
        "solver.max_newton_iterations=10",
    ),
    fine=("mesh.edge_length_mm=5",),
    limit_mm=1e-2,
    stage="solve",
)


def records(quick: bool) -> Iterator[Record]:
    """With and without."""
    return compared(TRIAL, quick)
