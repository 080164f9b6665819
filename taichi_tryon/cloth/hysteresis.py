"""Dry friction inside a fabric: the width of the loops that KES records in shear and in bending.

Fibres that rub hold still until they slip, however slowly: a spring of a force per measure in series with a slider,
side by side with the elastic law (Jenkin's element: Jenkin 1922, "The extension graphic consequent on the structure of
metals"; for cloth Miguel et al. 2013, "Modeling and estimation of internal friction in cloth"). With the anchor g_p of
the spring, the measure g (shear angle 2 E12, or a curvature) and its change d = g - g_p the friction is

    q = Q d / r  while |d| <= r,  else Q sign d,

the gradient of psi = Q (|d| - m + m^2 / (2 r)), m = min(|d|, r).

Q is half the width of the loop, r the reach within which friction is mobilised in full. Over a step the anchor stays
where it is and psi is an incremental potential, so that an implicit step minimises it along with all else; afterwards
the anchor is dragged along to within r (the return map of rate-independent plasticity: Simo and Hughes 1998,
"Computational inelasticity", section 1.4). So no step gains energy, and at rest friction holds what it can.
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.units import CM, DEGREE

# Reaches. KES reads the width 2HG at 0.5 degrees and the rigidity G from there on, 2HB at 0.5 or 1 1/cm and B from 0.5
# on (Kawabata 1980, "The standardization and analysis of hand evaluation"): there friction must be mobilised, or it
# would be counted in the rigidity too. In bending it is well before that: at a fifth.
SHEAR_REACH = 0.5 * DEGREE
"""Shear angle [rad]."""
BENDING_REACH = 0.1 / CM
"""Curvature [1/m]."""


@ti.data_oriented
class Sliders:
    """n elements of m measures each, all of one ``reach``; ``limits`` (n, m) are their Q.

    ``present`` is False where no element has a limit: then there is nothing else in it, and a law leaves it out.
    """

    def __init__(self, limits: np.ndarray, reach: float, tables: fields.Tables):
        self.present, self.reach = bool(limits.any()), reach
        if self.present:
            self.limit = tables.vectors(limits)
            self.anchor = ti.Vector.field(limits.shape[1], float, shape=len(limits))
            self.rubs = ti.field(float, shape=())
            self.switch(True)

    def switch(self, rubs: bool) -> None:
        """Whether there is friction at the moment; where there is none, the anchors wait."""
        if self.present:
            self.rubs[None] = rubs

    @ti.func
    def _stuck(self, change):
        return ti.min(ti.max(change, -self.reach), self.reach)

    @ti.func
    def potential(self, i: int, measure):
        """psi of element i, summed over its measures."""
        size = ti.abs(measure - self.anchor[i])
        stuck = ti.min(size, self.reach)
        return self.rubs[None] * self.limit[i].dot(size - stuck + 0.5 / self.reach * stuck * stuck)

    @ti.func
    def friction(self, i: int, measure):
        """Its derivatives q."""
        return self.rubs[None] / self.reach * self.limit[i] * self._stuck(measure - self.anchor[i])

    @ti.func
    def stiffness(self, i: int, measure):
        """Its second derivatives: none where it slips."""
        size = ti.abs(measure - self.anchor[i])
        return ti.select(size < self.reach, self.rubs[None] / self.reach * self.limit[i], 0.0 * size)

    @ti.func
    def drag(self, i: int, measure):
        """A step ends: the anchors come along."""
        if self.rubs[None] > 0.0:
            self.anchor[i] = measure - self._stuck(measure - self.anchor[i])

    def state(self, name: str) -> dict[str, np.ndarray]:
        """The anchors (n, m) by ``name``."""
        return {name: self.anchor.to_numpy()} if self.present else {}

    def restore(self, name: str, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``."""
        if self.present:
            fields.upload(self.anchor, state[name])
