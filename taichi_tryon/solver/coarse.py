"""Coarse space of rigid motions: what block-Jacobi cannot see, a preconditioner that scales.

A few nodes are spread over the cloth; around each, a hat of the distance along the cloth (seams included) blends six
rigid motions about the node's present centre. Rigid motions, unlike polynomials, do not lock on curved cloth. The
coarse matrix E = P^T A P is gathered, inverted densely, and added to block-Jacobi: z = D^-1 r + P E^-1 P^T r. Where
contact holds a vertex, its row of P is filtered by (I + K_contact / (0.1 mean diagonal))^-1: the coarse space must not
push into the body.
"""

import numpy as np
import scipy.sparse as sp
import taichi as ti
from scipy.linalg import lapack
from scipy.sparse.csgraph import dijkstra
from threadpoolctl import ThreadpoolController

from taichi_tryon import fields

MODES = 6
# vertices of the cloth per node, and the greatest number of nodes: E is dense
VERTICES_PER_NODE, MOST_NODES = 50, 160
# hats that overlap at a vertex: the weights of the nearest nodes are kept
NEAREST = 4
# share of the diagonal added to E: overlapping rigid motions are nearly dependent
SHIFT = 3e-6
# contact counts as stiff against this share of the mean diagonal
FILTER = 0.1


def spread(edges: np.ndarray, lengths: np.ndarray, vertex_count: int, node_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights: ids (nv, NEAREST) of nodes and their weights (nv, NEAREST), which sum to 1.

    Nodes are chosen farthest first by the distance along the edges, each connected piece has at least one.
    """
    i, j = edges.T
    graph = sp.csr_matrix((np.tile(lengths, 2), (np.r_[i, j], np.r_[j, i])), shape=(vertex_count, vertex_count))
    nearest = np.full(vertex_count, np.inf)
    nodes = []
    while len(nodes) < node_count or np.isinf(nearest.max()):
        source = int(np.argmax(nearest))
        reach = nearest.max()
        nodes.append(source)
        found = dijkstra(graph, indices=source, limit=reach if np.isfinite(reach) else np.inf)
        nearest = np.minimum(nearest, found)
        if nearest.max() <= 0:
            break
    radius = 2.2 * nearest.max() if nearest.max() > 0 else 1.0
    distance = dijkstra(graph, indices=nodes, limit=radius)  # (nodes, nv)
    hats = np.maximum(1 - distance / radius, 0.0) ** 2
    hats[~np.isfinite(distance)] = 0.0
    ids = np.argsort(-hats, axis=0, kind="stable")[:NEAREST].T
    if ids.shape[1] < NEAREST:
        ids = np.pad(ids, ((0, 0), (0, NEAREST - ids.shape[1])), mode="edge")
    weights = np.take_along_axis(hats.T, ids, axis=1)
    # the least kept weight is taken off, so that hats fall to zero where the list is cut
    if len(nodes) > NEAREST:
        cut = np.sort(hats, axis=0)[-NEAREST - 1][:, None]
        weights = np.maximum(weights - cut, 0.0) + 1e-9 * (weights > 0)
    else:
        weights[:, len(nodes) :] = 0.0
    return ids, weights / weights.sum(axis=1, keepdims=True)


@ti.data_oriented
class CoarseSpace:
    """The coarse part of the preconditioner for a Matrix over vertices at ``x``."""

    @staticmethod
    def over(cloth, matrix, x) -> "tuple[CoarseSpace, float]":
        """The coarse space of a Cloth, and the distance [m] between its nodes."""
        # rest lengths of the triangles' sides, from the hats' gradients: |e_k| = 2 A |g_k|
        sides = 2 * cloth.areas[:, None] * np.linalg.norm(cloth.gradients, axis=2)
        lengths = np.zeros(len(cloth.hinges))
        lengths[cloth.triangle_edges.ravel()] = sides.ravel()
        nodes = int(np.clip(cloth.vertex_count // VERTICES_PER_NODE, 1, MOST_NODES))
        ids, weights = spread(cloth.hinges[:, :2], lengths, cloth.vertex_count, nodes)
        return CoarseSpace(matrix, x, ids, weights), float(np.sqrt(cloth.areas.sum() / nodes))

    def __init__(self, matrix, x, ids: np.ndarray, weights: np.ndarray):
        self.matrix, self.x, self.nv = matrix, x, len(ids)
        used, ids = np.unique(ids, return_inverse=True)
        ids = ids.reshape(weights.shape)
        self.node_count = len(used)
        tables = fields.Tables()
        self.node = tables.vectors(ids)
        self.weight = tables.vectors(weights)
        self.filter = ti.Matrix.field(3, 3, float, shape=self.nv)
        # what the rotations of a vertex's nodes do to it, of either sense
        self.levered = ti.Matrix.field(3, 3, float, shape=(self.nv, NEAREST))
        self.center = ti.Vector.field(3, float, shape=self.node_count)
        self.reach = ti.field(float, shape=())
        self.size = MODES * self.node_count
        self.inverse = ti.field(ti.f32, shape=(self.size, self.size))
        self.restricted, self.corrected = (ti.field(float, shape=self.size) for _ in range(2))
        self.entries = ti.field(ti.f32, shape=(self.size, self.size))
        self.blas = ThreadpoolController()
        self._support(ids, weights, tables)
        self._pattern(ids, weights, tables)
        tables.fill()

    def _support(self, ids, weights, tables):
        """Table of the vertices under each node's hat, as vertex * NEAREST + slot."""
        held = np.flatnonzero(weights.ravel() > 0)
        start, order = fields.group(ids.ravel()[held], self.node_count)
        self.support_start, self.support = tables.scalars(start), tables.scalars(held[order])

    def _pattern(self, ids, weights, tables):
        """Where A P has blocks (row, node), and which of them make up each block of E."""
        nv, nodes = self.nv, self.node_count
        hats = sp.csr_matrix((weights.ravel() > 0, (np.repeat(np.arange(nv), NEAREST), ids.ravel())), shape=(nv, nodes))
        rows, columns = self.matrix.rows, self.matrix.columns
        links = sp.csr_matrix((np.ones(len(rows), bool), (rows, columns)), shape=(nv, nv))
        links = links + sp.identity(nv, bool, "csr")
        if self.matrix.bending.constant:
            far = self.matrix.far_rows, self.matrix.far_columns
            links = links + sp.csr_matrix((np.ones(len(far[0]), bool), far), (nv, nv))
        product = (links @ hats).tocsr()
        product.sort_indices()
        slot_row = np.repeat(np.arange(nv), np.diff(product.indptr))
        slot_key = slot_row.astype(np.int64) * nodes + product.indices

        def slots(row, columns):
            keys = row[:, None].astype(np.int64) * nodes + ids[columns]
            found = np.searchsorted(slot_key, keys)
            return np.where(weights[columns] > 0, found, -1)

        self.slot_start = tables.scalars(product.indptr)
        self.block_slot = tables.vectors(slots(rows, columns))
        self.diagonal_slot = tables.vectors(slots(np.arange(nv), np.arange(nv)))
        if self.matrix.bending.constant:
            self.far_slot = tables.vectors(slots(*far))
        self.shift, self.turn = (ti.Matrix.field(3, 3, float, shape=len(slot_row)) for _ in range(2))

        # E[I, J] gathers vertex i in hat I over slot (i, J); only I <= J
        count = np.repeat(np.diff(product.indptr), NEAREST)
        hat = np.repeat(np.arange(nv * NEAREST), count)
        first = np.repeat(np.repeat(product.indptr[:-1], NEAREST), count)
        run = np.arange(len(hat)) - np.repeat(np.cumsum(count) - count, count)
        slot = first + run
        upper = (weights.ravel()[hat] > 0) & (ids.ravel()[hat] <= product.indices[slot])
        hat, slot = hat[upper], slot[upper]
        key = ids.ravel()[hat].astype(np.int64) * nodes + product.indices[slot]
        keys, pair = np.unique(key, return_inverse=True)
        start, order = fields.group(pair, len(keys))
        self.pair_count = len(keys)
        self.pair_row, self.pair_column = tables.scalars(keys // nodes), tables.scalars(keys % nodes)
        self.pair_start = tables.scalars(start)
        self.pair_hat, self.pair_slot = tables.scalars(hat[order]), tables.scalars(slot[order])

    @ti.kernel
    def _gather(self, mean_diagonal: float):
        for J in range(self.node_count):
            total, weight = ti.Vector([0.0, 0.0, 0.0]), 0.0
            for n in range(self.support_start[J], self.support_start[J + 1]):
                i, a = self.support[n] // NEAREST, self.support[n] % NEAREST
                total += self.weight[i][a] * self.x[i]
                weight += self.weight[i][a]
            self.center[J] = total / weight
        for i in range(self.nv):
            stiff = ti.cast(self.matrix.contact[i], float) / (FILTER * mean_diagonal)
            kept = (ti.Matrix.identity(float, 3) + stiff).inverse()
            free = self.matrix.free[i]
            self.filter[i] = kept * free.outer_product(free)
            for a in range(NEAREST):
                arm = cross_matrix((self.x[i] - self.center[self.node[i][a]]) / self.reach[None])
                self.levered[i, a] = self.weight[i][a] * (self.filter[i] @ arm)
        for i in range(self.nv):
            for n in range(self.slot_start[i], self.slot_start[i + 1]):
                self.shift[n] = ti.Matrix.zero(float, 3, 3)
                self.turn[n] = ti.Matrix.zero(float, 3, 3)
            if self.matrix.free[i].max() > 0:
                self._add(i, ti.cast(self.matrix.diagonal[i], float), self.diagonal_slot[i])
                for n in range(self.matrix.row_start[i], self.matrix.row_start[i + 1]):
                    self._add(self.matrix.column[n], ti.cast(self.matrix.block[n], float), self.block_slot[n])
                if ti.static(self.matrix.bending.constant):
                    for n in range(self.matrix.far_start[i], self.matrix.far_start[i + 1]):
                        value = ti.cast(self.matrix.far_value[n], float)
                        self._add_scaled(self.matrix.far_column[n], value, self.far_slot[n])
        for p in range(self.pair_count):
            row, column = self.pair_row[p], self.pair_column[p]
            aa, ab = ti.Matrix.zero(float, 3, 3), ti.Matrix.zero(float, 3, 3)
            ba, bb = ti.Matrix.zero(float, 3, 3), ti.Matrix.zero(float, 3, 3)
            for n in range(self.pair_start[p], self.pair_start[p + 1]):
                i, slot = self.pair_hat[n] // NEAREST, self.pair_slot[n]
                w = self.weight[i][self.pair_hat[n] % NEAREST]
                arm = cross_matrix((self.x[i] - self.center[row]) / self.reach[None])
                shift, turn = w * (self.filter[i] @ self.shift[slot]), w * (self.filter[i] @ self.turn[slot])
                aa += shift
                ab += turn
                ba += arm @ shift
                bb += arm @ turn
            # loops at run time: unrolled, they would be most of what Taichi has to read
            for r in range(3):
                for c in range(3):
                    self._put(6 * row + r, 6 * column + c, aa[r, c])
                    self._put(6 * row + r, 6 * column + 3 + c, ab[r, c])
                    self._put(6 * row + 3 + r, 6 * column + c, ba[r, c])
                    self._put(6 * row + 3 + r, 6 * column + 3 + c, bb[r, c])

    @ti.func
    def _put(self, row: int, column: int, value: float):
        self.entries[row, column] = ti.cast(value, ti.f32)
        self.entries[column, row] = ti.cast(value, ti.f32)

    @ti.func
    def _add(self, j: int, block, slots):
        """Add block A_ij times P_j to the row's blocks of A P."""
        filtered = block @ self.filter[j]
        for a in range(NEAREST):
            n = slots[a]
            if n >= 0:
                self.shift[n] += self.weight[j][a] * filtered
                self.turn[n] -= block @ self.levered[j, a]

    @ti.func
    def _add_scaled(self, j: int, value: float, slots):
        """The same for a block that is the identity times ``value``."""
        for a in range(NEAREST):
            n = slots[a]
            if n >= 0:
                self.shift[n] += value * self.weight[j][a] * self.filter[j]
                self.turn[n] -= value * self.levered[j, a]

    def update(self, mean_diagonal: float, reach: float):
        """Gather and invert E for the matrix and positions as they are. ``reach`` [m] scales the rotations."""
        self.reach[None] = reach
        self._gather(mean_diagonal)
        e = self.entries.to_numpy()
        diagonal = np.einsum("ii->i", e)
        # a node whose hat is held everywhere has no motion left
        diagonal += SHIFT * diagonal + 1e-12 * diagonal.max()
        # one thread: those of the BLAS would fight Taichi's for the cores, at a hundred times the work's own cost
        with self.blas.limit(limits=1, user_api="blas"):
            factor, fault = lapack.spotrf(e, lower=1)
            if fault:
                diagonal *= 1 + 1e-3
                factor, fault = lapack.spotrf(e, lower=1)
            inverse, fault = lapack.spotri(factor, lower=1) if not fault else (np.zeros_like(e), 0)
        self.inverse.from_numpy(np.tril(inverse) + np.tril(inverse, -1).T)

    @ti.func
    def restrict(self, J: int, r: ti.template()):
        """P^T r at node J, into ``restricted``."""
        force, torque = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
        for n in range(self.support_start[J], self.support_start[J + 1]):
            i, a = self.support[n] // NEAREST, self.support[n] % NEAREST
            part = self.weight[i][a] * (self.filter[i] @ r[i])
            force += part
            torque += (self.x[i] - self.center[J]).cross(part)
        for k in ti.static(range(3)):
            self.restricted[6 * J + k] = force[k]
            self.restricted[6 * J + 3 + k] = torque[k] / self.reach[None]

    @ti.func
    def solve_row(self, k: int):
        """Row k of E^-1 P^T r, into ``corrected``."""
        total = ti.cast(0.0, float)
        for m in range(self.size):
            total += ti.cast(self.inverse[k, m], float) * self.restricted[m]
        self.corrected[k] = total

    @ti.func
    def prolong(self, i: int):
        """Row i of P E^-1 P^T r."""
        total = ti.Vector([0.0, 0.0, 0.0])
        for a in range(NEAREST):
            w = self.weight[i][a]
            if w > 0.0:
                J = self.node[i][a]
                c = 6 * J
                shift = ti.Vector([self.corrected[c], self.corrected[c + 1], self.corrected[c + 2]])
                turn = ti.Vector([self.corrected[c + 3], self.corrected[c + 4], self.corrected[c + 5]])
                total += w * (shift + turn.cross((self.x[i] - self.center[J]) / self.reach[None]))
        return self.filter[i] @ total


@ti.func
def cross_matrix(a):
    """The matrix of the cross product with a from the left."""
    return ti.Matrix([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
