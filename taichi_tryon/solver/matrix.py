"""The Hessian as a block-sparse matrix, assembled by gathering: each block is written by one thread."""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.kernel_loops import shared_if_many


@ti.data_oriented
class Matrix:
    """Symmetric matrix of 3x3 blocks: mass / dt^2 + Hessian of the laws.

    Blocks off the diagonal lie by rows (``row_start``, ``column``, ``block``), the diagonal in ``diagonal``, the sum of
    a whole row in ``row_sum``, all of them in the order in which a processor multiplies them (see ``packed``); a
    constant matrix of bending, which has one number a pair, by rows where nothing else has a block
    (``far_start``, ``far_column``, ``far_value``); ``free`` (nv vectors) is 0 along the axes where a vertex is held,
    else 1; what cloth lays on cloth, whose pairs come and go, is added as it is, by the law ``layers`` or None;
    ``stiffness``, where there are layers, is the mean of each vertex's diagonal without contact.
    Single precision is enough: the right-hand side is exact, and Newton corrects the step.
    """

    def __init__(self, elastic, contact, mass, free, layers=None):
        self.elastic, self.contact_law, self.layers, self.mass, self.free = elastic, contact, layers, mass, free
        self.layered, self.felt = layers is not None, len(contact.samples.areas) > 0
        self.nv = mass.shape[0]
        triangles, hinges, tapes = elastic.cloth.triangles, elastic.cloth.hinges, elastic.cloth.tapes
        samples, weights = contact.samples.vertices, contact.samples.weights
        self.bending = elastic.bending
        nodes = elastic.nodes
        inner = np.flatnonzero((hinges[:, 3] >= 0) & self.bending.hinged)
        tables = fields.Tables()
        laws = [
            [_pairs(self.nv, triangles, np.arange(len(triangles)), 3)],
            [_pairs(self.nv, hinges[inner], inner, 4)],
            [
                _pairs(self.nv, samples[used][:, :points], used, points)
                for points in (2, 3)
                for used in [np.flatnonzero((weights > 0).sum(axis=1) == points)]
            ],
            [_pairs(self.nv, tapes, np.arange(len(tapes)), 2)],
            [_pairs(self.nv, nodes.members, np.arange(nodes.count), nodes.width) for _ in range(nodes.present)],
        ]
        keys = np.unique(np.concatenate([np.unique(key) for law in laws for key, _ in law]))
        i, j = (part.astype(np.int32) for part in np.divmod(keys, self.nv))
        self.pair_count = len(keys)
        # of a law that has no pairs, nothing is compiled
        self.hinged, self.sampled, self.taped = (any(len(key) for key, _ in law) for law in laws[1:4])
        self.membrane_start, self.membrane_code = self._gathered(laws, keys, tables)
        self.hinge_start, self.hinge_code = self._gathered(laws, keys, tables)
        self.sample_start, self.sample_code = self._gathered(laws, keys, tables)
        self.tape_start, self.tape_code = self._gathered(laws, keys, tables)
        self.node_start, self.node_code = self._gathered(laws, keys, tables)
        self._lay_out_rows(i, j, tables)
        self._lay_out_constant(keys, tables)
        del keys, i, j
        tables.fill()
        self.block = ti.Vector.field(9, ti.f32, shape=2 * self.pair_count)
        self.diagonal = ti.Vector.field(9, ti.f32, shape=self.nv)
        # without contact with the body, the same along all axes
        self.row_sum = ti.Vector.field(9, ti.f32, self.nv) if self.felt else ti.field(ti.f32, self.nv)
        # ``free`` in single precision, with a fourth entry of 0
        self.mask = ti.Vector.field(4, ti.f32, shape=self.nv)
        if self.layered:
            self.stiffness = ti.field(float, shape=self.nv)

    def _gathered(self, laws: list, keys: np.ndarray, tables: fields.Tables):
        """What the first of the laws adds to each of the pairs ``keys``; the law is let go. None where it has none."""
        law = [part for part in laws.pop(0) if len(part[0])]
        if not law:
            return None, None
        key, code = (np.concatenate(parts) for parts in zip(*law, strict=True))
        law.clear()
        start, order = fields.group(np.searchsorted(keys, key), self.pair_count)
        return tables.scalars(start), tables.scalars(code[order])

    def _lay_out_rows(self, i: np.ndarray, j: np.ndarray, tables: fields.Tables):
        """Put the blocks of the pairs (i, j), and of (j, i), where they lie by rows."""
        rows, columns = np.concatenate([i, j]), np.concatenate([j, i])
        order = np.lexsort((columns, rows))
        place = np.empty(len(order), np.int32)
        place[order] = np.arange(len(order), dtype=np.int32)
        self.place_ij, self.place_ji = (tables.scalars(part) for part in np.split(place, 2))
        self.row_start = tables.scalars(fields.group(rows, self.nv)[0])
        self.column = tables.scalars(columns[order])

    def pattern(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns (2 pairs,) of the blocks off the diagonal."""
        counts = np.diff(self.row_start.to_numpy())
        return np.repeat(np.arange(self.nv, dtype=np.int32), counts), self.column.to_numpy()[: 2 * self.pair_count]

    def _lay_out_constant(self, keys: np.ndarray, tables: fields.Tables):
        """Put a constant matrix of bending where there are blocks, the pairs ``keys``, or by rows of its own."""
        if not self.bending.constant:
            return
        rows, columns, values = self.bending.rows, self.bending.columns, self.bending.values
        wanted = np.minimum(rows, columns).astype(np.int64) * self.nv + np.maximum(rows, columns)
        place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        far = keys[place] != wanted
        near = np.zeros(len(keys))
        near[place[~far]] = values[~far]
        self.near = tables.scalars(near)
        self.far_rows, self.far_columns = rows[far], columns[far]
        self.far_start = tables.scalars(fields.group(self.far_rows, self.nv)[0])
        self.far_column = tables.scalars(self.far_columns)
        self.far_value = ti.field(ti.f32, shape=max(far.sum(), 1))
        self.far_value.from_numpy(np.resize(values[far], self.far_value.shape))

    def assemble(self, inverse_dt: float, exact: bool = False) -> None:
        """Fill the matrix from the laws as last evaluated. ``inverse_dt`` 0 leaves mass and internal friction out.

        It is positive definite; ``exact`` keeps the compression in the membrane, with which it need not be.
        """
        self._assemble(inverse_dt, int(exact))

    @ti.kernel
    @shared_if_many
    def _assemble(self, inverse_dt: float, exact: int):
        for p in range(self.pair_count):
            block = ti.Matrix.zero(float, 3, 3)
            for n in range(self.membrane_start[p], self.membrane_start[p + 1]):
                code = self.membrane_code[n]
                block += self.elastic.membrane_block(code // 9, code // 3 % 3, code % 3, inverse_dt, exact)
            if ti.static(self.elastic.nodes.present):
                width = ti.static(self.elastic.nodes.width)
                for n in range(self.node_start[p], self.node_start[p + 1]):
                    code = self.node_code[n]
                    at = code // (width * width)
                    block += self.elastic.node_block(at, code // width % width, code % width, inverse_dt)
            if ti.static(self.hinged):
                for n in range(self.hinge_start[p], self.hinge_start[p + 1]):
                    code = self.hinge_code[n]
                    block += self.bending.block(code // 16, code // 4 % 4, code % 4, inverse_dt)
            if ti.static(self.sampled):
                for n in range(self.sample_start[p], self.sample_start[p + 1]):
                    code = self.sample_code[n]
                    block += self.contact_law.block(code // 9, code // 3 % 3, code % 3)
            if ti.static(self.taped):
                for n in range(self.tape_start[p], self.tape_start[p + 1]):
                    block += self.elastic.tapes.block(self.tape_code[n] // 9)
            if ti.static(self.bending.constant):
                block += self.near[p] * ti.Matrix.identity(float, 3)
            self.block[self.place_ij[p]] = packed(block)
            self.block[self.place_ji[p]] = packed(block.transpose())
        for i in range(self.nv):
            for k in ti.static(range(3)):
                self.mask[i][k] = ti.cast(self.free[i][k], ti.f32)
            # elastic forces do not change when everything is shifted: their rows sum to zero
            inertia = self.mass[i] * inverse_dt * inverse_dt
            diagonal, own = inertia * ti.Matrix.identity(float, 3), ti.Matrix.zero(float, 3, 3)
            if ti.static(self.felt):
                around, touching = self.contact_law.row_sum(i)
                diagonal, own = diagonal + around, touching
                self.row_sum[i] = packed(diagonal)
            else:
                self.row_sum[i] = ti.cast(inertia, ti.f32)
            for n in range(self.row_start[i], self.row_start[i + 1]):
                diagonal -= unpacked(self.block[n])
            if ti.static(self.bending.constant):
                for n in range(self.far_start[i], self.far_start[i + 1]):
                    diagonal -= ti.cast(self.far_value[n], float) * ti.Matrix.identity(float, 3)
            self.diagonal[i] = packed(diagonal)
            if ti.static(self.layered):
                self.stiffness[i] = (diagonal - own).trace() / 3.0

    @ti.func
    def row_product(self, i: int, vector: ti.template()):
        """Row i of the matrix times a field of vectors of single precision, with a fourth entry of 0, that are zero
        where held; zero in those rows."""
        # over differences, as elastic rows sum to zero: single precision would lose what little is left of large terms
        here = vector[i]
        one, other, last = ti.Vector([0.0] * 4, ti.f32), ti.Vector([0.0] * 4, ti.f32), ti.cast(0.0, ti.f32)
        for n in range(self.row_start[i], self.row_start[i + 1]):
            block, vector_there = self.block[n], vector[self.column[n]] - here
            one += first_lanes(block, vector_there)
            other += second_lanes(block, vector_there)
            last += block[8] * vector_there[2]
        if ti.static(self.felt):
            block = self.row_sum[i]
            one += first_lanes(block, here)
            other += second_lanes(block, here)
            last += block[8] * here[2]
        else:
            # the same on the diagonal, where the packed block has it: a body out of reach changes no bit
            one[0] += self.row_sum[i] * here[0]
            other[1] += self.row_sum[i] * here[1]
            one[3] += self.row_sum[i] * here[2]
        result = ti.Vector([0.0] * 4, ti.f32)
        result[0] = one[0] + other[0] + other[3]
        result[1] = one[1] + other[1] + last
        result[2] = one[2] + other[2] + one[3]
        if ti.static(self.bending.constant):
            for n in range(self.far_start[i], self.far_start[i + 1]):
                result += self.far_value[n] * (vector[self.far_column[n]] - here)
        if ti.static(self.layered):
            between = self.layers.product(i, vector)
            for k in ti.static(range(3)):
                result[k] += ti.cast(between[k], ti.f32)
        return self.mask[i] * result

    @ti.func
    def masked(self, i: int, j: int, block):
        """A block of row i and column j, zero where either is held."""
        return block * self.free[i].outer_product(self.free[j])

    @ti.func
    def own(self, i: int):
        """Block of vertex i with itself."""
        result = unpacked(self.diagonal[i])
        if ti.static(self.layered):
            result += self.layers.own(i)
        return result


# the entries of a block in the order in which they are stored: two times four that are multiplied at once, with
# components (0, 0, 0, 2) and (1, 1, 1, 2) of the vector, and the last one with component 2
ORDER = ((0, 0), (1, 0), (2, 0), (2, 2), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2))


@ti.func
def packed(block):
    """A 3x3 block as nine numbers of single precision, in ``ORDER``."""
    return ti.Vector([ti.cast(block[k, m], ti.f32) for k, m in ti.static(ORDER)])


@ti.func
def unpacked(entries):
    """The 3x3 block that is ``packed``."""
    rows = [[entries[ti.static(ORDER.index((k, m)))] for m in ti.static(range(3))] for k in ti.static(range(3))]
    return ti.cast(ti.Matrix(rows), float)


@ti.func
def first_lanes(entries, vector):
    """The first four numbers of a packed block times the components that they meet."""
    return ti.Vector([entries[0] * vector[0], entries[1] * vector[0], entries[2] * vector[0], entries[3] * vector[2]])


@ti.func
def second_lanes(entries, vector):
    """The same of the second four."""
    return ti.Vector([entries[4] * vector[1], entries[5] * vector[1], entries[6] * vector[1], entries[7] * vector[2]])


def _pairs(nv: int, table: np.ndarray, owners: np.ndarray, width: int) -> tuple[np.ndarray, np.ndarray]:
    """All pairs of vertices within the rows of ``table`` (n, width), where -1 is none, as keys low * nv + high, each
    with its code: the row's owner, and the places of low and high in it, in a base of 3 at least."""
    keys, codes, base = [], [], max(3, width)
    for a in range(width):
        for b in range(a + 1, width):
            there = np.flatnonzero((table[:, a] >= 0) & (table[:, b] >= 0))
            one, other = table[there, a], table[there, b]
            keys.append(np.minimum(one, other).astype(np.int64) * nv + np.maximum(one, other))
            places = np.where(one > other, b * base + a, a * base + b)
            codes.append((owners[there] * base * base + places).astype(np.int32))
    return np.concatenate(keys), np.concatenate(codes)
