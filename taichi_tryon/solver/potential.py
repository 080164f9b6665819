"""The incremental potential that a stage of a step minimises, its slope and its curvature:

Phi(x) = |x - x_hat|_M^2 / (2 dt^2) + E_elastic(x) + E_contact(x) - m g.x
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.kernel_loops import shared_if_many
from taichi_tryon.solver.constant_blocks import ConstantBlocks
from taichi_tryon.solver.matrix import Matrix


@ti.data_oriented
class Potential:
    """Phi of the cloth at ``x``: what inertia, gravity and the laws ``elastic``, ``contact`` and ``layers`` (None where
    cloth does not feel cloth) make of it, with ``1 / inverse_dt`` [s] the length of the stage, 0 being at rest.

    Where the cloth has been moved, first ``evaluate``, then ask. ``x_hat`` is where it would be without forces,
    ``pull`` the force of all but inertia and holds on each vertex [N]; ``free`` is 0 along the axes where it is held,
    else 1.
    """

    def __init__(self, x, masses: np.ndarray, free: np.ndarray, gravity, laws, tables: fields.Tables, clock):
        """masses (nv,) [kg]; free (nv, 3), False where and along which axes a vertex is held; gravity (3,) [m/s^2];
        laws: elastic, contact, layers; clock: takes the time that contact costs."""
        self.x, self.nv, self.clock = x, len(masses), clock
        self.elastic, self.contact, self.layers = laws
        self.layered = self.layers is not None
        self.mass, self.free = tables.scalars(masses), tables.vectors(np.asarray(free, float))
        # that of what is not held, by which forces are measured
        self.weight = float(np.linalg.norm(gravity) * np.linalg.norm(masses[np.any(free, axis=1)])) or 1.0
        self.gravity = ti.Vector.field(3, float, shape=())
        self.gravity[None] = gravity
        # share of its weight that each vertex bears
        self.bears = tables.scalars(np.ones(self.nv))
        self.x_hat, self.pull = (ti.Vector.field(3, float, shape=self.nv) for _ in range(2))
        self.matrix = Matrix(self.elastic, self.contact, self.mass, self.free, self.layers)
        self._constant: ConstantBlocks | None = None
        self.sums = fields.sums(2)
        self.inverse_dt = 0.0
        # Phi [J] where last evaluated, None where it has not been summed up since
        self._value: float | None = None

    def assemble_all(self) -> None:
        """From now on also assemble what never changes."""
        self._constant = ConstantBlocks(self.matrix)

    def begin(self, inverse_dt: float, ahead: float) -> None:
        """A stage begins where the cloth is, ``ahead`` [s] of which friction looks ahead."""
        self.inverse_dt = inverse_dt
        self.evaluate()
        self.bind(ahead)

    def evaluate(self) -> None:
        """Look at the laws where the cloth is."""
        self._value = None
        self.elastic.evaluate(self.inverse_dt)
        with self.clock("contact"):
            self.contact.evaluate()
            if self.layered:
                self.layers.evaluate()

    def bind(self, ahead: float | None = None) -> None:
        """Let contact be stiff, and slip, as it does where last evaluated; at the beginning of a stage friction looks
        ``ahead`` [s], see ``BodyContact.bind``."""
        if self.contact.count > 0 or self.layered:
            self._value = None
        with self.clock("contact"):
            self.contact.bind(int(ahead is not None), ahead or 0.0)
            if self.layered:
                self.layers.bind(ahead is not None, ahead or 0.0)

    def stored(self) -> float:
        """Elastic and contact energy [J] where last evaluated."""
        between = self.layers.stored if self.layered else 0.0
        return float(self.elastic.energies(self.inverse_dt).sum()) + self.contact.energy() + between

    def value(self) -> float:
        """Phi [J] where last evaluated."""
        if self._value is None:
            self._sum_particles(self.sums, self.inverse_dt)
            self._value = float(self.sums[:, 0].sum()) + self.stored()
        return self._value

    def gather(self, b) -> tuple[float, float]:
        """Fill the vector field b = -grad Phi [N]. 2-norms over the weight: of b, and of the force without inertia."""
        self._gather(b, self.inverse_dt)
        self._sum_forces(self.sums, b)
        all_of_it, at_rest = np.sqrt(self.sums.sum(axis=0)) / self.weight
        return float(all_of_it), float(at_rest)

    def assemble(self, exact: bool) -> None:
        """Fill the ``matrix``, the Hessian of Phi, positive definite where not ``exact``."""
        self.matrix.assemble(self.inverse_dt, exact)
        if self._constant is not None:
            self._constant.assemble()

    @ti.kernel
    @shared_if_many
    def _gather(self, b: ti.template(), inverse_dt: float):
        for i in range(self.nv):
            pull = self.mass[i] * self.bears[i] * self.gravity[None] + self.elastic.force(i) + self.contact.force(i)
            if ti.static(self.layered):
                pull += self.layers.force(i)
            self.pull[i] = pull
            drift = (self.x[i] - self.x_hat[i]) * (self.mass[i] * inverse_dt * inverse_dt)
            b[i] = self.free[i] * pull - self.free[i] * drift

    @ti.kernel
    def _sum_forces(self, sums: ti.types.ndarray(), b: ti.template()):
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            total = ti.Vector([0.0, 0.0], ti.f64)
            for i in range(low, high):
                force = self.free[i] * self.pull[i]
                total += ti.Vector([b[i].dot(b[i]), force.dot(force)], ti.f64)
            sums[chunk, 0], sums[chunk, 1] = total[0], total[1]

    @ti.kernel
    def _sum_particles(self, sums: ti.types.ndarray(), inverse_dt: float):
        """Of inertia and gravity."""
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            total = ti.cast(0.0, ti.f64)
            for i in range(low, high):
                away = self.x[i] - self.x_hat[i]
                inertia = 0.5 * self.mass[i] * inverse_dt * inverse_dt * away.dot(away)
                lift = self.mass[i] * self.bears[i] * self.gravity[None].dot(self.x[i])
                total += inertia - lift
            sums[chunk, 0] = total
