"""The elastic forces of the whole cloth: membrane, bending and tapes, as Taichi fields.

``evaluate`` fills what forces and Hessian blocks are made of; forces are gathered at the vertices, so that no two
threads write to one place and every run gives the same bits. Internal friction enters through the strain and hinge
angles from which the time integration counts their rate: stress = C (E + tau (E - E_ref) / dt), where E_ref is the
strain at the start of the step in backward Euler, and what ``begin_stage`` makes of it in other schemes. Dry friction
(see ``hysteresis``) adds its own stress to the shear and its own moment to the curvatures.
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth import membrane
from taichi_tryon.cloth.constant import Constant
from taichi_tryon.cloth.hysteresis import SHEAR_REACH, Sliders
from taichi_tryon.cloth.mid_edge import MidEdge
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.cloth.nodal import OWN, Nodes
from taichi_tryon.cloth.tape import Tapes
from taichi_tryon.kernel_loops import shared_if_many

BENDING = {"mid_edge": MidEdge, "constant": Constant}


@ti.data_oriented
class Elastic:
    """Membrane, bending and tapes of a Cloth at positions ``x`` (field of nv vectors)."""

    def __init__(self, cloth: Cloth, x):
        nt = len(cloth.triangles)
        self.nt, self.nv = nt, cloth.vertex_count
        self.cloth, self.x = cloth, x
        tables = fields.Tables()
        self.triangle = tables.vectors(cloth.triangles)
        self.hat = ti.Vector.field(2, float, shape=(nt, 3))
        fields.upload(self.hat, cloth.gradients)
        self.area = tables.scalars(cloth.areas)
        self.fabric = tables.scalars(cloth.fabric)
        # of each fabric
        self.stretch, self.tau = tables.vectors(cloth.modulus("stretch")), tables.scalars(cloth.modulus("damping_time"))
        self.damped = bool(cloth.modulus("damping_time").any())
        self.f1, self.f2, self.stress = (ti.Vector.field(3, float, shape=nt) for _ in range(3))
        self.tension, self.strain = (ti.Vector.field(3, float, shape=nt) for _ in range(2))
        if self.damped:
            self.strain_start, self.strain_ref = (ti.Vector.field(3, float, shape=nt) for _ in range(2))
        self.nodes = Nodes(cloth)
        self.bending = BENDING[cloth.bending](cloth, x, tables)
        self.friction = Sliders(cloth.modulus("shear_friction")[cloth.fabric, None], SHEAR_REACH, tables)
        self.tapes = Tapes(tables, cloth.tapes, cloth.tape_lengths, cloth.tape_stiffness, x)
        # a triangle beside each segment, by which its energy is counted
        first = np.unique(cloth.triangles.ravel(), return_index=True)[1] // 3
        self.tape_triangle = tables.scalars(first[cloth.tapes[:, 0]])
        start, order = fields.group(cloth.triangles.ravel(), self.nv)
        self.corner_start, self.corner = tables.scalars(start), tables.scalars(order)
        tables.fill()
        self.sums = fields.sums(4)

    @ti.func
    def _triangle_strain(self, t: int):
        a, b, c = self.x[self.triangle[t][0]], self.x[self.triangle[t][1]], self.x[self.triangle[t][2]]
        # hats sum to one, so edge vectors do, and coordinates far from the origin cost no digits
        f1 = (b - a) * self.hat[t, 1][0] + (c - a) * self.hat[t, 2][0]
        f2 = (b - a) * self.hat[t, 1][1] + (c - a) * self.hat[t, 2][1]
        return f1, f2, membrane.strain(f1, f2)

    def begin_step(self):
        """Remember strain and hinge angles: internal friction acts on the change since here."""
        if self.damped:
            self._begin_step()
            self.bending.begin_step()

    def end_step(self):
        """The step to the positions last evaluated is done: dry friction slips."""
        if self.friction.present:
            self._end_step()
        if self.bending.friction.present:
            self.bending.end_step()

    @ti.kernel
    @shared_if_many
    def _end_step(self):
        for t in range(self.nt):
            self.friction.drag(t, self._shear(t))

    def rub(self, on: bool):
        """Switch dry friction on or off; it begins from where it was last."""
        self.friction.switch(on)
        if self.bending.friction.present:
            self.bending.friction.sliders.switch(on)

    @ti.kernel
    def _begin_step(self):
        for t in range(self.nt):
            _, _, e = self._triangle_strain(t)
            self.strain_start[t], self.strain_ref[t] = e, e

    def begin_stage(self, v, ahead: float, beyond: float):
        """Count strain rates as a stage of ``solver.schemes`` counts velocities: from the start of the step on,
        ``ahead`` [s] along its rates (``v`` the velocities [m/s]) and by the share ``beyond`` of the way to here."""
        if self.damped:
            self._begin_stage(v, ahead, beyond)
            self.bending.begin_stage(v, ahead, beyond)

    @ti.kernel
    def _begin_stage(self, v: ti.template(), ahead: float, beyond: float):
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

    def evaluate(self, inverse_dt: float):
        """Strain, stress and all that bending's forces are made of, at the present positions."""
        self._evaluate_strains(inverse_dt)
        self.bending.evaluate(inverse_dt)

    @ti.kernel
    @shared_if_many
    def _evaluate_strains(self, inverse_dt: float):
        for t in range(self.nt):
            f1, f2, e = self._triangle_strain(t)
            fabric = self.fabric[t]
            s = membrane.stress(self.stretch[fabric], e)
            if ti.static(self.damped):
                s += membrane.stress(self.stretch[fabric], e - self.strain_ref[t]) * (self.tau[fabric] * inverse_dt)
            self.f1[t], self.f2[t], self.strain[t] = f1, f2, e
            self.stress[t] = s
            if ti.static(not self.nodes.present):
                self._rub(t)
        if ti.static(self.nodes.present):
            for n in range(self.nodes.count):
                self.nodes.average(n, self)
            for t in range(self.nt):
                self.stress[t] = self.nodes.mixed(t, self.stress[t], self.nodes.stress)
                self._rub(t)

    @ti.func
    def _rub(self, t: int):
        """Add dry friction to the stress of triangle t, which is then complete."""
        if ti.static(self.friction.present):
            self.stress[t][2] += self.friction.friction(t, self._shear(t))[0]
        self.tension[t] = membrane.tension_only(self.stress[t])

    @ti.func
    def _shear(self, t: int):
        """Shear angle 2 E12 of triangle t, as dry friction measures it."""
        return ti.Vector([self.strain[t][2]])

    @ti.func
    def force(self, i: int):
        """Elastic and internal friction force on vertex i [N], at the positions last evaluated."""
        total = ti.Vector([0.0, 0.0, 0.0])
        for n in range(self.corner_start[i], self.corner_start[i + 1]):
            t, k = self.corner[n] // 3, self.corner[n] % 3
            total -= self.area[t] * membrane.gradient(self.stress[t], self.f1[t], self.f2[t], self.hat[t, k])
        total += self.bending.force(i)
        if ti.static(self.tapes.count > 0):
            total += self.tapes.force(i)
        return total

    @ti.func
    def membrane_block(self, t: int, i: int, j: int, inverse_dt: float, exact: int):
        """Hessian block of triangle t's corners i and j, positive semi-definite where not ``exact``."""
        fabric = self.fabric[t]
        c = self.stretch[fabric] * (1.0 + self.tau[fabric] * inverse_dt)
        if ti.static(self.nodes.present):
            c *= OWN
        if ti.static(self.friction.present):
            c[3] += self.friction.stiffness(t, self._shear(t))[0]
        tension = self.stress[t] if exact == 1 else self.tension[t]
        block = membrane.hessian(c, tension, self.f1[t], self.f2[t], self.hat[t, i], self.hat[t, j])
        return self.area[t] * block

    @ti.func
    def node_block(self, n: int, i: int, j: int, inverse_dt: float):
        """Hessian block of node n between its members i and j."""
        fabric = self.fabric[self.nodes.triangle[self.nodes.start[n]]]
        return self.nodes.block(n, i, j, 1.0 + self.tau[fabric] * inverse_dt)

    @ti.kernel
    @shared_if_many
    def _sum_energies(self, sums: ti.types.ndarray(), inverse_dt: float, first: int, last: int):
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, last - first)
            total = ti.Vector([0.0, 0.0, 0.0, 0.0], ti.f64)
            for t in range(first + low, first + high):
                e, c = self.strain[t], self.stretch[self.fabric[t]]
                density = membrane.density(c, e)
                if ti.static(self.nodes.present):
                    density = self.nodes.density(t, c, e, self.nodes.strain)
                drag = ti.cast(0.0, float)
                if ti.static(self.damped):
                    change = e - self.strain_ref[t]
                    dragged = membrane.density(c, change)
                    if ti.static(self.nodes.present):
                        dragged = self.nodes.density(t, c, change, self.nodes.change)
                    drag = self.tau[self.fabric[t]] * inverse_dt * dragged.sum()
                stretch, shear = density[0], density[1]
                if ti.static(self.friction.present):
                    shear += self.friction.potential(t, self._shear(t))
                total += ti.Vector(
                    [
                        self.area[t] * stretch,
                        self.area[t] * shear,
                        0.0,
                        self.area[t] * drag,
                    ]
                )
            if ti.static(self.tapes.count > 0):
                low, high = fields.chunk_bounds(chunk, self.tapes.count)
                for k in range(low, high):
                    if first <= self.tape_triangle[k] < last:
                        total[0] += self.tapes.energy(k)
            total[2] += self.bending.energy(chunk, first, last)
            if ti.static(self.damped):
                total[3] += self.bending.drag_energy(chunk, inverse_dt, first, last)
            for k in ti.static(range(4)):
                sums[chunk, k] = total[k]

    def energies(self, inverse_dt: float = 0.0, triangles: slice | None = None) -> np.ndarray:
        """Stretch, shear, bending and (over the step so far) friction energy [J] at the positions last evaluated, of
        all triangles or of some."""
        first, last = (0, self.nt) if triangles is None else (triangles.start, triangles.stop)
        self._sum_energies(self.sums, inverse_dt, first, last)
        return self.sums.sum(axis=0)

    def state(self) -> dict[str, np.ndarray]:
        """What an evaluation starts from, beside the positions."""
        return {**self.bending.state(), **self.friction.state("shear_anchors")}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``."""
        self.bending.restore(state)
        self.friction.restore("shear_anchors", state)
