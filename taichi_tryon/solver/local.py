"""The local part of the preconditioner: small blocks of neighbouring vertices, each solved for itself (block-Jacobi).

What neighbours do to each other stiffly and at short range, which a coarse space cannot see, they settle here. Larger
blocks save iterations but their inverses have to be read from memory in each; eight vertices were fastest.
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields


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
        self.owner, self.slot = tables.scalars(owner), tables.scalars(slot)
        tables.fill()
        # so many rows of a block are worked on together, a power of 2 that a processor's registers hold
        self.rows = 8 if size % 8 == 0 else 3
        self.parts = 3 * size // self.rows
        self.work = ti.field(ti.f64, shape=(self.count, 3 * size, 3 * size))
        self.inverse = ti.Vector.field(self.rows, ti.f32, shape=(self.count, 3 * size, self.parts))

    @ti.kernel
    def update(self):
        """Invert the blocks of the matrix as it is."""
        for c in range(self.count):
            for row in range(3 * self.size):
                for column in range(3 * self.size):
                    self.work[c, row, column] = 0.0
            for a in range(self.size):
                self._fill_row(c, a)
            self._invert(c)
            for row in range(3 * self.size):
                for column in range(3 * self.size):
                    value = ti.cast(self.work[c, row, column], ti.f32)
                    self.inverse[c, row, column // self.rows][column % self.rows] = value

    @ti.func
    def _fill_row(self, c: int, a: int):
        """What the matrix has in row ``a`` of block c; where a vertex is held, or none is there, that of the unit."""
        i = self.member[c * self.size + a]
        if i == self.nv:
            self._put(c, a, a, ti.Matrix.identity(float, 3))
        else:
            own, free = self.matrix.own(i), self.matrix.free[i]
            own *= free.outer_product(free)
            for k in ti.static(range(3)):
                own[k, k] += 1.0 - free[k]
            self._put(c, a, a, own)
            for n in range(self.matrix.row_start[i], self.matrix.row_start[i + 1]):
                j = self.matrix.column[n]
                if self.owner[j] == c:
                    block = ti.cast(self.matrix.block[n], float)
                    self._put(c, a, self.slot[j], self.matrix.masked(i, j, block))
            if ti.static(self.matrix.bending.constant):
                for n in range(self.matrix.far_start[i], self.matrix.far_start[i + 1]):
                    j = self.matrix.far_column[n]
                    if self.owner[j] == c:
                        block = ti.cast(self.matrix.far_value[n], float) * ti.Matrix.identity(float, 3)
                        self._put(c, a, self.slot[j], self.matrix.masked(i, j, block))

    @ti.func
    def _put(self, c: int, a: int, b: int, block):
        for k in ti.static(range(3)):
            for m in ti.static(range(3)):
                self.work[c, 3 * a + k, 3 * b + m] = ti.cast(block[k, m], ti.f64)

    @ti.func
    def _invert(self, c: int):
        """Gauss-Jordan elimination in place, pivots on the diagonal: the blocks are positive definite.

        Sums are written out: Taichi takes x[i] -= y for an atomic operation, which costs ten times as much.
        """
        for k in range(3 * self.size):
            scale = 1.0 / self.work[c, k, k]
            self.work[c, k, k] = 1.0
            for m in range(3 * self.size):
                self.work[c, k, m] = self.work[c, k, m] * scale
            for row in range(3 * self.size):
                if row != k:
                    factor = self.work[c, row, k]
                    self.work[c, row, k] = 0.0
                    for m in range(3 * self.size):
                        self.work[c, row, m] = self.work[c, row, m] - factor * self.work[c, k, m]

    @ti.func
    def solve(self, c: int, r: ti.template(), z: ti.template()):
        """Set what block c has of the vector field z to its inverse times r, both of single precision, with an entry
        for the vertex that is missing."""
        for part in ti.static(range(self.parts)):
            total = ti.Vector([0.0] * self.rows, ti.f32)
            for b in range(self.size):
                source = r[self.member[c * self.size + b]]
                for k in ti.static(range(3)):
                    # the inverse is symmetric
                    total += self.inverse[c, 3 * b + k, part] * source[k]
            for k in ti.static(range(self.rows)):
                row = ti.static(self.rows * part + k)
                z[self.member[c * self.size + row // 3]][row % 3] = total[k]
