"""Dry friction on the curvatures of triangles, for every law that knows how far their edges' normals lean.

It acts along warp and weft, each with its own limit. Twist has none: KES does not measure it, and a strip cut at an
angle then rubs with HB_warp cos^2 + HB_weft sin^2, which is the same in every direction where the two are.
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth import bending
from taichi_tryon.cloth.hysteresis import BENDING_REACH, Sliders
from taichi_tryon.cloth.model import Cloth


@ti.data_oriented
class BendingFriction:
    """The sliders of a Cloth's triangles; ``present`` is False, and nothing else is there, where none has a limit.

    ``alpha`` (3,) are the leans of a triangle's edges, as ``bending`` defines them; ``stuck`` (ne,) [N m] is what a
    law notes of the stiffness of its hinges.
    """

    def __init__(self, cloth: Cloth, tables: fields.Tables):
        self.sliders = Sliders(cloth.bend_friction, BENDING_REACH, tables)
        self.present = self.sliders.present
        if self.present:
            self.area = tables.scalars(cloth.areas)
            self.curvature = tables.matrices(bending.edge_curvatures(cloth.gradients))
            self.triangle_edge = tables.vectors(cloth.triangle_edges)
            self.hinge_triangle = tables.vectors(cloth.hinge_triangles)
            self.stuck = ti.field(float, shape=len(cloth.hinges))

    @ti.func
    def potential(self, t: int, alpha) -> float:
        """What friction stores in triangle t and, since the last step, dissipates [J]."""
        return self.area[t] * self.sliders.potential(t, self.curvature[t] @ alpha)

    @ti.func
    def at_edge(self, t: int, e: int, alpha):
        """First and second derivative of the potential with respect to triangle t's lean at its edge e [N m]."""
        measure = self.curvature[t] @ alpha
        q, slope = self.sliders.friction(t, measure), self.sliders.stiffness(t, measure)
        moment, stiffness = ti.cast(0.0, float), ti.cast(0.0, float)
        for k in ti.static(range(3)):
            if self.triangle_edge[t][k] == e:
                for c in ti.static(range(2)):
                    lean = self.curvature[t][c, k]
                    moment += self.area[t] * q[c] * lean
                    stiffness += self.area[t] * slope[c] * lean * lean
        return moment, stiffness

    @ti.func
    def drag(self, t: int, alpha):
        """A step ends: the anchors of triangle t come along."""
        self.sliders.drag(t, self.curvature[t] @ alpha)

    def state(self) -> dict[str, np.ndarray]:
        """The anchors (nt, 2) [1/m]."""
        return self.sliders.state("bend_anchors")

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``."""
        self.sliders.restore("bend_anchors", state)
