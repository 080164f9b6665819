"""The local part of the preconditioner: small blocks of neighbouring vertices, each solved for itself (block-Jacobi).

What neighbours do to each other stiffly and at short range, which a coarse space cannot see, they settle here. Larger
blocks save iterations but their inverses have to be read from memory in each; eight vertices were fastest.
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.kernel_loops import shared_if_many
from taichi_tryon.solver.matrix import unpacked

# how many threads of a CPU can invert blocks at once
CREWS = 32


@ti.data_oriented
class LocalBlocks:
    """Inverses of the blocks of a Matrix on the groups of ``owner`` (nv,), of at most ``size`` vertices each."""

    def __init__(self, matrix, owner: np.ndarray, size: int):
        self.matrix, self.size, self.nv = matrix, size, len(owner)
        start, order = fields.group(owner, owner.max() + 1)
        self.count = len(start) - 1
        # where a block has fewer vertices, the rest is one that does not exist
        member = np.full((self.count, size), self.nv)
        place = np.arange(self.nv) - np.repeat(start[:-1], np.diff(start))
        member[owner[order], place] = order
        slot = np.empty(self.nv, np.int64)
        slot[order] = place
        tables = fields.Tables()
        self.member = tables.scalars(member.ravel())
        # ``size``, for loops at run time: a compiler that knows it unrolls them all, at a second of every start
        self.vertices = tables.scalars(np.array([size]))
        self.owner, self.slot = tables.scalars(owner), tables.scalars(slot)
        tables.fill()
        # so many columns of a block are worked on together, a power of 2 that a processor's registers hold
        self.lanes = 8 if size % 8 == 0 else 3
        self.parts = 3 * size // self.lanes
        # what the matrix has in a block, and its inversion, where each of some crews works; idle turns between theirs,
        # that Taichi shares them among the threads of a CPU
        cpu = ti.cfg.arch == ti.cpu
        self.crews, self.turns = (min(CREWS, self.count), fields.LEAST_TURNS) if cpu else (self.count, 1)
        self.entry = ti.field(ti.f64, shape=(self.crews, 3 * size, 3 * size))
        self.factor = ti.field(ti.f64, shape=(self.crews, 3 * size))
        self.work = ti.Vector.field(self.lanes, ti.f64, shape=(self.crews, 3 * size, self.parts))
        self.inverse = ti.Vector.field(self.lanes, ti.f32, shape=(self.count, 3 * size, self.parts))

    @ti.kernel
    @shared_if_many
    def update(self):
        """Invert the blocks of the matrix as it is."""
        for turn in range(self.crews * self.turns):
            if turn % self.turns == 0:
                self._invert(turn // self.turns)

    @ti.func
    def _invert(self, crew: int):
        """The crew's share of the blocks."""
        for c in range(crew * self.count // self.crews, (crew + 1) * self.count // self.crews):
            self._fill(crew, c)
            for k in range(3 * self.vertices[0]):
                self._sweep(crew, k)
            for row in range(3 * self.vertices[0]):
                for part in range(self.parts):
                    self.inverse[c, row, part] = -ti.cast(self.work[crew, row, part], ti.f32)

    @ti.func
    def _fill(self, crew: int, c: int):
        """Set ``work`` to block c."""
        for row in range(3 * self.vertices[0]):
            for column in range(3 * self.vertices[0]):
                self.entry[crew, row, column] = 0.0
        for a in range(self.vertices[0]):
            self._fill_row(crew, c, a)
        for row in range(3 * self.vertices[0]):
            for part in range(self.parts):
                first = part * self.lanes
                self.work[crew, row, part] = ti.Vector(
                    [self.entry[crew, row, first + k] for k in ti.static(range(self.lanes))]
                )

    @ti.func
    def _fill_row(self, crew: int, c: int, a: int):
        """What the matrix has in row ``a`` of block c; where a vertex is held, or none is there, that of the unit."""
        i = self.member[c * self.size + a]
        if i == self.nv:
            for k in range(3):
                self.entry[crew, 3 * a + k, 3 * a + k] = 1.0
        else:
            own, free = self.matrix.own(i), self.matrix.free[i]
            own *= free.outer_product(free)
            for k in ti.static(range(3)):
                own[k, k] += 1.0 - free[k]
            self._put(crew, a, a, own)
            for n in range(self.matrix.row_start[i], self.matrix.row_start[i + 1]):
                j = self.matrix.column[n]
                if self.owner[j] == c:
                    block = unpacked(self.matrix.block[n])
                    self._put(crew, a, self.slot[j], self.matrix.masked(i, j, block))
            if ti.static(self.matrix.bending.constant):
                for n in range(self.matrix.far_start[i], self.matrix.far_start[i + 1]):
                    j = self.matrix.far_column[n]
                    if self.owner[j] == c:
                        block = ti.cast(self.matrix.far_value[n], float) * ti.Matrix.identity(float, 3)
                        self._put(crew, a, self.slot[j], self.matrix.masked(i, j, block))

    @ti.func
    def _put(self, crew: int, a: int, b: int, block):
        for k in ti.static(range(3)):
            for m in ti.static(range(3)):
                self.entry[crew, 3 * a + k, 3 * b + m] = ti.cast(block[k, m], ti.f64)

    @ti.func
    def _sweep(self, crew: int, k: int):
        """The symmetric sweep operator at row k; swept at all of them, ``work`` is minus its inverse.

        Pivots are on the diagonal: the blocks are positive definite. (Goodnight 1979, "A tutorial on the SWEEP
        operator".) Whole rows at a time, and no x[i] -= y, which Taichi takes for an atomic operation.
        """
        here = k // self.lanes
        pivot = ti.cast(0.0, ti.f64)
        # 1 in column k, as a processor blends
        mark = ti.Vector([0.0] * self.lanes, ti.f64)
        for m in ti.static(range(self.lanes)):
            if here * self.lanes + m == k:
                mark[m] = 1.0
                pivot = self.work[crew, k, here][m]
        scale = 1.0 / pivot
        pivots = [self.work[crew, k, part] for part in ti.static(range(self.parts))]
        # the column k, which is the row
        for part in ti.static(range(self.parts)):
            for m in ti.static(range(self.lanes)):
                self.factor[crew, part * self.lanes + m] = scale * pivots[part][m]
        for row in range(3 * self.vertices[0]):
            factor = self.factor[crew, row]
            for part in ti.static(range(self.parts)):
                self.work[crew, row, part] = self.work[crew, row, part] - factor * pivots[part]
            entry = self.work[crew, row, here]
            self.work[crew, row, here] = entry + mark * (factor - entry)
        for part in ti.static(range(self.parts)):
            self.work[crew, k, part] = scale * pivots[part]
        entry = self.work[crew, k, here]
        self.work[crew, k, here] = entry - mark * (entry + scale)

    @ti.func
    def solve(self, c: int, r: ti.template(), z: ti.template()):
        """Set what block c has of the vector field z to its inverse times r, both of single precision, with an entry
        for the vertex that is missing."""
        for part in range(self.parts):
            total = ti.Vector([0.0] * self.lanes, ti.f32)
            for b in range(self.vertices[0]):
                source = r[self.member[c * self.size + b]]
                for k in ti.static(range(3)):
                    # the inverse is symmetric
                    total += self.inverse[c, 3 * b + k, part] * source[k]
            for k in ti.static(range(self.lanes)):
                row = self.lanes * part + k
                z[self.member[c * self.size + row // 3]][row % 3] = total[k]
