"""Samples of the cloth that cannot have come near the body are not looked at: the top while it is put on.
Reference: all of them looked at in every evaluation. Limit: the same bits.
"""

from collections.abc import Iterator

from taichi_tryon.bench.record import Record
from taichi_tryon.bench.skip.compare import Trial, compared

TRIAL = Trial(
    "far_samples",
    "scenes/quick.yaml",
    without=("skip.far_samples=false",),
    fine=("mesh.edge_length_mm=12",),
)


def records(quick: bool) -> Iterator[Record]:
    """With and without."""
    return compared(TRIAL, quick)
