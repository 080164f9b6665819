"""Arcs over the edges of triangles: the strain of the curved cloth that flat triangles stand for.

Corners that lie on a curved surface are nearer to each other than the cloth between them is long. Flat triangles take
that for compression, (kappa h)^2 / 24, which folds cannot all relieve: they grow stiff (membrane locking). So the cloth
over a triangle is taken as the quadratic surface through its corners and the three vertices opposite to its sides, its
flap vertices. Along side k the second derivative of that surface is a vector q_k, linear in the six positions, and the
mean square of the stretch along it is that of the chord c_k and

    |c_k|^2 + |q_k|^2 / 12.

The Green strain is the one for which all three sides have that length: the plain one and R (|q_0|^2, |q_1|^2, |q_2|^2).
Neither turns nor shifts change it. On a cylinder its error is of fourth order in kappa h instead of second.

Where one side is a border, or the six vertices lie on one conic, the quadratic of least curvature is taken; where two
are, the triangle is flat. Across seams the flap is laid into the triangle's plane.

Sources: Zienkiewicz and Taylor, The Finite Element Method, 2, "rotation-free shells" (curvature from the three
neighbours of a triangle); Cirak, Ortiz and Schroeder 2000, "Subdivision surfaces: a new paradigm for thin-shell finite
element analysis" (membrane strain of the smooth surface, from the neighbours' vertices).
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth import membrane
from taichi_tryon.cloth.model import Cloth

# singular values below this share of the greatest count as none
LEAST_SINGULAR = 0.05


def flaps(cloth: Cloth) -> np.ndarray:
    """(nt, 3) vertices across the sides opposite to each corner, -1 on a border."""
    first = cloth.edge_signs > 0
    return np.where(first, cloth.hinges[cloth.triangle_edges, 3], cloth.hinges[cloth.triangle_edges, 2])


def bow_weights(cloth: Cloth) -> np.ndarray:
    """(nt, 3, 6) by which q_k [m] sums the positions of corners and flap vertices; zero where there is none."""
    g = cloth.gradients
    found = flaps(cloth) >= 0
    found &= (found.sum(axis=1) >= 2)[:, None]
    # a flap's own gradients, from the corner opposite to the shared side on
    beside = np.where(cloth.edge_signs > 0, *np.moveaxis(cloth.hinge_triangles[cloth.triangle_edges], 2, 0)[::-1])
    edges_there = cloth.triangle_edges[beside]
    there = np.argmax(edges_there == cloth.triangle_edges[..., None], axis=2)
    points = np.zeros((len(g), 3, 3))
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        height, foot = _height(g, np.full(len(g), k))
        flap_height, flap_foot = _height(g[beside[:, k]], there[:, k])
        ratio = flap_height / height
        # neighbours run along their side opposite ways
        points[:, k, k] = -ratio
        points[:, k, a] = flap_foot + ratio * (1 - foot)
        points[:, k, b] = 1 - flap_foot + ratio * foot
    # over the plane of the corners a quadratic rises by -1/2 sum_k l_a l_b q_k
    a, b = np.roll(points, -1, axis=2), np.roll(points, -2, axis=2)
    rise = np.where(found[..., None], -0.5 * a * b, 0.0)
    curve = _along_sides(cloth) / cloth.areas[:, None, None]
    fit = curve @ np.linalg.pinv(rise @ curve, rcond=LEAST_SINGULAR)
    over = np.concatenate([-points, np.broadcast_to(np.eye(3), points.shape)], axis=2)
    return fit @ np.where(found[..., None], over, 0.0)


def _height(g: np.ndarray, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Height [m] over the side opposite to corner k (n,), and where along that side its foot lies."""
    row = np.arange(len(g))
    own, last = g[row, k], g[row, (k + 2) % 3]
    square = (own * own).sum(axis=1)
    return 1 / np.sqrt(square), -(own * last).sum(axis=1) / square


def _along_sides(cloth: Cloth) -> np.ndarray:
    """(nt, 3, 3) a symmetric tensor b along each side e, e.b e [m^2]: by b11, b22 and sqrt(2) b12."""
    e = 2 * cloth.areas[:, None, None] * np.stack([-cloth.gradients[..., 1], cloth.gradients[..., 0]], axis=-1)
    return np.stack([e[..., 0] ** 2, e[..., 1] ** 2, np.sqrt(2) * e[..., 0] * e[..., 1]], axis=-1)


def bow_strains(cloth: Cloth) -> np.ndarray:
    """R (nt, 3, 3) [1/m^2]: what (|q_0|^2, |q_1|^2, |q_2|^2) adds to the strain (E11, E22, 2 E12)."""
    # along a side e, 2 e.E e is the change of its squared length
    sides = _along_sides(cloth) * np.array([2.0, 2.0, np.sqrt(2.0)])
    return np.linalg.inv(sides) / 12


@ti.data_oriented
class Arcs:
    """What curvature adds to the membrane of a Cloth at positions ``x`` (nv vectors), where it is wanted.

    ``vertex`` (nt, 3 or 6) are the vertices on which a triangle's strain depends, -1 for none.
    """

    def __init__(self, cloth: Cloth, x, tables: fields.Tables):
        self.present, self.x = cloth.membrane != "plain", x
        self.relaxed = cloth.membrane == "relaxed"
        self.vertices = cloth.triangles
        if self.present:
            self.vertices = np.hstack([cloth.triangles, flaps(cloth)])
            self.vertex = tables.scalars(self.vertices.ravel())
            self.weight = tables.vectors(bow_weights(cloth).transpose(0, 2, 1).reshape(-1, 3))
            self.share = tables.matrices(bow_strains(cloth))
            self.part = ti.field(float, shape=len(self.vertices))
            self.bow, self.pull = (ti.Matrix.field(3, 3, float, shape=len(self.vertices)) for _ in range(2))
            held = np.flatnonzero(self.vertices.ravel() >= 0)
            start, order = fields.group(self.vertices.ravel()[held], cloth.vertex_count)
            self.role_start, self.role = tables.scalars(start), tables.scalars(held[order])

    @ti.func
    def _bow(self, t: int, of: ti.template()):
        """The q_k as rows, of positions or of velocities."""
        q = ti.Matrix.zero(float, 3, 3)
        for n in range(6 * t + 1, 6 * t + 6):
            if self.vertex[n] >= 0:
                q += self.weight[n].outer_product(of[self.vertex[n]] - of[self.vertex[6 * t]])
        return q

    @ti.func
    def strain(self, t: int, e, c):
        """What the bows of triangle t add to (E11, E22, 2 E12)."""
        q = self._bow(t, self.x)
        r = self.share[t] @ (q * q @ ti.Vector([1.0, 1.0, 1.0]))
        part = ti.cast(1.0, float)
        if ti.static(self.relaxed):
            along = membrane.stress(c, r)
            part = ti.min(ti.max(-along.dot(e) / (along.dot(r) + 1e-30), 0.0), 1.0)
        return part * r, part

    @ti.func
    def strain_rate(self, t: int, v: ti.template()):
        """Its rate [1/s] at velocities ``v``."""
        return 2.0 * self.share[t] @ (self._bow(t, self.x) * self._bow(t, v) @ ti.Vector([1.0, 1.0, 1.0]))

    @ti.func
    def evaluate(self, t: int, area: float, stress, part: float):
        """Bows at the present positions, and what the ``stress`` makes them pull."""
        self.bow[t] = self._bow(t, self.x)
        self.part[t] = part
        tension = 2.0 * part * area * (self.share[t].transpose() @ stress)
        for k in ti.static(range(3)):
            for m in ti.static(range(3)):
                self.pull[t][k, m] = tension[k] * self.bow[t][k, m]

    @ti.func
    def force(self, i: int):
        """Force [N] on vertex i, beside that of the flat triangles."""
        total = ti.Vector([0.0, 0.0, 0.0])
        for n in range(self.role_start[i], self.role_start[i + 1]):
            total -= self.pull[self.role[n] // 6].transpose() @ self.weight[self.role[n]]
        return total

    @ti.func
    def hessian(self, t: int, i: int, j: int, stretch, tension, exact: int, f1, f2, gi, gj):
        """3x3 block between vertices i and j of triangle t per unit of area, flat part included; arguments as in
        ``membrane.hessian``, the gradients 0 for flap vertices."""
        c = ti.Matrix([[stretch[0], stretch[2], 0.0], [stretch[2], stretch[1], 0.0], [0.0, 0.0, stretch[3]]])
        along = self.part[t] * (self.share[t].transpose() @ tension)
        if ti.static(self.relaxed):
            if self.part[t] > 0.0 and self.part[t] < 1.0:
                q = self.bow[t]
                cr = c @ (self.share[t] @ (q * q @ ti.Vector([1.0, 1.0, 1.0])))
                r = self.share[t] @ (q * q @ ti.Vector([1.0, 1.0, 1.0]))
                c -= cr.outer_product(cr) / (cr.dot(r) + 1e-30)
        geometric = (
            tension[0] * gi[0] * gj[0] + tension[1] * gi[1] * gj[1] + tension[2] * (gi[0] * gj[1] + gi[1] * gj[0])
        )
        for k in ti.static(range(3)):
            pull = along[k] if exact == 1 else ti.max(along[k], 0.0)
            geometric += 2.0 * pull * self.weight[6 * t + i][k] * self.weight[6 * t + j][k]
        si, sj = self._slopes(t, i, f1, f2, gi), self._slopes(t, j, f1, f2, gj)
        return si.transpose() @ (c @ sj) + geometric * ti.Matrix.identity(float, 3)

    @ti.func
    def _slopes(self, t: int, i: int, f1, f2, g):
        """Derivatives of (E11, E22, 2 E12) with respect to vertex i of triangle t, as rows."""
        share, weight = self.share[t], self.weight[6 * t + i]
        for k in ti.static(range(3)):
            for m in ti.static(range(3)):
                share[m, k] *= 2.0 * self.part[t] * weight[k]
        return ti.Matrix.rows([g[0] * f1, g[1] * f2, g[0] * f2 + g[1] * f1]) + share @ self.bow[t]
