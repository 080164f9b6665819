"""Preconditioned conjugate gradients with all scalars on the device."""

import numpy as np
import taichi as ti

from taichi_tryon import fields

# iterations between two looks at whether to stop: a look costs a launch
ITERATIONS_A_LOOK = 5
# vertices from which on an iteration is shared among threads
SHARED = 20_000
# below this part of the start, signs are those of single precision's rounding
ROUNDING = 1e-4


@ti.data_oriented
class ConjugateGradients:
    """Solves A d = b from d = 0 (Hestenes and Stiefel 1952). The variant with one sum an iteration (Chronopoulos and
    Gear 1989) finds the curvature as a difference, which single precision does not bear where contact is stiff.

    The preconditioner is the ``local`` blocks, plus a coarse space where one is given. Vectors are of single precision,
    as the matrix is; sums are not. It stops on the preconditioned norm sqrt(r^T z) relative to that of b: the plain
    residual rises long before the error falls. Where the matrix turns out not to be positive definite it stops too, and
    ``indefinite`` is 1.
    """

    def __init__(self, matrix, local, coarse=None):
        self.matrix, self.local, self.coarse, self.nv = matrix, local, coarse, matrix.nv
        self.two_level = coarse is not None
        # on a CPU the parts of a short iteration are not worth sharing out: waking threads costs what they save
        self.alone = ti.cfg.arch == ti.cpu and (ti.cfg.cpu_max_num_threads == 1 or self.nv < SHARED)
        self.b = ti.Vector.field(3, float, shape=self.nv)
        self.d = ti.Vector.field(3, ti.f32, shape=self.nv)
        # of four entries, the fourth 0: a processor takes them at once
        self.p, self.ap = (ti.Vector.field(4, ti.f32, shape=self.nv) for _ in range(2))
        # one more for the vertices that a local block lacks
        self.r, self.z = (ti.Vector.field(4, ti.f32, shape=self.nv + 1) for _ in range(2))
        self.partial = ti.field(ti.f64, shape=fields.CHUNKS)
        # gamma = r.z, and what follows from it
        self.gamma, self.gamma_start, self.beta, self.step = (ti.field(ti.f64, shape=()) for _ in range(4))
        self.going, self.indefinite = (ti.field(ti.i32, shape=()) for _ in range(2))

    @ti.kernel
    def _begin(self):
        for i in range(self.nv):
            b = ti.cast(self.matrix.free[i] * self.b[i], ti.f32)
            for k in ti.static(range(3)):
                self.r[i][k] = b[k]
            self.d[i] = ti.Vector([0.0, 0.0, 0.0], ti.f32)
            self.p[i] = ti.Vector([0.0] * 4, ti.f32)
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
        for chunk in range(fields.CHUNKS):
            self._precondition(chunk)
        for _once in range(1):
            self._turn(tolerance)
        for chunk in range(fields.CHUNKS):
            self._aim(chunk)
        for chunk in range(fields.CHUNKS):
            self._multiply(chunk)
        for _once in range(1):
            self._choose_step()
        for chunk in range(fields.CHUNKS):
            self._go(chunk)

    @ti.func
    def _precondition(self, chunk: int):
        """z = D^-1 r + P E^-1 P^T r, and the chunk's share of r.z."""
        low, high = fields.chunk_bounds(chunk, self.local.count)
        dots = ti.Vector([0.0] * 4, ti.f64)
        for c in range(low, high):
            self.local.solve(c, self.r, self.z)
            for a in range(self.local.size):
                i = self.local.member[c * self.local.size + a]
                if i < self.nv:
                    shift = ti.Vector([0.0] * 3, ti.f32)
                    if ti.static(self.two_level):
                        shift = self.coarse.prolong(i)
                    z = self.z[i]
                    for k in ti.static(range(3)):
                        z[k] += shift[k]
                    z *= self.matrix.mask[i]
                    self.z[i] = z
                    dots += ti.cast(self.r[i] * z, ti.f64)
        self.partial[chunk] = dots.sum()

    @ti.func
    def _sum(self):
        total = ti.cast(0.0, ti.f64)
        for chunk in range(fields.CHUNKS):
            total += self.partial[chunk]
        return total

    @ti.func
    def _turn(self, tolerance: float):
        """Choose beta, by which the last direction counts, or stop."""
        gamma, last = self._sum(), self.gamma[None]
        first = self.gamma_start[None] == 0.0
        if first:
            self.gamma_start[None] = gamma
        if self.going[None] == 1 and gamma < 0.0 and not self._rounded(gamma):
            self.indefinite[None] = 1
        if not gamma > tolerance * tolerance * self.gamma_start[None]:
            self.going[None] = 0
        self.beta[None] = 0.0 if first else gamma / last
        self.gamma[None] = gamma

    @ti.func
    def _aim(self, chunk: int):
        """The direction p = z + beta p."""
        if self.going[None] == 1:
            beta = ti.cast(self.beta[None], ti.f32)
            low, high = fields.chunk_bounds(chunk, self.nv)
            for i in range(low, high):
                self.p[i] = self.z[i] + beta * self.p[i]

    @ti.func
    def _multiply(self, chunk: int):
        """A p, and the chunk's share of p.A p."""
        low, high = fields.chunk_bounds(chunk, self.nv)
        dots = ti.Vector([0.0] * 4, ti.f64)
        for i in range(low, high):
            product = self.matrix.row_product(i, self.p)
            self.ap[i] = product
            dots += ti.cast(self.p[i] * product, ti.f64)
        self.partial[chunk] = dots.sum()

    @ti.func
    def _choose_step(self):
        curvature = self._sum()
        if self.going[None] == 1:
            if curvature > 0.0:
                self.step[None] = self.gamma[None] / curvature
            else:
                self.going[None] = 0
                if curvature < 0.0 and not self._rounded(self.gamma[None]):
                    self.indefinite[None] = 1

    @ti.func
    def _rounded(self, gamma):
        """Whether so little is left that signs may be those of rounding."""
        return ti.abs(gamma) < ROUNDING * ROUNDING * self.gamma_start[None]

    @ti.func
    def _go(self, chunk: int):
        """Go a step along p."""
        if self.going[None] == 1:
            step = ti.cast(self.step[None], ti.f32)
            low, high = fields.chunk_bounds(chunk, self.nv)
            for i in range(low, high):
                p = self.p[i]
                self.r[i] = self.r[i] - step * self.ap[i]
                self.d[i] = self.d[i] + step * ti.Vector([p[0], p[1], p[2]])

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
