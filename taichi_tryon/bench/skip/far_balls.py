"""Balls of the body that do not reach to where the cloth is are left out: shins and feet of a woman in a top who raises
her arms, posed anew at every step. Limit: the same bits.
"""

from collections.abc import Iterator

from taichi_tryon.bench.record import Record
from taichi_tryon.bench.skip.compare import Trial, compared

TRIAL = Trial(
    "far_balls",
    "scenes/shirt_raising_arms.yaml",
    without=("skip.far_balls=false",),
    overrides=("contact.layers=null", "drape.duration_s=0", "mesh.edge_length_mm=25"),
    before=26,
    stage="body",
)


def records(quick: bool) -> Iterator[Record]:
    """With and without."""
    return compared(TRIAL, quick)
