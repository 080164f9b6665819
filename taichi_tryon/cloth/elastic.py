"""The elastic forces of the whole cloth: membrane, bending and tapes, as Taichi fields.

``evaluate`` fills what forces and Hessian blocks are made of; forces are gathered at the vertices, so that no two
threads write to one place and every run gives the same bits. Internal friction enters through the strain and hinge
angles from which the time integration counts their rate: stress = C (E + tau (E - E_ref) / dt), where E_ref is the
strain at the start of the step in backward Euler, and what ``begin_stage`` makes of it in other schemes.
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth import bending, membrane
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.cloth.tape import Tapes

# Heights below this share of the rest height count as that share in the hinge gradient.
LEAST_HEIGHT = 0.2
# Sweeps of the edge rotations' iteration an evaluation; it starts from the rotations of the last one. An even number
# ends in the first of the two buffers.
SWEEPS = 6


@ti.data_oriented
class Elastic:
    """Membrane, bending and tapes of a Cloth at positions ``x`` (field of nv vectors)."""

    def __init__(self, cloth: Cloth, x):
        nt, ne = len(cloth.triangles), len(cloth.hinges)
        self.nt, self.ne, self.nv = nt, ne, cloth.vertex_count
        self.cloth, self.x = cloth, x
        tables = fields.Tables()
        self.triangle = tables.vectors(cloth.triangles)
        self.hat = ti.Vector.field(2, float, shape=(nt, 3))
        fields.upload(self.hat, cloth.gradients)
        self.area = tables.scalars(cloth.areas)
        self.stretch = tables.vectors(cloth.stretch)
        self.tau = tables.scalars(cloth.damping_time)
        self.f1, self.f2, self.stress = (ti.Vector.field(3, float, shape=nt) for _ in range(3))
        self.tension, self.strain, self.strain_start, self.strain_ref = (
            ti.Vector.field(3, float, shape=nt) for _ in range(4)
        )

        self.hinge = tables.vectors(cloth.hinges)
        self.hinge_triangle = tables.vectors(cloth.hinge_triangles)
        self.triangle_edge = tables.vectors(cloth.triangle_edges)
        self.edge_sign = tables.vectors(cloth.edge_signs)
        self.stiffness = tables.matrices(cloth.edge_stiffness)
        self._hinge_constants(cloth, tables)
        self.angle, self.angle_start, self.angle_ref, self.moment = (ti.field(float, shape=ne) for _ in range(4))
        self.slope = ti.Vector.field(3, float, shape=(ne, 4))
        self.rotation = ti.field(float, shape=(2, ne))
        self.rotation_step = ti.field(float, shape=ne)
        self._chebyshev(cloth.edge_rate)

        self.tapes = Tapes(tables, cloth.tapes, cloth.tape_lengths, cloth.tape_stiffness, x)
        # a triangle beside each segment, by which its energy is counted
        first = np.unique(cloth.triangles.ravel(), return_index=True)[1] // 3
        self.tape_triangle = tables.scalars(first[cloth.tapes[:, 0]])
        start, order = fields.group(cloth.triangles.ravel(), self.nv)
        self.corner_start, self.corner = tables.scalars(start), tables.scalars(order)
        held = np.flatnonzero(cloth.hinges.ravel() >= 0)
        start, order = fields.group(cloth.hinges.ravel()[held], self.nv)
        self.role_start, self.role = tables.scalars(start), tables.scalars(held[order])
        tables.fill()
        self.sums = ti.Vector.field(4, ti.f64, shape=fields.CHUNKS)

    def _hinge_constants(self, cloth: Cloth, tables: fields.Tables):
        """Stiffness of each hinge with its edge rotation held, diagonal of the rotations' system, least heights."""
        diagonal = np.zeros(self.ne)
        heights = np.full((self.ne, 2), 1.0)
        for k in range(3):
            edges = cloth.triangle_edges[:, k]
            np.add.at(diagonal, edges, cloth.edge_stiffness[:, k, k])
            # 1 / |gradient of the hat of corner k| is the height over edge k
            height = LEAST_HEIGHT / np.linalg.norm(cloth.gradients[:, k], axis=1)
            side = np.where(cloth.edge_signs[:, k] > 0, 0, 1)
            heights[edges, side] = height
        interior = cloth.hinge_triangles[:, 1] >= 0
        tau = cloth.damping_time[cloth.hinge_triangles[:, 0]]
        # on the border of a clamp the whole hinge angle is that of the triangle which can bend
        share = np.where(cloth.edge_clamps == 0, 0.5, 1.0)
        self.clamp, self.share = tables.scalars(cloth.edge_clamps), tables.scalars(share)
        self.rotation_diagonal = tables.scalars(np.where(cloth.edge_clamps == 0, diagonal, np.inf))
        self.hinge_stiffness = tables.scalars(np.where(interior, share * share * diagonal, 0.0))
        self.hinge_tau = tables.scalars(tau)
        self.least_height = tables.vectors(heights)

    def _chebyshev(self, rate: tuple[float, float]):
        """Coefficients of the Chebyshev iteration for a spectrum within ``rate`` (Saad, Iterative Methods, 12.1)."""
        centre, half = (rate[1] + rate[0]) / 2, (rate[1] - rate[0]) / 2
        sigma = centre / half
        rho = 1 / sigma
        keep, add = [0.0], [1 / centre]
        for _ in range(SWEEPS - 1):
            following = 1 / (2 * sigma - rho)
            keep.append(following * rho)
            add.append(2 * following / half)
            rho = following
        self.keep, self.add = keep, add

    @ti.func
    def _triangle_strain(self, t: int):
        a, b, c = self.x[self.triangle[t][0]], self.x[self.triangle[t][1]], self.x[self.triangle[t][2]]
        # hats sum to one, so edge vectors do, and coordinates far from the origin cost no digits
        f1 = (b - a) * self.hat[t, 1][0] + (c - a) * self.hat[t, 2][0]
        f2 = (b - a) * self.hat[t, 1][1] + (c - a) * self.hat[t, 2][1]
        return f1, f2, membrane.strain(f1, f2)

    @ti.func
    def _hinge_angle(self, e: int) -> float:
        h = self.hinge[e]
        theta = ti.cast(0.0, float)
        if h[3] >= 0:
            theta = bending.hinge_angle(self.x[h[0]], self.x[h[1]], self.x[h[2]], self.x[h[3]])
        return theta

    @ti.func
    def _hinge_gradient(self, e: int):
        h, least = self.hinge[e], self.least_height[e]
        return bending.hinge_gradient(self.x[h[0]], self.x[h[1]], self.x[h[2]], self.x[h[3]], least[0], least[1])

    @ti.kernel
    def begin_step(self):
        """Remember strain and hinge angles: internal friction acts on the change since here."""
        for t in range(self.nt):
            _, _, e = self._triangle_strain(t)
            self.strain_start[t], self.strain_ref[t] = e, e
        for e in range(self.ne):
            theta = self._hinge_angle(e)
            self.angle_start[e], self.angle_ref[e] = theta, theta

    @ti.kernel
    def begin_stage(self, v: ti.template(), ahead: float, beyond: float):
        """Count strain rates as a stage of ``solver.schemes`` counts velocities: from the start of the step on,
        ``ahead`` [s] along its rates (``v`` the velocities [m/s]) and by the share ``beyond`` of the way to here."""
        for t in range(self.nt):
            f1, f2, e = self._triangle_strain(t)
            a, b, c = v[self.triangle[t][0]], v[self.triangle[t][1]], v[self.triangle[t][2]]
            rate = membrane.strain_rate(
                f1,
                f2,
                (b - a) * self.hat[t, 1][0] + (c - a) * self.hat[t, 2][0],
                (b - a) * self.hat[t, 1][1] + (c - a) * self.hat[t, 2][1],
            )
            self.strain_ref[t] = self.strain_start[t] + ahead * rate + beyond * (e - self.strain_start[t])
        for e in range(self.ne):
            h = self.hinge[e]
            if h[3] >= 0:
                slope = self._hinge_gradient(e)
                rate = ti.cast(0.0, float)
                for k in ti.static(range(4)):
                    rate += ti.Vector([slope[k, 0], slope[k, 1], slope[k, 2]]).dot(v[h[k]])
                change = self._hinge_angle(e) - self.angle_start[e]
                self.angle_ref[e] = self.angle_start[e] + ahead * rate + beyond * change

    @ti.func
    def _edge_angles(self, t: int, buffer: int):
        """alpha: how far the normals of the three edges lean outward from the normal of triangle t."""
        alpha = ti.Vector([0.0, 0.0, 0.0])
        for k in ti.static(range(3)):
            e = self.triangle_edge[t][k]
            alpha[k] = 0.5 * self.angle[e] + self.edge_sign[t][k] * self.rotation[buffer, e]
        return alpha

    @ti.func
    def _edge_moment(self, t: int, e: int, buffer: int):
        """Derivative of triangle t's energy with respect to its angle at edge e, and the edge's sign there."""
        m = self.stiffness[t] @ self._edge_angles(t, buffer)
        moment = ti.cast(0.0, float)
        sign = 0
        for k in ti.static(range(3)):
            if self.triangle_edge[t][k] == e:
                moment = m[k]
                sign = self.edge_sign[t][k]
        return moment, sign

    def evaluate(self, inverse_dt: float):
        """Strain, stress, hinge angles, edge rotations and moments at the present positions."""
        self._evaluate_strains(inverse_dt)
        for sweep in range(SWEEPS):
            self._turn_edges(self.keep[sweep], self.add[sweep], sweep % 2)
        self._evaluate_moments(inverse_dt)

    @ti.kernel
    def _evaluate_strains(self, inverse_dt: float):
        for t in range(self.nt):
            f1, f2, e = self._triangle_strain(t)
            s = membrane.stress(self.stretch[t], e)
            drag = membrane.stress(self.stretch[t], e - self.strain_ref[t]) * (self.tau[t] * inverse_dt)
            self.f1[t], self.f2[t], self.strain[t] = f1, f2, e
            self.stress[t] = s + drag
            self.tension[t] = membrane.tension_only(s + drag)
        for e in range(self.ne):
            h = self.hinge[e]
            if h[3] >= 0:
                self.angle[e] = self._hinge_angle(e)
                if self.clamp[e] != 0:
                    # the edge's normal is that of the clamped triangle
                    for buffer in range(2):
                        self.rotation[buffer, e] = -0.5 * self.clamp[e] * self.angle[e]
                g = self._hinge_gradient(e)
                for k in ti.static(range(4)):
                    self.slope[e, k] = ti.Vector([g[k, 0], g[k, 1], g[k, 2]])

    @ti.kernel
    def _turn_edges(self, keep: float, add: float, source: int):
        """One Chebyshev sweep on the edge rotations, from buffer ``source`` to the other one."""
        for e in range(self.ne):
            residual = ti.cast(0.0, float)
            for side in range(2):
                t = self.hinge_triangle[e][side]
                if t >= 0:
                    moment, sign = self._edge_moment(t, e, source)
                    residual -= sign * moment
            step = keep * self.rotation_step[e] + add * residual / self.rotation_diagonal[e]
            self.rotation_step[e] = step
            self.rotation[1 - source, e] = self.rotation[source, e] + step

    @ti.kernel
    def _evaluate_moments(self, inverse_dt: float):
        for e in range(self.ne):
            if self.hinge[e][3] >= 0:
                total = ti.cast(0.0, float)
                for side in range(2):
                    moment, _ = self._edge_moment(self.hinge_triangle[e][side], e, 0)
                    total += self.share[e] * moment
                rate = self.hinge_tau[e] * inverse_dt * (self.angle[e] - self.angle_ref[e])
                self.moment[e] = total + self.hinge_stiffness[e] * rate

    @ti.func
    def force(self, i: int):
        """Elastic and internal friction force on vertex i [N], at the positions last evaluated."""
        total = ti.Vector([0.0, 0.0, 0.0])
        for n in range(self.corner_start[i], self.corner_start[i + 1]):
            t, k = self.corner[n] // 3, self.corner[n] % 3
            total -= self.area[t] * membrane.gradient(self.stress[t], self.f1[t], self.f2[t], self.hat[t, k])
        for n in range(self.role_start[i], self.role_start[i + 1]):
            e, k = self.role[n] // 4, self.role[n] % 4
            if self.hinge[e][3] >= 0:
                total -= self.moment[e] * self.slope[e, k]
        if ti.static(self.tapes.count > 0):
            total += self.tapes.force(i)
        return total

    @ti.func
    def membrane_block(self, t: int, i: int, j: int, inverse_dt: float, exact: int):
        """Hessian block of triangle t's corners i and j, positive semi-definite where not ``exact``."""
        c = self.stretch[t] * (1.0 + self.tau[t] * inverse_dt)
        tension = self.stress[t] if exact == 1 else self.tension[t]
        block = membrane.hessian(c, tension, self.f1[t], self.f2[t], self.hat[t, i], self.hat[t, j])
        return self.area[t] * block

    @ti.func
    def bending_block(self, e: int, i: int, j: int, inverse_dt: float):
        """Hessian block of hinge e between its roles i and j, edge rotations held (Gauss-Newton)."""
        k = self.hinge_stiffness[e] * (1.0 + self.hinge_tau[e] * inverse_dt)
        return k * self.slope[e, i].outer_product(self.slope[e, j])

    @ti.kernel
    def _sum_energies(self, inverse_dt: float, first: int, last: int):
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, last - first)
            total = ti.Vector([0.0, 0.0, 0.0, 0.0], ti.f64)
            for t in range(first + low, first + high):
                e, c = self.strain[t], self.stretch[t]
                change = e - self.strain_ref[t]
                drag = 0.5 * self.tau[t] * inverse_dt * change.dot(membrane.stress(c, change))
                alpha = self._edge_angles(t, 0)
                stretch = 0.5 * (c[0] * e[0] * e[0] + c[1] * e[1] * e[1] + 2.0 * c[2] * e[0] * e[1])
                total += ti.Vector(
                    [
                        self.area[t] * stretch,
                        self.area[t] * 0.5 * c[3] * e[2] * e[2],
                        0.5 * alpha.dot(self.stiffness[t] @ alpha),
                        self.area[t] * drag,
                    ]
                )
            if ti.static(self.tapes.count > 0):
                low, high = fields.chunk_bounds(chunk, self.tapes.count)
                for k in range(low, high):
                    if first <= self.tape_triangle[k] < last:
                        total[0] += self.tapes.energy(k)
            low, high = fields.chunk_bounds(chunk, self.ne)
            for e in range(low, high):
                change = self.angle[e] - self.angle_ref[e]
                total[3] += 0.5 * self.hinge_stiffness[e] * self.hinge_tau[e] * inverse_dt * change * change
            self.sums[chunk] = total

    def energies(self, inverse_dt: float = 0.0, triangles: slice | None = None) -> np.ndarray:
        """Stretch, shear, bending and (over the step so far) friction energy [J] at the positions last evaluated, of
        all triangles or of some."""
        first, last = (0, self.nt) if triangles is None else (triangles.start, triangles.stop)
        self._sum_energies(inverse_dt, first, last)
        return self.sums.to_numpy().sum(axis=0)
