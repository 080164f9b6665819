"""Preconditioned conjugate gradients with all scalars on the device."""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.kernel_loops import several_threads, shared_if_many
from taichi_tryon.solver.crew import Crew

# iterations between two looks at whether to stop: a look costs a launch
ITERATIONS_A_LOOK = 5
# into how many parts each loop of an iteration is divided on a CPU
PARTS = 128
# iterations in one launch on a CPU, times the vertices: some 10 ms; who has retired from a launch is back in the next
A_LAUNCH, MOST_A_LAUNCH = 250_000, 400
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
        cpu = ti.cfg.arch == ti.cpu
        # the loops of an iteration on a CPU, and what follows from which
        self.works = [self._restrict, self._solve_rows] if self.two_level else []
        self.works += [self._precondition, self._aim, self._multiply, self._go]
        self.conclusions = [(len(self.works) - 4, self._turn), (len(self.works) - 2, self._choose_step)]
        self.loops = len(self.works)
        threads = ti.cfg.cpu_max_num_threads if several_threads() else 1
        self.a_launch = min(max(1, A_LAUNCH // self.nv), MOST_A_LAUNCH)
        self.crew = Crew(threads, self.loops * self.a_launch, PARTS) if cpu else None
        self.b = ti.Vector.field(3, float, shape=self.nv)
        self.d = ti.Vector.field(3, ti.f32, shape=self.nv)
        # of four entries, the fourth 0: a processor takes them at once
        self.p, self.ap = (ti.Vector.field(4, ti.f32, shape=self.nv) for _ in range(2))
        # one more for the vertices that a local block lacks
        self.r, self.z = (ti.Vector.field(4, ti.f32, shape=self.nv + 1) for _ in range(2))
        self.partial = ti.field(ti.f64, shape=fields.CHUNKS)
        # gamma = r.z, and what follows from it
        self.gamma, self.gamma_start, self.beta, self.step = (ti.field(ti.f64, shape=()) for _ in range(4))
        self.going, self.indefinite, self.count = (ti.field(ti.i32, shape=()) for _ in range(3))

    @ti.kernel
    def _begin(self):
        for i in range(self.nv):
            b = ti.cast(self.matrix.free[i] * self.b[i], ti.f32)
            for k in ti.static(range(3)):
                self.r[i][k] = b[k]
            self.d[i] = ti.Vector([0.0, 0.0, 0.0], ti.f32)
            self.p[i] = ti.Vector([0.0] * 4, ti.f32)
        self.gamma_start[None] = 0.0
        self.going[None], self.indefinite[None], self.count[None] = 1, 0, 0

    @ti.kernel
    def _iterate(self, tolerance: float):
        """One iteration, each loop of it by all threads of a GPU."""
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
            self._choose_step(tolerance)
        for chunk in range(fields.CHUNKS):
            self._go(chunk)

    @ti.kernel
    @shared_if_many
    def _iterate_together(self, tolerance: float, most: int):
        """Up to so many iterations by the threads of a CPU, in one launch, with the same bits."""
        for phase in range(self.crew.phases):
            self.crew.begin(phase)
        for turn in range(self.crew.turns):
            if turn % fields.LEAST_TURNS == 0:
                phase, staying = 0, 1
                while staying == 1 and phase < self.loops * most and (phase % self.loops > 0 or self.going[None] == 1):
                    staying = self._share(turn // fields.LEAST_TURNS, phase, tolerance)
                    phase += 1

    @ti.func
    def _share(self, thread: int, phase: int, tolerance: float) -> int:
        """Do this thread's share of a phase's work on all chunks; who ends the last of them concludes. Whether to go
        on."""
        for n in range(self.crew.threads):
            owner = (thread + n) % self.crew.threads
            part = self.crew.take(phase, owner)
            while part < PARTS:
                for chunk in range(part * fields.CHUNKS // PARTS, (part + 1) * fields.CHUNKS // PARTS):
                    for number, work in ti.static(enumerate(self.works)):
                        if phase % self.loops == number:
                            work(chunk)
                if self.crew.ends(phase):
                    for number, conclude in ti.static(self.conclusions):
                        if phase % self.loops == number:
                            conclude(tolerance)
                    self.crew.leave(phase)
                part = self.crew.take(phase, owner)
        return self.crew.wait(phase)

    @ti.func
    def _restrict(self, chunk: int):
        low, high = fields.chunk_bounds(chunk, self.coarse.patch_count)
        for J in range(low, high):
            self.coarse.restrict(J, self.r)

    @ti.func
    def _solve_rows(self, chunk: int):
        low, high = fields.chunk_bounds(chunk, self.coarse.row_blocks)
        for b in range(low, high):
            self.coarse.solve_rows(b)

    @ti.func
    def _precondition(self, chunk: int):
        """z = D^-1 r + P E^-1 P^T r, and the chunk's share of r.z."""
        low, high = fields.chunk_bounds(chunk, self.local.count)
        dots = ti.Vector([0.0] * 4, ti.f64)
        for c in range(low, high):
            self.local.solve(c, self.r, self.z)
            for a in range(self.local.vertices[0]):
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
        self.count[None] += self.going[None]
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
    def _choose_step(self, tolerance: float):
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
        while self.count[None] < max_iterations and self.going[None] == 1:
            if self.crew is None:
                for _ in range(ITERATIONS_A_LOOK):
                    self._iterate(tolerance)
            else:
                self._iterate_together(tolerance, min(self.a_launch, max_iterations - self.count[None]))
        start = self.gamma_start[None]
        return self.count[None], float(np.sqrt(abs(self.gamma[None]) / start)) if start > 0 else 0.0
