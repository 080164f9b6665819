"""Lengths and areas of a pattern, as rows of a table."""

from __future__ import annotations

from dataclasses import dataclass

from taichi_tryon.pattern.panel import Pattern


@dataclass(frozen=True)
class SeamRow:
    """A seam's sides, as written, and their lengths [m]; ``ease`` [m] is the difference that the pattern allows."""

    number: int
    name: str
    side_a: str
    side_b: str
    length_a: float
    length_b: float
    ease: float

    @property
    def difference(self) -> float:
        """How much longer side b is [m]."""
        return self.length_b - self.length_a


@dataclass(frozen=True)
class PanelRow:
    """A panel's area [m^2], and the length of its outline [m]."""

    name: str
    area: float
    outline: float


def seam_rows(pattern: Pattern) -> list[SeamRow]:
    """One row a seam, numbered from 1 as in the drawing."""
    return [
        SeamRow(
            number, seam.name, _side(seam.a), _side(seam.b),
            pattern.side_length(seam.a), pattern.side_length(seam.b), seam.ease,
        )
        for number, seam in enumerate(pattern.seams, start=1)
    ]  # fmt: skip


def panel_rows(pattern: Pattern) -> list[PanelRow]:
    """One row a panel."""
    return [
        PanelRow(panel.name, panel.area, sum(edge.length for edge in panel.edges)) for panel in pattern.panels.values()
    ]


def _side(side: tuple[tuple[str, str], ...]) -> str:
    return " + ".join(f"{panel}.{edge}" for panel, edge in side)
