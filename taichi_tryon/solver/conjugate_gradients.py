"""Preconditioned conjugate gradients with all scalars on the device and one reduction point an iteration."""

import numpy as np
import taichi as ti

from taichi_tryon import fields

# iterations between two looks at whether to stop: a look costs a launch
ITERATIONS_A_LOOK = 5
# below this part of the start, signs are those of single precision's rounding
ROUNDING = 1e-4


@ti.data_oriented
class ConjugateGradients:
    """Solves A d = b in the variant of Chronopoulos and Gear 1989, starting from d = 0.

    The preconditioner is the ``local`` blocks, plus a coarse space where one is given. Vectors are of single precision,
    as the matrix is; sums are not. It stops on the preconditioned norm sqrt(r^T z) relative to that of b: the plain
    residual rises long before the error falls. Where the matrix turns out not to be positive definite it stops too, and
    ``indefinite`` is 1.
    """

    def __init__(self, matrix, local, coarse=None):
        self.matrix, self.local, self.coarse, self.nv = matrix, local, coarse, matrix.nv
        self.two_level = coarse is not None
        # on a CPU the parts of an iteration are too short to be shared out: waking threads costs what they save
        self.alone = ti.cfg.arch == ti.cpu
        self.b = ti.Vector.field(3, float, shape=self.nv)
        # one entry more for the vertices that a local block lacks
        self.r, self.z = (ti.Vector.field(3, ti.f32, shape=self.nv + 1) for _ in range(2))
        self.d, self.az, self.p, self.ap = (ti.Vector.field(3, ti.f32, shape=self.nv) for _ in range(4))
        self.partial = ti.Vector.field(2, ti.f64, shape=fields.CHUNKS)
        # gamma = r.z, and what follows from it
        self.gamma, self.gamma_start, self.beta, self.step = (ti.field(ti.f64, shape=()) for _ in range(4))
        self.going, self.indefinite = (ti.field(ti.i32, shape=()) for _ in range(2))

    @ti.kernel
    def _begin(self):
        for i in range(self.nv):
            self.r[i] = ti.cast(self.matrix.free[i] * self.b[i], ti.f32)
            for field in ti.static((self.d, self.p, self.ap)):
                field[i] = ti.Vector([0.0, 0.0, 0.0], ti.f32)
        self.gamma_start[None] = 0.0
        self.going[None], self.indefinite[None] = 1, 0

    @ti.kernel
    def _iterate(self, tolerance: float):
        """One iteration, each loop of it by all threads."""
        self._iteration(tolerance)

    @ti.kernel
    def _iterate_alone(self, tolerance: float, count: int) -> int:
        """Up to ``count`` iterations by one thread in one launch, with the same bits; returns how many."""
        done = 0
        for _once in range(1):
            while done < count and self.going[None] == 1:
                self._iteration(tolerance)
                done += 1
        return done

    @ti.func
    def _iteration(self, tolerance: float):
        if ti.static(self.two_level):
            for J in range(self.coarse.patch_count):
                self.coarse.restrict(J, self.r)
            for b in range(self.coarse.row_blocks):
                self.coarse.solve_rows(b)
        for c in range(self.local.count):
            self._precondition(c)
        for chunk in range(fields.CHUNKS):
            self._multiply(chunk)
        for _once in range(1):
            self._choose_step(tolerance)
        for chunk in range(fields.CHUNKS):
            self._go_on(chunk)

    @ti.func
    def _precondition(self, c: int):
        """z = D^-1 r + P E^-1 P^T r in local block c."""
        self.local.solve(c, self.r, self.z)
        for a in range(self.local.size):
            i = self.local.member[c * self.local.size + a]
            if i < self.nv:
                z = self.z[i]
                if ti.static(self.two_level):
                    z += self.coarse.prolong(i)
                self.z[i] = ti.cast(self.matrix.free[i], ti.f32) * z

    @ti.func
    def _multiply(self, chunk: int):
        """A z, and the chunk's share of r.z and z.A z."""
        low, high = fields.chunk_bounds(chunk, self.nv)
        dots = ti.Vector([0.0, 0.0], ti.f64)
        for i in range(low, high):
            product = self.matrix.row_product(i, self.z)
            self.az[i] = product
            dots += ti.cast(ti.Vector([self.r[i].dot(self.z[i]), product.dot(self.z[i])]), ti.f64)
        self.partial[chunk] = dots

    @ti.func
    def _choose_step(self, tolerance: float):
        dots = ti.Vector([0.0, 0.0], ti.f64)
        for chunk in range(fields.CHUNKS):
            dots += self.partial[chunk]
        gamma, last = dots[0], self.gamma[None]
        first = self.gamma_start[None] == 0.0
        if first:
            self.gamma_start[None] = gamma
        beta = 0.0 if first else gamma / last
        curvature = dots[1] if first else dots[1] - beta * gamma / self.step[None]
        rounded = ti.abs(gamma) < ROUNDING * ROUNDING * self.gamma_start[None]
        if self.going[None] == 1 and not rounded and (curvature < 0.0 or gamma < 0.0):
            self.indefinite[None] = 1
        if not (curvature > 0.0 and gamma > tolerance * tolerance * self.gamma_start[None]):
            self.going[None] = 0
        if self.going[None] == 1:
            self.beta[None], self.step[None] = beta, gamma / curvature
        self.gamma[None] = gamma

    @ti.func
    def _go_on(self, chunk: int):
        if self.going[None] == 1:
            beta, step = ti.cast(self.beta[None], ti.f32), ti.cast(self.step[None], ti.f32)
            low, high = fields.chunk_bounds(chunk, self.nv)
            for i in range(low, high):
                p, ap = self.z[i] + beta * self.p[i], self.az[i] + beta * self.ap[i]
                self.p[i], self.ap[i] = p, ap
                self.d[i], self.r[i] = self.d[i] + step * p, self.r[i] - step * ap

    def solve(self, tolerance: float, max_iterations: int, refresh: bool = True) -> tuple[int, float]:
        """Solve for ``d``; returns iterations and the reached sqrt(r^T z) relative to that of b.

        ``refresh`` False keeps the coarse space of the last solve, for a matrix that has changed little.
        """
        self._begin()
        self.local.update()
        if self.coarse is not None and refresh:
            self.coarse.update()
        if self.alone:
            count = self._iterate_alone(tolerance, max_iterations)
        else:
            count = self._iterate_together(tolerance, max_iterations)
        start = self.gamma_start[None]
        return count, float(np.sqrt(abs(self.gamma[None]) / start)) if start > 0 else 0.0

    def _iterate_together(self, tolerance: float, most: int) -> int:
        count = 0
        while count < most and self.going[None] == 1:
            for _ in range(ITERATIONS_A_LOOK):
                self._iterate(tolerance)
            count += ITERATIONS_A_LOOK
        return count
