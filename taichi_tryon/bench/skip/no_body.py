"""A scene without a body feels none: a hanging sheet, and the same ten metres above a ball. Limit: the same bits.

Near a body no vertex may go far at once: here it may go as far as without one.
"""

from collections.abc import Iterator

from taichi_tryon.bench.record import Record
from taichi_tryon.bench.skip.compare import Trial, compared

TRIAL = Trial(
    "no_body",
    "validation/hang.yaml",
    without=("body=configs/validation/bodies/sphere.yaml",),
    overrides=("garments.0.sheet.origin_cm=[0, 1000, 0]", "solver.longest_move_mm=100"),
    fine=("mesh.edge_length_mm=5",),
)


def records(quick: bool) -> Iterator[Record]:
    """With and without."""
    return compared(TRIAL, quick)
