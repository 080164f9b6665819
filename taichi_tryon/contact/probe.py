"""Is any of the cloth inside the body? A dense look at every triangle, against the exact field."""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.kernel_loops import shared


@ti.data_oriented
class Probe:
    """Samples all triangles (nt, 3) of the cloth at positions ``x`` on a lattice, against a body field."""

    def __init__(self, triangles: np.ndarray, body, x):
        self.count, self.body, self.x = len(triangles), body, x
        tables = fields.Tables()
        self.triangle = tables.vectors(triangles)
        tables.fill()
        self.depth = ti.field(float, shape=self.count)
        self.gap = ti.field(float, shape=x.shape[0])
        self.inside, self.samples = (ti.field(ti.i32, shape=self.count) for _ in range(2))

    @ti.kernel
    @shared
    def _look(self, spacing: float):
        for t in range(self.count):
            a, b, c = self.x[self.triangle[t][0]], self.x[self.triangle[t][1]], self.x[self.triangle[t][2]]
            side = ti.sqrt(ti.max((b - a).norm_sqr(), (c - b).norm_sqr(), (a - c).norm_sqr()))
            n = ti.max(1, ti.cast(ti.ceil(side / spacing), ti.i32))
            depth, inside, samples = ti.cast(0.0, float), 0, 0
            for i in range(n + 1):
                for j in range(n + 1 - i):
                    point = a + (b - a) * (i / n) + (c - a) * (j / n)
                    samples += 1
                    gap, _normal, _winner, density = self.body.gap_within(point, 0.0, -1)
                    if density > 1.0:
                        depth = ti.max(depth, -gap)
                        inside += 1
            self.depth[t], self.inside[t], self.samples[t] = depth, inside, samples

    def look(self, spacing: float = 2e-3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Deepest point [m] inside the body, number of samples inside, and of all samples, per triangle (nt,)."""
        self._look(spacing)
        return self.depth.to_numpy(), self.inside.to_numpy(), self.samples.to_numpy()

    @ti.kernel
    @shared
    def _gaps(self):
        for i in range(self.gap.shape[0]):
            gap, _normal, _winner = self.body.gap(self.x[i])
            self.gap[i] = gap

    def gaps(self) -> np.ndarray:
        """Distance of each vertex from the skin (nv,) [m] as the field knows it: far out it is only a lower bound."""
        self._gaps()
        return self.gap.to_numpy()
