"""What a scene changes about a pattern: closures that it leaves open, and tapes that it sews on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pydantic import Field

from taichi_tryon.pattern import check
from taichi_tryon.pattern.panel import Band, Pattern
from taichi_tryon.pattern.spec import BandSpec, Name
from taichi_tryon.spec import Spec
from taichi_tryon.units import CM


class OpeningSpec(Spec):
    """A part of a seam with a closure (zip, buttons) that is left open, measured along side a of the seam."""

    seam: Name = Field(description="seam of the pattern that has a closure")
    from_cm: float = Field(0.0, ge=0, description="where the opening begins, from the start of side a")
    to_cm: float | None = Field(None, gt=0, description="where it ends; null: at the end of side a")


def changed(pattern: Pattern, openings: Sequence[OpeningSpec], bands: Sequence[BandSpec]) -> Pattern:
    """The pattern with closures opened and bands sewn on; one that is called as one of the pattern takes its place."""
    seams = []
    for seam in pattern.seams:
        length = pattern.side_length(seam.a)
        mine = [o for o in openings if o.seam == seam.name]
        ranges = tuple((o.from_cm * CM, length if o.to_cm is None else o.to_cm * CM) for o in mine)
        seams.append(replace(seam, openings=ranges))
    return replace(pattern, seams=tuple(seams), bands=joined(pattern.bands, bands))


def joined(bands: Sequence[Band], added: Sequence[BandSpec]) -> tuple[Band, ...]:
    """Bands without those that one of the ``added`` takes the place of, and these."""
    names = {band.name for band in added}
    return (*(band for band in bands if band.name not in names), *(band.build() for band in added))


def faults(pattern: Pattern, openings: Sequence[OpeningSpec], bands: Sequence[BandSpec]) -> list[check.Fault]:
    """Every fault of the changes, each with its place in a garment: ``open`` or ``bands``."""
    found = [fault for i, opening in enumerate(openings) for fault in _opening_faults(pattern, opening, i)]
    return found + check.band_faults(replace(pattern, bands=joined((), bands)))


def _opening_faults(pattern: Pattern, opening: OpeningSpec, index: int) -> list[check.Fault]:
    closures = {seam.name: seam for seam in pattern.seams if seam.closure}
    if opening.seam not in closures:
        what = "has no closure" if opening.seam in [seam.name for seam in pattern.seams] else "is not there"
        known = ", ".join(closures) or "none"
        message = f"seam '{opening.seam}' of pattern '{pattern.name}' {what}; seams with a zip or buttons: {known}"
        return [check.Fault(("open", index, "seam"), message)]
    length = pattern.side_length(closures[opening.seam].a) / CM
    end = length if opening.to_cm is None else opening.to_cm
    if end > length * (1 + 1e-9):
        message = f"seam '{opening.seam}' is {length:.4g} cm long (got {end:g}); leave to_cm out to open it to its end"
        return [check.Fault(("open", index, "to_cm"), message)]
    if opening.from_cm >= end:
        message = f"the opening of seam '{opening.seam}' must begin before its end at {end:.4g} cm"
        return [check.Fault(("open", index, "from_cm"), message)]
    return []
