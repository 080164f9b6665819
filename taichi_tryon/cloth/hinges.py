"""The hinges between neighbouring triangles: their spread, the moments in them, and internal friction on its rate.

Both laws of bending count rates here: a hinge's spread does not change when the cloth turns as a whole. Forces are
gathered at the vertices, so that no two threads write to one place.
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth import bending
from taichi_tryon.cloth.model import Cloth

# Heights below this share of the rest height count as that share in the hinge gradient.
LEAST_HEIGHT = 0.2


@ti.data_oriented
class Hinges:
    """The ``count`` edges of a Cloth at positions ``x`` (nv vectors), borders among them, which have none.

    ``spread`` (see ``bending``) and its ``slope`` at the four vertices [1/m] are as last measured; a law sets
    ``moment`` [N m]. ``clamp`` (ne,) are the Cloth's ``edge_clamps``; ``stiffness`` (ne,) [N m], from its
    ``edge_stiffness``, is that of a spread with the edge's rotation held. Undamped, it has no rate.
    """

    def __init__(self, cloth: Cloth, edge_stiffness: np.ndarray, x, tables: fields.Tables):
        self.count, self.x = len(cloth.hinges), x
        self.vertex = tables.vectors(cloth.hinges)
        diagonal, heights = np.zeros(self.count), np.full((self.count, 2), 1.0)
        gradients, signs = cloth.gradients, cloth.edge_signs
        for k in range(3):
            edges = cloth.triangle_edges[:, k]
            np.add.at(diagonal, edges, edge_stiffness[:, k, k])
            # 1 / |gradient of the hat of corner k| is the height over edge k
            height = LEAST_HEIGHT / np.linalg.norm(gradients[:, k], axis=1)
            heights[edges, np.where(signs[:, k] > 0, 0, 1)] = height
        # on the border of a clamp the whole spread is that of the triangle which can bend
        clamps = cloth.edge_clamps
        share = np.where(clamps == 0, 0.5, 1.0)
        interior = cloth.hinge_triangles[:, 1] >= 0
        self.clamp = tables.scalars(clamps)
        self.stiffness = tables.scalars(np.where(interior, share * share * diagonal, 0.0))
        damping = cloth.modulus("damping_time")
        self.damped = bool(damping.any())
        self.least_height = tables.vectors(heights)
        self.spread, self.moment = (ti.field(float, shape=self.count) for _ in range(2))
        if self.damped:
            # a triangle beside each, by which its energy is counted
            self.triangle = tables.scalars(cloth.hinge_triangles[:, 0])
            self.tau = tables.scalars(damping[cloth.fabric[cloth.hinge_triangles[:, 0]]])
            self.spread_start, self.spread_ref = (ti.field(float, shape=self.count) for _ in range(2))
        self.slope = ti.Vector.field(3, float, shape=(self.count, 4))
        held = np.flatnonzero(cloth.hinges.ravel() >= 0)
        start, order = fields.group(cloth.hinges.ravel()[held], cloth.vertex_count)
        self.role_start, self.role = tables.scalars(start), tables.scalars(held[order])

    @ti.func
    def inner(self, e: int):
        """Whether edge e has a triangle on each side."""
        return self.vertex[e][3] >= 0

    @ti.func
    def share(self, e: int) -> float:
        """The part of edge e's spread that is a bendable triangle's beside it."""
        result = ti.cast(0.5, float)
        if self.clamp[e] != 0:
            result = 1.0
        return result

    @ti.func
    def _spread(self, e: int):
        """Spread of edge e, and its derivative with respect to the angle."""
        h = self.vertex[e]
        result = ti.Vector([0.0, 1.0])
        if h[3] >= 0:
            result = bending.hinge_spread(self.x[h[0]], self.x[h[1]], self.x[h[2]], self.x[h[3]])
        return result

    @ti.func
    def _gradient(self, e: int):
        h, least = self.vertex[e], self.least_height[e]
        return bending.hinge_gradient(self.x[h[0]], self.x[h[1]], self.x[h[2]], self.x[h[3]], least[0], least[1])

    @ti.func
    def measure(self, e: int):
        """Spread and slope of an inner edge at the present positions."""
        spread = self._spread(e)
        self.spread[e] = spread[0]
        g = spread[1] * self._gradient(e)
        for k in ti.static(range(4)):
            self.slope[e, k] = ti.Vector([g[k, 0], g[k, 1], g[k, 2]])

    @ti.kernel
    def begin_step(self):
        """Remember the spreads: internal friction acts on the change since here."""
        for e in range(self.count):
            now = self._spread(e)[0]
            self.spread_start[e], self.spread_ref[e] = now, now

    @ti.kernel
    def begin_stage(self, v: ti.template(), ahead: float, beyond: float):
        """Count rates as a stage of ``solver.schemes`` counts velocities: see ``Elastic.begin_stage``."""
        for e in range(self.count):
            h = self.vertex[e]
            if h[3] >= 0:
                spread = self._spread(e)
                slope = spread[1] * self._gradient(e)
                rate = ti.cast(0.0, float)
                for k in ti.static(range(4)):
                    rate += ti.Vector([slope[k, 0], slope[k, 1], slope[k, 2]]).dot(v[h[k]])
                change = spread[0] - self.spread_start[e]
                self.spread_ref[e] = self.spread_start[e] + ahead * rate + beyond * change

    @ti.func
    def dragged(self, e: int, inverse_dt: float) -> float:
        """Stiffness [N m] of internal friction in edge e."""
        stiffness = ti.cast(0.0, float)
        if ti.static(self.damped):
            stiffness = self.stiffness[e] * self.tau[e] * inverse_dt
        return stiffness

    @ti.func
    def drag(self, e: int, inverse_dt: float) -> float:
        """Moment [N m] of internal friction in edge e."""
        moment = ti.cast(0.0, float)
        if ti.static(self.damped):
            moment = self.stiffness[e] * self.tau[e] * inverse_dt * (self.spread[e] - self.spread_ref[e])
        return moment

    @ti.func
    def drag_energy(self, chunk: int, inverse_dt: float, first: int, last: int):
        """A chunk's share of what the drag does [J] in the triangles from ``first`` to before ``last``."""
        total = ti.cast(0.0, ti.f64)
        low, high = fields.chunk_bounds(chunk, self.count)
        for e in range(low, high):
            if first <= self.triangle[e] < last:
                total += 0.5 * self.drag(e, inverse_dt) * (self.spread[e] - self.spread_ref[e])
        return total

    @ti.func
    def force(self, i: int):
        """Force [N] of the moments on vertex i."""
        total = ti.Vector([0.0, 0.0, 0.0])
        for n in range(self.role_start[i], self.role_start[i + 1]):
            e, k = self.role[n] // 4, self.role[n] % 4
            if self.vertex[e][3] >= 0:
                total -= self.moment[e] * self.slope[e, k]
        return total

    @ti.func
    def block(self, e: int, i: int, j: int, stiffness: float):
        """Hessian block between roles i and j of edge e of that stiffness [N m], without the spread's curvature."""
        return stiffness * self.slope[e, i].outer_product(self.slope[e, j])
