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

from taichi_tryon import fields
from taichi_tryon.kernel_loops import shared_if_many
from taichi_tryon.solver.matrix import ORDER

MODES = 6
# vertices of a patch at least, and the number of patches over a power of that of the vertices: the more, the fewer
# iterations, but inverting E, which is dense, must stay a part of what they cost
VERTICES_PER_PATCH, PATCHES, POWER = 50, 2.5, 0.4
# rows of the inverse that are worked on together
ROWS = 16
# share of the diagonal added to E, and where that is not enough
SHIFT, GREATER_SHIFT = 3e-6, 1e-3


def patch_count(vertices: int) -> int:
    """How many patches so many vertices are best divided into."""
    return int(np.clip(PATCHES * vertices**POWER, 1, max(1, vertices // VERTICES_PER_PATCH)))


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

    def _pattern(self, patch: np.ndarray, tables: fields.Tables):
        """Which blocks of the matrix make up each block of E, of the patches I <= J."""
        # here most memory of all is taken: half as wide, half as much
        m, patch = self.matrix, patch.astype(np.int32)
        parts = [m.pattern(), (np.arange(self.nv, dtype=np.int32),) * 2]
        if m.bending.constant:
            parts.append((m.far_rows, m.far_columns))
        # block n of the matrix counts as n, the diagonal and the constant ones behind follow
        self.first_own, self.first_far = len(parts[0][0]), len(parts[0][0]) + self.nv
        rows, columns = (np.concatenate(part) for part in zip(*parts, strict=True))
        parts.clear()
        upper = np.flatnonzero(patch[rows] <= patch[columns]).astype(np.int32)
        rows, pairs = rows[upper], patch[rows[upper]] * np.int32(self.patch_count) + patch[columns[upper]]
        del columns
        # a run is what a pair of patches has in one row of the matrix
        order = np.lexsort((rows, pairs)).astype(np.int32)
        rows, pairs, upper = rows[order], pairs[order], upper[order]
        del order
        begins = np.flatnonzero((np.diff(rows, prepend=-1) != 0) | (np.diff(pairs, prepend=-1) != 0))
        keys, of_run = np.unique(pairs[begins], return_inverse=True)
        self.pair_count = len(keys)
        self.pair_row, self.pair_column = (
            tables.scalars(keys // self.patch_count),
            tables.scalars(keys % self.patch_count),
        )
        self.pair_start = tables.scalars(fields.group(of_run, len(keys))[0])
        self.run_row = tables.scalars(rows[begins])
        self.run_start, self.entry = tables.scalars(np.append(begins, len(rows))), tables.scalars(upper)

    @ti.func
    def _block(self, n: int):
        """Block of the matrix that counts as n, by columns of four with a last entry of 0, and its column."""
        block, column = ti.Vector([0.0] * 12, ti.f32), n - self.first_own
        if n < self.first_own:
            block, column = by_columns(self.matrix.block[n]), self.matrix.column[n]
        elif n < self.first_far:
            block = by_columns(self.matrix.diagonal[column])
        elif ti.static(self.matrix.bending.constant):
            value, column = self.matrix.far_value[n - self.first_far], self.matrix.far_column[n - self.first_far]
            block[0], block[5], block[10] = value, value, value
        return block, column

    @ti.func
    def _run(self, run: int):
        """What a run adds to E where only its columns turn: the blocks B, and the turns B [a]x, by columns.

        In single precision, as blocks are: sums over a patch, in which almost all cancels, are not.
        """
        block, turn = ti.Vector([0.0] * 12, ti.f32), ti.Vector([0.0] * 12, ti.f32)
        for n in range(self.run_start[run], self.run_start[run + 1]):
            b, j = self._block(self.entry[n])
            free, a = self.matrix.mask[j], self.arm[j]
            for k in ti.static(range(4)):
                x, y, z = b[k] * free[0], b[4 + k] * free[1], b[8 + k] * free[2]
                block[k], block[4 + k], block[8 + k] = block[k] + x, block[4 + k] + y, block[8 + k] + z
                turn[k] += y * a[2] - z * a[1]
                turn[4 + k] += z * a[0] - x * a[2]
                turn[8 + k] += x * a[1] - y * a[0]
        return block, turn

    @ti.kernel
    @shared_if_many
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
            for run in range(self.pair_start[p], self.pair_start[p + 1]):
                i = self.run_row[run]
                blocks, turns = self._run(run)
                free, left = self.matrix.free[i], cross_matrix(ti.cast(self.arm[i], float))
                block, turn = rows_times(free, from_columns(blocks)), rows_times(free, from_columns(turns))
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
        if self._factor(SHIFT) and self._factor(GREATER_SHIFT):
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
def by_columns(entries):
    """A packed block by columns of four, as lanes that are all worked on alike, the fourth 0."""
    columns = ti.Vector([0.0] * 12, ti.f32)
    for n in ti.static(range(9)):
        columns[ti.static(4 * ORDER[n][1] + ORDER[n][0])] = entries[n]
    return columns


@ti.func
def from_columns(columns):
    """The 3x3 block whose columns are given so."""
    return ti.cast(ti.Matrix([[columns[4 * m + k] for m in ti.static(range(3))] for k in ti.static(range(3))]), float)


@ti.func
def rows_times(factor, matrix):
    """The matrix with each of its rows times a factor."""
    return ti.Matrix([[factor[r] * matrix[r, c] for c in ti.static(range(3))] for r in ti.static(range(3))])


@ti.func
def cross_matrix(a):
    """The matrix of the cross product with a from the left."""
    return ti.Matrix([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
