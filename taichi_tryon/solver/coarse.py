"""Coarse space of rigid motions: what local blocks cannot see, the part of the preconditioner that scales.

The cloth is divided into a hundred patches or so; each may move as a rigid body, which, unlike a polynomial, does not
lock on curved cloth. The coarse matrix E = P^T A P is gathered, inverted densely, and added to the local part:
z = D^-1 r + P E^-1 P^T r. Patches that do not overlap take twice as many iterations as hats that do on a flat sheet,
but no more on a garment, and a quarter of the work (aggregation as in Blaheta 1988, "A multilevel method with
overcorrection by aggregation for solving discrete elliptic problems").
"""

import numpy as np
import taichi as ti
from scipy.linalg import lapack
from threadpoolctl import ThreadpoolController

from taichi_tryon import fields
from taichi_tryon.solver.matrix import unpadded

MODES = 6
# vertices of a patch at least, and the number of patches over the cube root of that of the vertices at most: inverting
# E, which is dense, then costs a constant part of what the other vectors' work does
VERTICES_PER_PATCH, MOST_PATCHES = 50, 4.6
# rows of the inverse that are worked on together
ROWS = 16
# share of the diagonal added to E, and where that is not enough
SHIFT, GREATER_SHIFT = 3e-6, 1e-3


def patch_count(vertices: int) -> int:
    """How many patches so many vertices are best divided into."""
    return int(np.clip(MOST_PATCHES * np.cbrt(vertices), 1, max(1, vertices // VERTICES_PER_PATCH)))


@ti.data_oriented
class CoarseSpace:
    """The coarse part of the preconditioner for a Matrix over vertices at ``x``, of ``patch`` (nv,) each.

    ``reach`` [m], the extent of a patch, scales the rotations.
    """

    def __init__(self, matrix, x, patch: np.ndarray, reach: float):
        self.matrix, self.x, self.nv, self.reach = matrix, x, len(patch), reach
        self.patch_count = int(patch.max()) + 1
        self.size = MODES * self.patch_count
        self.row_blocks = -(-self.size // ROWS)
        tables = fields.Tables()
        self.patch = tables.scalars(patch)
        start, order = fields.group(patch, self.patch_count)
        self.member_start, self.member = tables.scalars(start), tables.scalars(order)
        self._pattern(patch, tables)
        tables.fill()
        self.center = ti.Vector.field(3, float, shape=self.patch_count)
        # from the centre of its patch to a vertex, over the reach, when last updated
        self.arm = ti.Vector.field(3, ti.f32, shape=self.nv)
        self.entries = np.zeros((self.size, self.size), np.float32)
        self.inverse = ti.Vector.field(ROWS, ti.f32, shape=(self.row_blocks, self.size))
        self.restricted = ti.field(ti.f32, shape=self.size)
        self.corrected = ti.field(ti.f32, shape=self.row_blocks * ROWS)
        self.blas = ThreadpoolController()

    def _pattern(self, patch: np.ndarray, tables: fields.Tables):
        """Which blocks of the matrix make up each block of E, of the patches I <= J."""
        m = self.matrix
        rows, columns = [m.rows, np.arange(self.nv)], [m.columns, np.arange(self.nv)]
        if m.bending.constant:
            rows.append(m.far_rows)
            columns.append(m.far_columns)
        # block n of the matrix counts as n, the diagonal and the constant ones behind follow
        rows, columns = np.concatenate(rows), np.concatenate(columns)
        self.first_own, self.first_far = len(m.rows), len(m.rows) + self.nv
        upper = np.flatnonzero(patch[rows] <= patch[columns])
        key = patch[rows[upper]] * self.patch_count + patch[columns[upper]]
        keys, pair = np.unique(key, return_inverse=True)
        start, order = fields.group(pair, len(keys))
        entry = upper[order]
        self.pair_count = len(keys)
        self.pair_row, self.pair_column = (
            tables.scalars(keys // self.patch_count),
            tables.scalars(keys % self.patch_count),
        )
        self.pair_start, self.entry = tables.scalars(start), tables.scalars(entry)
        self.entry_row, self.entry_column = tables.scalars(rows[entry]), tables.scalars(columns[entry])

    @ti.func
    def _block(self, n: int):
        """Block of the matrix that counts as n."""
        block = ti.Matrix.zero(float, 3, 3)
        if n < self.first_own:
            block = unpadded(self.matrix.block[n])
        elif n < self.first_far:
            block = unpadded(self.matrix.diagonal[n - self.first_own])
        elif ti.static(self.matrix.bending.constant):
            block = ti.cast(self.matrix.far_value[n - self.first_far], float) * ti.Matrix.identity(float, 3)
        return block

    @ti.kernel
    def _gather(self, entries: ti.types.ndarray()):
        for J in range(self.patch_count):
            total = ti.Vector([0.0, 0.0, 0.0])
            for n in range(self.member_start[J], self.member_start[J + 1]):
                total += self.x[self.member[n]]
            self.center[J] = total / (self.member_start[J + 1] - self.member_start[J])
        for i in range(self.nv):
            self.arm[i] = ti.cast((self.x[i] - self.center[self.patch[i]]) / self.reach, ti.f32)
        for p in range(self.pair_count):
            aa, ab = ti.Matrix.zero(float, 3, 3), ti.Matrix.zero(float, 3, 3)
            ba, bb = ti.Matrix.zero(float, 3, 3), ti.Matrix.zero(float, 3, 3)
            for n in range(self.pair_start[p], self.pair_start[p + 1]):
                i, j = self.entry_row[n], self.entry_column[n]
                block = self.matrix.masked(i, j, self._block(self.entry[n]))
                left, right = cross_matrix(ti.cast(self.arm[i], float)), cross_matrix(ti.cast(self.arm[j], float))
                turn = block @ right
                aa += block
                ab -= turn
                ba += left @ block
                bb -= left @ turn
            row, column = 6 * self.pair_row[p], 6 * self.pair_column[p]
            # loops at run time: unrolled, they would be most of what Taichi has to read
            for r in range(3):
                for c in range(3):
                    # LAPACK takes the lower triangle of what it reads by columns
                    entries[row + r, column + c] = ti.cast(aa[r, c], ti.f32)
                    entries[row + r, column + 3 + c] = ti.cast(ab[r, c], ti.f32)
                    entries[row + 3 + r, column + c] = ti.cast(ba[r, c], ti.f32)
                    entries[row + 3 + r, column + 3 + c] = ti.cast(bb[r, c], ti.f32)

    @ti.kernel
    def _add_layers(self, entries: ti.types.ndarray(), count: int):
        """What cloth lays on cloth, one pair after the other, since many add to the same entries."""
        for _once in range(1):
            for p in range(count):
                for a in range(4):
                    for b in range(4):
                        i, j = self.matrix.layers.corner[p][a], self.matrix.layers.corner[p][b]
                        if self.patch[i] <= self.patch[j]:
                            weight = self.matrix.layers.weight[p][a] * self.matrix.layers.weight[p][b]
                            block = self.matrix.masked(i, j, weight * self.matrix.layers.hold[p])
                            left = cross_matrix(ti.cast(self.arm[i], float))
                            turn = block @ cross_matrix(ti.cast(self.arm[j], float))
                            row, column = 6 * self.patch[i], 6 * self.patch[j]
                            _add(entries, row, column, block)
                            _add(entries, row, column + 3, -turn)
                            _add(entries, row + 3, column, left @ block)
                            _add(entries, row + 3, column + 3, -left @ turn)

    def update(self):
        """Gather and invert E for the matrix and positions as they are."""
        # one thread: those of the BLAS would fight Taichi's for the cores, at a hundred times the work's own cost
        with self.blas.limit(limits=1, user_api="blas"):
            fault = self._factor(SHIFT) and self._factor(GREATER_SHIFT)
            if fault:
                self.entries.fill(0.0)
            else:
                # in place, and the transpose, since LAPACK counts by columns
                lapack.spotri(self.entries.T, lower=1, overwrite_c=1)
        self._take(self.entries)

    def _factor(self, shift: float) -> int:
        """Let ``entries`` be the Cholesky factor of E, shifted by a part of its diagonal; 0 where it has one."""
        e = self.entries
        e.fill(0.0)
        self._gather(e)
        if self.matrix.layered:
            self._add_layers(e, self.matrix.layers.count)
        diagonal = np.einsum("ii->i", e)
        # a patch that is held everywhere has no motion left
        diagonal += shift * diagonal + 1e-12 * diagonal.max()
        return lapack.spotrf(e.T, lower=1, clean=0, overwrite_a=1)[1]

    @ti.kernel
    def _take(self, upper: ti.types.ndarray()):
        """Let E^-1 be the symmetric matrix whose upper triangle is given."""
        for b in range(self.row_blocks):
            for m in range(self.size):
                for k in ti.static(range(ROWS)):
                    row = ROWS * b + k
                    if row < self.size:
                        self.inverse[b, m][k] = upper[ti.min(row, m), ti.max(row, m)]

    @ti.func
    def restrict(self, J: int, r: ti.template()):
        """P^T r at patch J, into ``restricted``; of r the first three entries count."""
        force, torque = ti.Vector([0.0, 0.0, 0.0], ti.f32), ti.Vector([0.0, 0.0, 0.0], ti.f32)
        for n in range(self.member_start[J], self.member_start[J + 1]):
            i = self.member[n]
            here = ti.Vector([r[i][0], r[i][1], r[i][2]])
            force += here
            torque += self.arm[i].cross(here)
        for k in ti.static(range(3)):
            self.restricted[6 * J + k] = force[k]
            self.restricted[6 * J + 3 + k] = torque[k]

    @ti.func
    def solve_rows(self, b: int):
        """A block of ROWS rows of E^-1 P^T r, into ``corrected``."""
        total = ti.Vector([0.0] * ROWS, ti.f32)
        for m in range(self.size):
            total += self.inverse[b, m] * self.restricted[m]
        for k in ti.static(range(ROWS)):
            self.corrected[ROWS * b + k] = total[k]

    @ti.func
    def prolong(self, i: int):
        """Row i of P E^-1 P^T r, where nothing is held."""
        c = 6 * self.patch[i]
        shift = ti.Vector([self.corrected[c], self.corrected[c + 1], self.corrected[c + 2]])
        turn = ti.Vector([self.corrected[c + 3], self.corrected[c + 4], self.corrected[c + 5]])
        return shift + turn.cross(self.arm[i])


@ti.func
def _add(entries: ti.template(), row: int, column: int, block):
    for r in range(3):
        for c in range(3):
            entries[row + r, column + c] = entries[row + r, column + c] + ti.cast(block[r, c], ti.f32)


@ti.func
def cross_matrix(a):
    """The matrix of the cross product with a from the left."""
    return ti.Matrix([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
