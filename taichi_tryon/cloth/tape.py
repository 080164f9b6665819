"""Tapes sewn along edges (waistbands, elastic): springs that stretch along the edge and neither weigh nor bend.

A segment of rest length L and stiffness EA [N] stores EA L e^2 / 2 with Green's strain e = (l^2 / L^2 - 1) / 2: the
membrane's law (St. Venant-Kirchhoff) in one dimension.
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields


@ti.data_oriented
class Tapes:
    """The segments (k, 2) of ``vertices`` with their rest ``lengths`` (k,) [m] and ``stiffness`` (k,) [N];
    ``tables`` takes their fields."""

    def __init__(self, tables: fields.Tables, vertices: np.ndarray, lengths: np.ndarray, stiffness: np.ndarray, x):
        self.count, self.x = len(vertices), x
        self.vertex = tables.vectors(vertices)
        self.length, self.stiffness = tables.scalars(lengths), tables.scalars(stiffness)
        start, order = fields.group(vertices.ravel(), x.shape[0])
        self.end_start, self.end = tables.scalars(start), tables.scalars(order)

    @ti.func
    def _strain(self, k: int):
        """Vector from one end to the other over the rest length, and Green's strain."""
        along = (self.x[self.vertex[k][1]] - self.x[self.vertex[k][0]]) / self.length[k]
        return along, (along.dot(along) - 1.0) / 2.0

    @ti.func
    def energy(self, k: int) -> float:
        """Energy [J] of segment k."""
        _, e = self._strain(k)
        return 0.5 * self.stiffness[k] * self.length[k] * e * e

    @ti.func
    def force(self, i: int):
        """Force [N] on vertex i."""
        total = ti.Vector([0.0, 0.0, 0.0])
        for n in range(self.end_start[i], self.end_start[i + 1]):
            k = self.end[n] // 2
            along, e = self._strain(k)
            pull = self.stiffness[k] * e * along
            total += pull if self.end[n] % 2 == 0 else -pull
        return total

    @ti.func
    def block(self, k: int):
        """Positive semi-definite Hessian block [N/m] between the two ends of segment k."""
        along, e = self._strain(k)
        result = along.outer_product(along) + ti.max(e, 0.0) * ti.Matrix.identity(float, 3)
        return -self.stiffness[k] / self.length[k] * result
