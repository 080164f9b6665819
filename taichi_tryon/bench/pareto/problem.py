"""What is computed: a scene in a size and a fabric."""

from __future__ import annotations

from dataclasses import dataclass, replace

FABRICS = {name: f"configs/fabrics/{name}.yaml" for name in ("table1", "isotropic")}
"""Our measured fabric, and one that simulators of isotropic sheets can express."""
FRAME = 1 / 60
"""What times are counted for [s]."""


@dataclass(frozen=True)
class Problem:
    """A square sheet of ``count`` x ``count`` vertices and a ``side`` [m] falls for a ``duration`` [s]; ``ball`` is the
    radius [m] of the ball around the origin that it falls on, if any. Positions are compared at ``moment`` [s], a whole
    number of frames, the fall until ``compared`` [s]. ``layers``: cloth meets cloth, and crossings are counted."""

    scene: str
    side: float
    count: int
    fabric: str
    duration: float
    ball: float | None = None
    moment: float = 0.5
    compared: float = 0.5
    layers: bool = False

    @property
    def to_compare(self) -> Problem:
        """As much of it as is compared."""
        return replace(self, duration=self.compared)

    @property
    def overrides(self) -> tuple[str, ...]:
        """Values to set in the scene."""
        return (
            f"mesh.edge_length_mm={1000 * self.side / (self.count - 1):.6g}",
            f"garments.0.fabric={FABRICS[self.fabric]}",
            f"drape.duration_s={self.duration:.6g}",
            *(("contact.layers={}",) if self.layers else ()),
        )

    @property
    def parameters(self) -> dict[str, float | str]:
        """What records call it."""
        return {"vertices": self.count**2, "fabric": self.fabric}
