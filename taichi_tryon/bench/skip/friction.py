"""Friction on the body, which a coefficient of 0 leaves out: a sheet on a level floor, and the same with one that holds
nothing, 1e-9, which is the reference. Limit: 1 um."""

from collections.abc import Iterator

from taichi_tryon.bench.record import Record
from taichi_tryon.bench.skip.compare import Trial, compared

TRIAL = Trial(
    "friction",
    "validation/incline.yaml",
    without=("contact.friction=1e-9",),
    overrides=("contact.friction=0", "mesh.edge_length_mm=4"),
    fine=("mesh.edge_length_mm=2",),
    limit_mm=1e-3,
)


def records(quick: bool) -> Iterator[Record]:
    """With and without."""
    return compared(TRIAL, quick)
