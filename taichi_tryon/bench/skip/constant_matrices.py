"""The blocks of a constant matrix of bending are assembled once, not in every Newton iteration: a hanging sheet.

Reference: the same run that fills them every time. Limit: the same bits.
"""

from collections.abc import Iterator

from taichi_tryon.bench.record import Record
from taichi_tryon.bench.skip.compare import Trial, compared

TRIAL = Trial(
    "constant_matrices",
    "validation/hang.yaml",
    without=("skip.constant_matrices=false",),
    overrides=("mesh.bending=constant",),
    fine=("mesh.edge_length_mm=5",),
    stage="solve",
)


def records(quick: bool) -> Iterator[Record]:
    """With and without."""
    return compared(TRIAL, quick)
