"""Bending by one constant matrix: the energy is quadratic in the positions.

Where cloth is bent but hardly stretched, its curvatures are the second derivatives of the positions x over the
material: |x,ab| = |kappa_ab|, component by component. So each vertex v of the area A_v (a third of its triangles)
carries the tensor

    H_v = 1 / A_v  sum_e (l_e / 2) J_e  n_e n_e^T

over the edges e that end there with a triangle on both sides, of length l_e and normal n_e; J_e is the sum of the
derivatives of x along the two outward normals, 0 where the triangles are level. That is the Hessian of the piecewise
linear x in the weak sense, with lumped mass. The energy is sum_v A_v/2 H_v : D : H_v, summed over the coordinates of x.

On a border no edge is there to bend across, so the curvature across it vanishes, as the moment does, and the one along
it is that of half a disk: the natural boundary conditions. Across seams and darts the edges around a vertex are laid
out in a plane, angle after angle, stretched or shrunk to a full turn, the flattest that sewn cloth can be; D is the
mean of the triangles around, each turned into that plane.

Lumped mass has its price: where vertices of 4 and of 8 triangles alternate, some per cent of the stiffness stay wrong
on the finest mesh; on those of the mesher the error falls with the edge length. A fold by half a turn costs a finite
energy.

Dry friction, which must not change when the cloth turns, takes its curvatures from the hinges, every edge's
normal being the mean of its neighbours'. Their mean is exact; that they vary about it widens the loop of a sheet rolled
back and forth by 1 % at most, on a mesh of the mesher with edges of a tenth of its length.

Sources: Stein, Grinspun, Wardetzky, Jacobson 2018, "Natural boundary conditions for smoothing in geometry processing"
(weak Hessian, borders); Bergou, Wardetzky, Harmon, Zorin, Grinspun 2006, "A quadratic bending model for inextensible
surfaces" (constant matrix, J_e); Welch and Witkin 1994, "Free-form shape design using triangulated surfaces" (the
layout around a vertex).
"""

import numpy as np
import scipy.sparse as sp
import taichi as ti
from scipy.sparse.csgraph import connected_components

from taichi_tryon import fields
from taichi_tryon.cloth.bending_friction import BendingFriction
from taichi_tryon.cloth.hinges import Hinges
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.kernel_loops import shared_if_many


def matrix(cloth: Cloth) -> sp.csr_matrix:
    """Q (nv, nv) [N/m], of the energy 1/2 x^T Q x for each coordinate of the positions x (nv,) [m].

    Symmetric, positive semi-definite; rows sum to zero. Triangles that cannot bend hold their normal and weigh nothing.
    """
    nv, ne = cloth.vertex_count, len(cloth.hinges)
    vertex = cloth.triangles.ravel()
    bends = cloth.bend.any(axis=1)
    # J over the positions: the derivative along the normal of the side opposite to corner k is -g_m.g_k / |g_k|
    size = np.linalg.norm(cloth.gradients, axis=2)
    slope = -np.einsum("tka,tma->tkm", cloth.gradients, cloth.gradients) / size[..., None]
    rows, columns = np.repeat(cloth.triangle_edges.ravel(), 3), np.repeat(cloth.triangles, 3, axis=0).ravel()
    jump = sp.csr_matrix((slope.ravel(), (rows, columns)), shape=(ne, nv))
    # A H over J, from the edges with a triangle on each side and one that bends
    side = 2 * cloth.areas[:, None] * size
    length = np.bincount(cloth.triangle_edges.ravel(), side.ravel()) / np.bincount(cloth.triangle_edges.ravel())
    ray, turn = _layout(cloth)
    edge = np.roll(cloth.triangle_edges, 1, axis=1).ravel()
    counts = (cloth.hinge_triangles[:, 1] >= 0) & np.append(bends, False)[cloth.hinge_triangles].any(axis=1)
    used = np.flatnonzero(counts[edge])
    n1, n2 = -np.sin(ray[used]), np.cos(ray[used])
    tensor = np.stack([n1 * n1, n2 * n2, 2 * n1 * n2]) * length[edge[used]] / 2
    rows = 3 * vertex[used] + np.arange(3)[:, None]
    gather = sp.csr_matrix((tensor.ravel(), (rows.ravel(), np.tile(edge[used], 3))), shape=(3 * nv, ne))
    # D / A
    third = np.repeat(np.where(bends, cloth.areas, 0.0) / 3, 3)
    area = np.bincount(vertex, third, nv)[vertex]
    share = np.divide(third, area**2, out=np.zeros_like(third), where=area > 0)
    blocks = share[:, None, None] * _turned(np.repeat(cloth.bend, 3, axis=0), turn)
    rows = 3 * vertex[:, None, None] + np.arange(3)[:, None] + np.zeros((3, 3), int)
    columns = 3 * vertex[:, None, None] + np.arange(3) + np.zeros((3, 3), int)
    stiffness = sp.csr_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(3 * nv, 3 * nv))
    curvature = gather @ jump
    q = curvature.T @ stiffness @ curvature
    return ((q + q.T) / 2).tocsr()


def _layout(cloth: Cloth) -> tuple[np.ndarray, np.ndarray]:
    """The triangles around each vertex laid out in a plane, for all corners (3 nt,), corner k of t at 3 t + k: the
    direction there [rad] of the side from corner k to k + 1, and how far the material axes are turned [rad].

    Each fan of triangles begins with its first in its own axes; a closed one fills a full turn.
    """
    nv, vertex = cloth.vertex_count, cloth.triangles.ravel().astype(np.int64)
    g = cloth.gradients
    sides = np.stack([g[..., 1], -g[..., 0]], axis=-1)  # opposite to each corner, over twice the area
    out, back = np.roll(sides, 1, axis=1).reshape(-1, 2), -np.roll(sides, -1, axis=1).reshape(-1, 2)
    direction = np.arctan2(out[:, 1], out[:, 0])
    angle = np.arctan2(out[:, 0] * back[:, 1] - out[:, 1] * back[:, 0], (out * back).sum(axis=1))
    # the corner that follows counter-clockwise begins with the side with which this one ends
    begins = np.roll(cloth.triangle_edges, 1, axis=1).ravel() * nv + vertex
    ends = np.roll(cloth.triangle_edges, -1, axis=1).ravel() * nv + vertex
    order = np.argsort(begins)
    found = order[np.minimum(np.searchsorted(begins[order], ends), len(order) - 1)]
    following = np.where(begins[found] == ends, found, -1)
    linked = np.flatnonzero(following >= 0)
    graph = sp.csr_matrix((np.ones(len(linked)), (linked, following[linked])), shape=(len(vertex),) * 2)
    count, fan = connected_components(graph, directed=False)
    leads = np.bincount(following[linked], minlength=len(vertex)) == 0
    closed = np.bincount(fan, leads, count) == 0
    scale = np.where(closed, 2 * np.pi / np.bincount(fan, angle, count), 1.0)[fan]
    candidates = np.argsort(~leads, kind="stable")
    here = candidates[np.unique(fan[candidates], return_index=True)[1]]
    ray = np.full(len(vertex), np.nan)
    ray[here] = direction[here]
    while len(here):
        after = following[here]
        goes = (after >= 0) & np.isnan(ray[after])
        here, after = here[goes], after[goes]
        ray[after] = ray[here] + scale[here] * angle[here]
        here = after
    # where a full turn was stretched or shrunk, a triangle's axes are those of its middle
    return ray, ray + scale * angle / 2 - (direction + angle / 2)


def _turned(bend: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Stiffness (n, 3, 3) for curvatures k11, k22, 2 k12 in a plane where the axes of ``bend`` (n, 4), D11, D22, D12,
    D66 [N m], are turned by ``angle`` (n,)."""
    c, s = np.cos(angle), np.sin(angle)
    to_axes = np.stack(
        [c * c, s * s, c * s, s * s, c * c, -c * s, -2 * c * s, 2 * c * s, c * c - s * s], axis=-1
    ).reshape(-1, 3, 3)
    d = np.zeros((len(bend), 3, 3))
    d[:, 0, 0], d[:, 1, 1], d[:, 2, 2] = bend[:, 0], bend[:, 1], bend[:, 3]
    d[:, 0, 1] = d[:, 1, 0] = bend[:, 2]
    return np.einsum("nka,nkl,nlb->nab", to_axes, d, to_axes)


@ti.data_oriented
class Constant:
    """The forces -Q x at positions ``x`` (nv vectors), and internal friction in the hinges where there is any.

    Off the diagonal Q has the entries ``rows``, ``columns``, ``values`` q. Forces and the energy,
    -1/4 sum q |x_i - x_j|^2, are summed over differences of positions, so that values in single precision still make an
    energy that no shift and no turn changes.
    """

    constant = True

    def __init__(self, cloth: Cloth, x, tables: fields.Tables):
        self.nv, self.ne, self.nt, self.x = cloth.vertex_count, len(cloth.hinges), len(cloth.triangles), x
        q = matrix(cloth).tocoo()
        off = q.row != q.col
        self.rows, self.columns, self.values = q.row[off], q.col[off], q.data[off].astype(np.float32)
        self.row_start = tables.scalars(fields.group(self.rows, self.nv)[0])
        self.column = tables.scalars(self.columns)
        # a single triangle has nothing to bend across
        self.value = ti.field(ti.f32, shape=max(len(self.values), 1))
        self.value.from_numpy(np.resize(self.values, self.value.shape))
        self.pull = ti.Vector.field(3, float, shape=self.nv)
        # each vertex's half of the energy of its pairs; the terms cancel
        self.stored = ti.field(ti.f64, shape=self.nv)
        # a triangle at each vertex, by which its energy is counted
        first = np.zeros(self.nv, np.int32)
        first[cloth.triangles[::-1].ravel()] = np.repeat(np.arange(len(cloth.triangles))[::-1], 3)
        self.vertex_triangle = tables.scalars(first)
        self.friction = BendingFriction(cloth, tables)
        self.hinged = bool(cloth.modulus("damping_time").any()) or self.friction.present
        self.hinges = Hinges(cloth, cloth.edge_stiffness, x, tables) if self.hinged else None

    def begin_step(self):
        """Remember how far the hinges spread, where there is internal friction."""
        if self.hinged:
            self.hinges.begin_step()

    @ti.kernel
    def end_step(self):
        """Dry friction slips."""
        for t in range(self.nt):
            self.friction.drag(t, self._leans(t))

    def begin_stage(self, v, ahead: float, beyond: float):
        """Count the rates of the hinges as ``Elastic.begin_stage`` says."""
        if self.hinged:
            self.hinges.begin_stage(v, ahead, beyond)

    @ti.kernel
    @shared_if_many
    def evaluate(self, inverse_dt: float):
        """Forces at the present positions."""
        for i in range(self.nv):
            total = ti.Vector([0.0, 0.0, 0.0])
            stored = ti.cast(0.0, ti.f64)
            for n in range(self.row_start[i], self.row_start[i + 1]):
                away = self.x[self.column[n]] - self.x[i]
                total -= ti.cast(self.value[n], float) * away
                exact = ti.cast(away, ti.f64)
                stored -= 0.25 * ti.cast(self.value[n], ti.f64) * exact.dot(exact)
            self.pull[i], self.stored[i] = total, stored
        if ti.static(self.hinged):
            for e in range(self.ne):
                if self.hinges.inner(e):
                    self.hinges.measure(e)
                    self.hinges.moment[e] = self.hinges.drag(e, inverse_dt)
        if ti.static(self.friction.present):
            for e in range(self.ne):
                if self.hinges.inner(e):
                    self._rub(e)

    @ti.func
    def _leans(self, t: int):
        """How far the edges' normals lean from triangle t's, where each is the mean of its neighbours'."""
        alpha = ti.Vector([0.0, 0.0, 0.0])
        for k in ti.static(range(3)):
            e = self.friction.triangle_edge[t][k]
            alpha[k] = self.hinges.share(e) * self.hinges.spread[e]
        return alpha

    @ti.func
    def _rub(self, e: int):
        """Add dry friction to the moment of an inner edge, and note its stiffness."""
        share = self.hinges.share(e)
        stuck = ti.cast(0.0, float)
        for side in range(2):
            t = self.friction.hinge_triangle[e][side]
            moment, stiffness = self.friction.at_edge(t, e, self._leans(t))
            self.hinges.moment[e] += share * moment
            stuck += share * share * stiffness
        self.friction.stuck[e] = stuck

    @ti.func
    def force(self, i: int):
        """Force [N] on vertex i, at the positions last evaluated."""
        total = self.pull[i]
        if ti.static(self.hinged):
            total += self.hinges.force(i)
        return total

    @ti.func
    def block(self, e: int, i: int, j: int, inverse_dt: float):
        """Hessian block of internal friction in hinge e between its roles i and j."""
        stiffness = self.hinges.dragged(e, inverse_dt)
        if ti.static(self.friction.present):
            stiffness += self.friction.stuck[e]
        return self.hinges.block(e, i, j, stiffness)

    @ti.func
    def energy(self, chunk: int, first: int, last: int):
        """A chunk's share of the energy [J] of the triangles from ``first`` to before ``last``."""
        total = ti.cast(0.0, ti.f64)
        low, high = fields.chunk_bounds(chunk, self.nv)
        for i in range(low, high):
            if first <= self.vertex_triangle[i] < last:
                total += self.stored[i]
        if ti.static(self.friction.present):
            low, high = fields.chunk_bounds(chunk, last - first)
            for t in range(first + low, first + high):
                total += self.friction.potential(t, self._leans(t))
        return total

    @ti.func
    def drag_energy(self, chunk: int, inverse_dt: float, first: int, last: int):
        """A chunk's share of what internal friction does [J] in the triangles from ``first`` to before ``last``."""
        total = ti.cast(0.0, ti.f64)
        if ti.static(self.hinged):
            total += self.hinges.drag_energy(chunk, inverse_dt, first, last)
        return total

    def state(self) -> dict[str, np.ndarray]:
        """What an evaluation starts from."""
        return self.friction.state()

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``."""
        self.friction.restore(state)
