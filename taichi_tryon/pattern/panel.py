"""A pattern in SI units: panels, each a closed loop of edges with a grain line, and the seams that sew them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from taichi_tryon.pattern.edge import Edge

__all__ = ["Edge", "Panel", "Pattern", "Seam"]

EdgeName = tuple[str, str]
"""An edge anywhere in a pattern: (panel, edge)."""
Closure = Literal["zip", "buttons"]


@dataclass(frozen=True, eq=False)
class Panel:
    """A flat piece of cloth seen from outside the wearer, y up.

    ``edges`` follow each other round the outline, in either sense. ``grain`` (2,) is the unit warp direction in panel
    coordinates. ``levels`` are heights [m] of reference lines across the panel. ``mirror_of`` names the panel whose
    mirror image this one is.
    """

    name: str
    edges: tuple[Edge, ...]
    grain: np.ndarray
    levels: dict[str, float] = field(default_factory=dict)
    mirror_of: str | None = None

    def edge(self, name: str) -> Edge:
        return next(edge for edge in self.edges if edge.name == name)

    @property
    def signed_area(self) -> float:
        """Area [m^2] inside the exact outline, positive for a counter-clockwise loop."""
        return sum(edge.swept_area() for edge in self.edges)

    @property
    def area(self) -> float:
        return abs(self.signed_area)

    def outline(self, points_per_curve: int = 33) -> np.ndarray:
        """The outline as a polygon (n, 2) [m] without a repeated point; curves get this many points."""
        parts = [edge.sample(2 if edge.kind == "line" else points_per_curve)[:-1] for edge in self.edges]
        return np.concatenate(parts)

    def mirrored(self, name: str) -> Panel:
        """The mirror image in the y axis; edges keep their names, and the loop its sense."""
        edges = tuple(edge.mirrored() for edge in reversed(self.edges))
        return Panel(name, edges, self.grain * [-1.0, 1.0] + 0.0, dict(self.levels), mirror_of=self.name)


@dataclass(frozen=True)
class Seam:
    """Two chains of edges sewn together; a dart is a seam whose sides are its two legs.

    Each side lists its edges in their own running order. ``reversed``: the end of ``b`` meets the start of ``a``, as
    wherever both panels are drawn from outside with loops of the same sense. ``ease`` [m] is how much the two sides'
    lengths may differ. A seam may be a ``closure``: a zip, sewn where none of the ``openings``, ranges [m] along side
    a, leaves it open; or buttons, sewn only at the places of ``buttons`` [m] along side a that are not in an opening.
    """

    name: str
    a: tuple[EdgeName, ...]
    b: tuple[EdgeName, ...]
    reversed: bool = True
    ease: float = 0.0
    closure: Closure | None = None
    buttons: tuple[float, ...] = ()
    openings: tuple[tuple[float, float], ...] = ()

    @property
    def marks(self) -> tuple[float, ...]:
        """Places [m] along side a, ends aside, where it begins or ends to be sewn."""
        return (*self.buttons, *(end for opening in self.openings for end in opening))

    def sewn(self, at: np.ndarray) -> np.ndarray:
        """Which (n,) of rising places (n,) [m] along side a, from its start to its end, are sewn.

        A button, and the end of an opening, is at the place nearest to it. An opening leaves its ends sewn, but for
        those that are ends of the seam.
        """

        def nearest(place: float) -> int:
            return int(np.abs(at - place).argmin())

        result = np.full(len(at), self.closure != "buttons")
        result[[nearest(button) for button in self.buttons]] = True
        for begin, end in self.openings:
            first, last = nearest(begin), nearest(end)
            result[first + (first > 0) : last + (last == len(at) - 1)] = False
        return result


@dataclass(frozen=True)
class Band:
    """A tape sewn along ``edges``: a waistband or elastic.

    ``length`` [m] of the whole tape at rest, None: as long as the edges; ``stiffness`` [N]: tension over stretch.
    """

    name: str
    edges: tuple[EdgeName, ...]
    length: float | None
    stiffness: float


@dataclass(frozen=True, eq=False)
class Pattern:
    """All panels of a garment by name, its seams and its bands."""

    name: str
    panels: dict[str, Panel]
    seams: tuple[Seam, ...]
    bands: tuple[Band, ...] = ()

    def edge(self, name: EdgeName) -> Edge:
        panel, edge = name
        return self.panels[panel].edge(edge)

    def side_length(self, side: tuple[EdgeName, ...]) -> float:
        """Length [m] of one side of a seam."""
        return sum(self.edge(name).length for name in side)

    @classmethod
    def from_spec(cls, spec) -> Pattern:
        """The pattern written in a checked ``PatternSpec``, in metres."""
        panels = {name: panel.build(name) for name, panel in spec.panels.items()}
        panels |= {name: panels[original].mirrored(name) for name, original in spec.mirrored_panels.items()}
        seams, bands = (tuple(part.build() for part in parts) for parts in (spec.seams, spec.bands))
        return cls(spec.pattern, panels, seams, bands)
