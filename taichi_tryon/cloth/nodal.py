"""Strain averaged over the triangles around each vertex, so that folds across the mesh's lines do not lock.

Flat triangles that must not stretch leave a mesh hardly a way to fold: three strains a triangle are six conditions a
vertex, which has three coordinates. So only a share alpha of the stiffness acts on each triangle's own strain E_t; the
rest acts on the strain of the nodes,

    E_n = sum_t A_t E_t / sum_t A_t,   A_n = sum_t A_t / 3,
    W = sum_t alpha A_t w(E_t) + sum_n (1 - alpha) A_n w(E_n),

w the energy density: three conditions a vertex. Where strain is even, nothing changes. A vertex has a node for each of
the panels that meet there, as warp and weft run another way in each.

Sources: Dohrmann, Heinstein, Jung, Key, Witkowski 2000, "Node-based uniform strain elements for three-node triangular
and four-node tetrahedral meshes"; Puso and Solberg 2006, "A stabilized nodally integrated tetrahedral" (the share).
"""

import numpy as np
import scipy.sparse as sp
import taichi as ti
from scipy.sparse.csgraph import connected_components

from taichi_tryon import fields
from taichi_tryon.cloth import membrane
from taichi_tryon.cloth.model import Cloth

# alpha: share of the stiffness that acts on each triangle's own strain
OWN = 0.1
# neighbours whose sides differ by more than this share are in different panels, or across a dart
SAME = 1e-4


def nodes(cloth: Cloth) -> np.ndarray:
    """(nt, 3) number of the node at each corner, from 0 without gaps."""
    count = len(cloth.triangles)
    side = 2 * cloth.areas[:, None, None] * np.stack([-cloth.gradients[..., 1], cloth.gradients[..., 0]], axis=-1)
    corner = np.arange(3 * count).reshape(-1, 3)
    edge = cloth.triangle_edges.ravel()
    order = np.argsort(edge, kind="stable")
    pair = np.flatnonzero(edge[order][1:] == edge[order][:-1])
    one, other = order[pair], order[pair + 1]
    a, b = side.reshape(-1, 2)[one], side.reshape(-1, 2)[other]
    # neighbours run along their side opposite ways
    alike = np.linalg.norm(a + b, axis=1) < SAME * np.linalg.norm(a, axis=1)
    one, other = one[alike], other[alike]
    following, last = np.roll(corner, -1, axis=1).ravel(), np.roll(corner, -2, axis=1).ravel()
    links = np.concatenate([following[one], last[one]]), np.concatenate([last[other], following[other]])
    graph = sp.csr_matrix((np.ones(len(links[0])), links), shape=(3 * count, 3 * count))
    return connected_components(graph, directed=False)[1].reshape(-1, 3)


def strains(cloth: Cloth, positions: np.ndarray) -> np.ndarray:
    """(nt, 3) Green strain E11, E22, 2 E12 that each triangle's stress comes from, where its vertices are (nv, 3)."""
    f = np.einsum("tik,tia->tak", positions[cloth.triangles], cloth.gradients)
    metric = np.einsum("tak,tbk->tab", f, f)
    green = np.stack([(metric[:, 0, 0] - 1) / 2, (metric[:, 1, 1] - 1) / 2, metric[:, 0, 1]], axis=1)
    if cloth.membrane == "plain":
        return green
    node = nodes(cloth)
    around, weight = node.ravel(), np.repeat(cloth.areas, 3)
    sums = np.stack([np.bincount(around, weight * np.repeat(column, 3)) for column in green.T], axis=1)
    mean = sums / np.bincount(around, weight)[:, None]
    return OWN * green + (1 - OWN) * mean[node].mean(axis=1)


def members(cloth: Cloth, node: np.ndarray) -> np.ndarray:
    """(nn, m) vertices of the triangles of each node, -1 for none."""
    pairs = np.stack([np.repeat(node, 3, axis=1).ravel(), np.tile(cloth.triangles, (1, 3)).ravel()], axis=1)
    pairs = np.unique(pairs, axis=0)
    start = np.searchsorted(pairs[:, 0], np.arange(node.max() + 2))
    table = np.full((node.max() + 1, np.diff(start).max()), -1)
    table[pairs[:, 0], np.arange(len(pairs)) - start[pairs[:, 0]]] = pairs[:, 1]
    return table


@ti.data_oriented
class Nodes:
    """The nodes of a Cloth, where its strain is averaged: ``members`` (nn, m) vertices, -1 for none."""

    def __init__(self, cloth: Cloth):
        self.present = cloth.membrane == "nodal"
        if not self.present:
            return
        # tables of its own: those of the laws hold as many as Taichi unrolls without a warning
        tables = fields.Tables()
        node = nodes(cloth)
        self.members = members(cloth, node)
        self.count, self.width = self.members.shape
        area = np.bincount(node.ravel(), np.repeat(cloth.areas, 3)) / 3
        self.node, self.area = tables.vectors(node), tables.scalars(area)
        start, order = fields.group(node.ravel(), self.count)
        self.start, self.triangle = tables.scalars(start), tables.scalars(order // 3)
        self.weight = tables.scalars((np.repeat(cloth.areas, 3) / 3)[order] / np.repeat(area, np.diff(start)))
        self.member = tables.scalars(self.members.ravel())
        self.stretch = tables.vectors(cloth.modulus("stretch")[cloth.fabric[(order // 3)[start[:-1]]]])
        tables.fill()
        self.strain, self.change, self.stress = (ti.Vector.field(3, float, shape=self.count) for _ in range(3))
        self.slope = ti.Matrix.field(3, 3, float, shape=self.members.size)

    @ti.func
    def average(self, n: int, law: ti.template()):
        """Strain, its change and stress of node n from those of its triangles."""
        strain, change, stress = ti.Vector([0.0] * 3), ti.Vector([0.0] * 3), ti.Vector([0.0] * 3)
        for k in range(self.start[n], self.start[n + 1]):
            t, weight = self.triangle[k], self.weight[k]
            strain += weight * law.strain[t]
            if ti.static(law.damped):
                change += weight * (law.strain[t] - law.strain_ref[t])
            stress += weight * law.stress[t]
        self.strain[n], self.change[n], self.stress[n] = strain, change, stress
        for m in range(self.width):
            v = self.member[n * self.width + m]
            slope = ti.Matrix.zero(float, 3, 3)
            if v >= 0:
                for k in range(self.start[n], self.start[n + 1]):
                    t = self.triangle[k]
                    for corner in range(3):
                        if law.triangle[t][corner] == v:
                            slope += self.weight[k] * membrane.slopes(law.f1[t], law.f2[t], law.hat[t, corner])
            self.slope[n * self.width + m] = slope

    @ti.func
    def mixed(self, t: int, own, of: ti.template()):
        """Triangle t's own share of a quantity and that of its nodes."""
        others = of[self.node[t][0]] + of[self.node[t][1]] + of[self.node[t][2]]
        return OWN * own + (1.0 - OWN) / 3.0 * others

    @ti.func
    def density(self, t: int, c, own, of: ti.template()):
        """Energy density (stretch, shear) [J/m^2] of strains: triangle t's own and those of its nodes."""
        total = OWN * membrane.density(c, own)
        for k in ti.static(range(3)):
            total += (1.0 - OWN) / 3.0 * membrane.density(c, of[self.node[t][k]])
        return total

    @ti.func
    def block(self, n: int, i: int, j: int, factor: float):
        """Hessian block of node n between its members i and j, stress left out."""
        c = self.stretch[n] * (factor * (1.0 - OWN) * self.area[n])
        matrix = ti.Matrix([[c[0], c[2], 0.0], [c[2], c[1], 0.0], [0.0, 0.0, c[3]]])
        return self.slope[n * self.width + i].transpose() @ (matrix @ self.slope[n * self.width + j])
