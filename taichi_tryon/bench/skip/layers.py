"""Contact of cloth with cloth, which nobody asked for: a disk on a ball, where cloth meets no cloth. Limit: a tenth of
the contact thickness between layers, our own; steps are found by other ways.
"""

from collections.abc import Iterator

from taichi_tryon.bench.record import Record
from taichi_tryon.bench.skip.compare import Trial, compared

TRIAL = Trial(
    "layers",
    "validation/sphere.yaml",
    without=("contact.layers={}",),
    overrides=("solver.preconditioner=coarse",),
    fine=("mesh.edge_length_mm=5",),
    steps=24,
    limit_mm=0.1,
)


def records(quick: bool) -> Iterator[Record]:
    """With and without."""
    return compared(TRIAL, quick)
