"""Tapes sewn along edges (waistbands, elastic): springs that stretch along the edge and neither weigh nor bend.

A segment of rest length L and stiffness EA [N], now l long, stores EA L e^2 / 2 with the stretch e = l / L - 1: its
tension EA e is Hooke's law at any stretch, as elastic is specified (so much force at so much per cent). The membrane's
own law, on Green's strain, would pull 1.7 times as hard at 40 %.
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields

# a length over the rest length below which a segment has no direction
LEAST = 1e-9


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
    def _stretch(self, k: int):
        """Unit vector from one end to the other, and length over rest length."""
        along = (self.x[self.vertex[k][1]] - self.x[self.vertex[k][0]]) / self.length[k]
        ratio = along.norm()
        return along / ti.max(ratio, LEAST), ratio

    @ti.func
    def energy(self, k: int) -> float:
        """Energy [J] of segment k."""
        _, ratio = self._stretch(k)
        return 0.5 * self.stiffness[k] * self.length[k] * (ratio - 1.0) ** 2

    @ti.func
    def force(self, i: int):
        """Force [N] on vertex i."""
        total = ti.Vector([0.0, 0.0, 0.0])
        for n in range(self.end_start[i], self.end_start[i + 1]):
            k = self.end[n] // 2
            along, ratio = self._stretch(k)
            pull = self.stiffness[k] * (ratio - 1.0) * along
            total += pull if self.end[n] % 2 == 0 else -pull
        return total

    @ti.func
    def block(self, k: int):
        """Positive semi-definite Hessian block [N/m] between the two ends of segment k."""
        along, ratio = self._stretch(k)
        across = ti.max(1.0 - 1.0 / ti.max(ratio, LEAST), 0.0)  # slack, it would be negative
        lengthwise = along.outer_product(along)
        result = lengthwise + across * (ti.Matrix.identity(float, 3) - lengthwise)
        return -self.stiffness[k] / self.length[k] * result
