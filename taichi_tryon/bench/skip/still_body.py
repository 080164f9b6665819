"""A body that stands still is not posed again, and not looked at again by samples that are where they were last: the
top settling. Limit: the same bits.
"""

from collections.abc import Iterator

from taichi_tryon.bench.record import Record
from taichi_tryon.bench.skip.compare import Trial, compared

TRIAL = Trial(
    "still_body",
    "scenes/quick.yaml",
    without=("skip.still_body=false",),
    fine=("mesh.edge_length_mm=12",),
    before=26,
)


def records(quick: bool) -> Iterator[Record]:
    """With and without."""
    return compared(TRIAL, quick)
