"""Preconditioned conjugate gradients with all scalars on the device and one reduction point an iteration."""

import numpy as np
import taichi as ti

from taichi_tryon import fields

# iterations between two looks at whether to stop: a look costs a launch
ITERATIONS_A_LOOK = 5


@ti.data_oriented
class ConjugateGradients:
    """Solves A d = b in the variant of Chronopoulos and Gear 1989, starting from d = 0.

    The preconditioner is block-Jacobi, plus a coarse space where one is given. It stops on the preconditioned norm
    sqrt(r^T z) relative to that of b: the plain residual rises long before the error falls. Where the matrix turns out
    not to be positive definite it stops too, and ``indefinite`` is 1.
    """

    def __init__(self, matrix, coarse=None):
        self.matrix, self.coarse, self.nv = matrix, coarse, matrix.nv
        self.two_level = coarse is not None
        self.b, self.d, self.r, self.z, self.az, self.p, self.ap = (
            ti.Vector.field(3, float, shape=self.nv) for _ in range(7)
        )
        self.jacobi = ti.Matrix.field(3, 3, ti.f32, shape=self.nv)
        self.partial = ti.Vector.field(2, ti.f64, shape=fields.CHUNKS)
        # gamma = r.z, and what follows from it
        self.gamma, self.gamma_start, self.beta, self.step = (ti.field(ti.f64, shape=()) for _ in range(4))
        self.going, self.indefinite = (ti.field(ti.i32, shape=()) for _ in range(2))
        self.stiffness_sum = ti.field(ti.f64, shape=fields.CHUNKS)

    @ti.kernel
    def _begin(self):
        for i in range(self.nv):
            inverse = self.matrix.own(i).inverse()
            free = self.matrix.free[i]
            self.jacobi[i] = ti.cast(inverse * free.outer_product(free), ti.f32)
            self.r[i] = free * self.b[i]
            for field in ti.static((self.d, self.p, self.ap)):
                field[i] = ti.Vector([0.0, 0.0, 0.0])
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            total = ti.cast(0.0, ti.f64)
            for i in range(low, high):
                total += self.matrix.stiffness[i]
            self.stiffness_sum[chunk] = total
        self.gamma_start[None] = 0.0
        self.going[None], self.indefinite[None] = 1, 0

    @ti.kernel
    def _iterate(self, tolerance: float):
        if ti.static(self.two_level):
            for J in range(self.coarse.node_count):
                self.coarse.restrict(J, self.r)
            for k in range(self.coarse.size):
                self.coarse.solve_row(k)
        for i in range(self.nv):
            z = ti.cast(self.jacobi[i], float) @ self.r[i]
            if ti.static(self.two_level):
                z += self.coarse.prolong(i)
            self.z[i] = z
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            dots = ti.Vector([0.0, 0.0], ti.f64)
            for i in range(low, high):
                product = self.matrix.row_product(i, self.z)
                self.az[i] = product
                dots += ti.Vector([self.r[i].dot(self.z[i]), product.dot(self.z[i])], ti.f64)
            self.partial[chunk] = dots
        for _once in range(1):
            dots = ti.Vector([0.0, 0.0], ti.f64)
            for chunk in range(fields.CHUNKS):
                dots += self.partial[chunk]
            gamma, last = dots[0], self.gamma[None]
            first = self.gamma_start[None] == 0.0
            if first:
                self.gamma_start[None] = gamma
            beta = 0.0 if first else gamma / last
            curvature = dots[1] if first else dots[1] - beta * gamma / self.step[None]
            if self.going[None] == 1 and (curvature < 0.0 or gamma < 0.0):
                self.indefinite[None] = 1
            if not (curvature > 0.0 and gamma > tolerance * tolerance * self.gamma_start[None]):
                self.going[None] = 0
            if self.going[None] == 1:
                self.beta[None], self.step[None] = beta, gamma / curvature
            self.gamma[None] = gamma
        for i in range(self.nv):
            if self.going[None] == 1:
                beta, step = ti.cast(self.beta[None], float), ti.cast(self.step[None], float)
                self.p[i] = self.z[i] + beta * self.p[i]
                self.ap[i] = self.az[i] + beta * self.ap[i]
                self.d[i] += step * self.p[i]
                self.r[i] -= step * self.ap[i]

    def solve(self, tolerance: float, max_iterations: int, reach: float, refresh: bool = True) -> tuple[int, float]:
        """Solve for ``d``; returns iterations and the reached sqrt(r^T z) relative to that of b.

        ``refresh`` False keeps the coarse space of the last solve, for a matrix that has changed little.
        """
        self._begin()
        if self.coarse is not None and refresh:
            self.coarse.update(float(self.stiffness_sum.to_numpy().sum()) / self.nv, reach)
        count = 0
        while count < max_iterations and self.going[None] == 1:
            for _ in range(ITERATIONS_A_LOOK):
                self._iterate(tolerance)
            count += ITERATIONS_A_LOOK
        start = self.gamma_start[None]
        return count, float(np.sqrt(abs(self.gamma[None]) / start)) if start > 0 else 0.0
