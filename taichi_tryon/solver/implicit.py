"""The implicit step: backward Euler, linearised and iterated where one linear solve is not enough, or TR-BDF2.

Each stage of a step (see ``schemes``; backward Euler has one, with dt = H) minimises the incremental potential

    Phi(x) = |x - x_hat|_M^2 / (2 dt^2) + E_elastic(x) + E_contact(x) - m g.x,   x_hat = x_ref + dt v_ref,

by Newton's method: (M / dt^2 + H) d = -grad Phi, H made positive semi-definite block by block, and a line search on Phi
that costs nothing where the full step lowers it. The first iteration alone is the linearly implicit Euler step of
Baraff and Witkin 1998.
"""

from collections.abc import Callable

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth.elastic import Elastic
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.contact.body import BodyContact
from taichi_tryon.contact.cloth import ClothContact
from taichi_tryon.contact.samples import Samples
from taichi_tryon.solver import guards, schemes
from taichi_tryon.solver.coarse import CoarseSpace
from taichi_tryon.solver.conjugate_gradients import ConjugateGradients
from taichi_tryon.solver.matrix import Matrix
from taichi_tryon.solver.momentum import FreeFlight
from taichi_tryon.solver.settings import StepResult, StepSettings
from taichi_tryon.solver.way import Way

# the line search tries no smaller share of a step; part of the stored energy by which Phi may rise where it jumps
LEAST_SHARE, TOLERATED = 1 / 64, 0.01
# below this residual, where a step is to be solved further, the membrane's Hessian is taken as it is, compression and
# all: without it, wrinkles are stiffer in the matrix than in truth and take twice as many iterations
EXACT_BELOW = 1e-3
# Newton iterations that share a coarse space
REFRESH = 2


@ti.data_oriented
class ImplicitStep:
    """Positions ``x``, velocities ``v`` and laws of the cloth, and the step that moves them on."""

    def __init__(
        self, cloth: Cloth, body, positions, contact, gravity, settings: StepSettings, clock, free=None, layers=None
    ):
        """positions (nv, 3) [m]; contact: stiffness [N/m^3], thickness [m], friction; free (nv, 3), False where and
        along which axes a vertex is held; layers: stiffness and thickness of the contact of cloth with cloth, None
        where it is not wanted."""
        self.nv, self.settings, self.clock = cloth.vertex_count, settings, clock
        self.x, self.v, self.a, self.x_start, self.x_hat, self.path, self.force = (
            ti.Vector.field(3, float, shape=self.nv) for _ in range(7)
        )
        # of the stage that is solved, and the velocity at which the one before ended: see schemes
        self.x_ref, self.v_ref, self.v_stage = (ti.Vector.field(3, float, shape=self.nv) for _ in range(3))
        # after a step without inertia, ``a`` says nothing
        self.acceleration_known = False
        # where what is held shall be at the end of a step; forces of all else on every vertex
        self.held_at, self.pull = (ti.Vector.field(3, float, shape=self.nv) for _ in range(2))
        tables = fields.Tables()
        tables.set(self.x, positions)
        tables.set(self.held_at, positions)
        self.mass = tables.scalars(cloth.masses)
        self.free = tables.vectors(np.ones((self.nv, 3)) if free is None else np.asarray(free, float))
        self.gravity = ti.Vector.field(3, float, shape=())
        self.gravity[None] = gravity
        # share of its weight that each vertex bears
        self.bears = tables.scalars(np.ones(self.nv))
        tables.fill()
        held = np.zeros(self.nv, bool) if free is None else ~np.asarray(free, bool).any(axis=1)
        self.weight = float(np.linalg.norm(gravity) * np.linalg.norm(cloth.masses[~held])) or 1.0
        self.elastic = Elastic(cloth, self.x)
        samples = Samples.of(cloth.triangles, cloth.areas, cloth.hinges[:, :2], cloth.triangle_edges, self.nv)
        self.contact = BodyContact(samples, body, self.x, self.x_start, self.v, *contact)
        self.layers = None if layers is None else ClothContact(cloth, self.x, self.path, *layers)
        self.layered = layers is not None
        self.way = Way(self.x, self.path, self.layers)
        self.matrix = Matrix(self.elastic, self.contact, self.mass, self.free, self.layers)
        self.coarse, self.reach = None, 1.0
        if settings.preconditioner == "coarse":
            self.coarse, self.reach = CoarseSpace.over(cloth, self.matrix, self.x)
        self.linear = ConjugateGradients(self.matrix, self.coarse)
        self.flight = FreeFlight(cloth)
        self.sums = ti.Vector.field(4, ti.f64, shape=fields.CHUNKS)

    # -- one step -------------------------------------------------------------------------------------------------

    def step(
        self, dt: float, inertia: float = 1.0, pose: Callable[[float], None] | None = None, error_limit: float = np.inf
    ) -> StepResult:
        """Move the cloth on by ``dt`` [s]; where it fails the cloth stays as it was.

        inertia 0: from rest, by backward Euler. pose: puts a moving body where it is after that share of the step.
        error_limit [m]: the step fails where its local error is estimated to be greater.
        """
        scheme = self._scheme(inertia)
        self._begin()
        self.elastic.begin_step()
        newton = linear = 0
        since, solved, residual = 0.0, True, 0.0
        for stage in scheme.stages:
            h, part = stage.h * dt, stage.end - since
            self._begin_stage(stage.ahead * dt, stage.beyond, h, inertia)
            if stage.ahead + stage.beyond > 0.0:
                self.elastic.begin_stage(self.v, stage.ahead * dt, stage.beyond)
            self.way.start()
            if pose is not None:
                pose(stage.end)
                self.contact.carry(part / stage.end)
            self._lead_held()
            self.way.arrive()
            solved, iterations, linear_iterations, residual = self._solve(1.0 / h, part * dt * inertia)
            newton, linear = newton + iterations, linear + linear_iterations
            if not solved:
                break
            self.flight.meet(self.contact, self.layers, first=since == 0.0)
            since = stage.end
            if since < 1.0:
                self._end_stage(1.0 / h)
        moved = self.way.gone_from(self.x_start)
        error = dt * self._error(1.0 / h, scheme.error) if solved and np.isfinite(error_limit) else 0.0
        accepted = solved and error <= error_limit
        if accepted:
            self.flight.leave(self, dt * inertia)
            self._finish(inertia / h)
            self.flight.keep(self)
            self.acceleration_known = inertia > 0.0
            self.contact.end_step()
            self.elastic.end_step()
        else:
            self._restore()
        change = scheme.change(error, error_limit) if solved else schemes.FAILED
        return StepResult(accepted, newton, linear, residual, moved, error, change)

    def _scheme(self, inertia: float) -> schemes.Scheme:
        """The scheme of a step: without inertia there is nothing to be followed exactly."""
        scheme = schemes.SCHEMES[self.settings.scheme] if inertia > 0.0 else schemes.BACKWARD_EULER
        return schemes.STARTING if scheme.needs_acceleration and not self.acceleration_known else scheme

    def _solve(self, inverse_dt: float, ahead: float) -> tuple[bool, int, int, float]:
        """Newton's method on Phi; whether it got anywhere, iterations, those of the linear solver, the residual."""
        s = self.settings
        self._evaluate(inverse_dt)
        self._bind(1, ahead)
        residual = self._gather(inverse_dt)[0]
        newton = linear = 0
        progress = False
        while newton < s.max_newton_iterations:
            before = self._potential(inverse_dt)
            exact = max(residual, s.tolerance) < EXACT_BELOW
            linear += self._solve_linear(inverse_dt, exact, refresh=newton % REFRESH == 0)
            newton += 1
            if not self.way.aim(self.linear.d, s.longest_move):
                break
            if self.layered:
                with self.clock("contact"):
                    linear += guards.stay_apart(self.layers, self.linear, self.way, s, self.reach)
                    self.layers.keep_apart()
            share = self._search(before, inverse_dt, 0.0 if self.layered else TOLERATED)
            if self.layered and share == 0.0:
                share, more = self._search_alike(before, inverse_dt)
                linear += more
            if share == 0.0:
                break
            progress = True
            self._bind(0, 0.0)
            residual = self._gather(inverse_dt)[0]
            if residual <= s.tolerance:
                break
        return bool(np.isfinite(residual) and (progress or residual <= s.tolerance)), newton, linear, residual

    def _solve_linear(self, inverse_dt: float, exact: bool, refresh: bool) -> int:
        """Newton's direction d, with the exact Hessian of the membrane where that works; the iterations it took."""
        s = self.settings
        self.matrix.assemble(inverse_dt, exact)
        iterations, _ = self.linear.solve(s.linear_tolerance, s.max_linear_iterations, self.reach, refresh)
        if exact and self.linear.indefinite[None] == 1:
            return iterations + self._solve_linear(inverse_dt, exact=False, refresh=True)
        return iterations

    def _search_alike(self, before: float, inverse_dt: float) -> tuple[float, int]:
        """Search along Newton's own direction, all of it shortened alike: Phi falls along it, as it need not where
        each vertex has been stopped by itself. The share gone, and the iterations of the linear solver."""
        self.layers.bind()
        self._gather(inverse_dt)
        linear = guards.aim(self.linear, self.way, self.settings, self.settings.longest_move, self.reach)
        self.layers.keep_apart(alike=True)
        return self._search(before, inverse_dt, TOLERATED), linear

    def _evaluate(self, inverse_dt: float):
        self.elastic.evaluate(inverse_dt)
        with self.clock("contact"):
            self.contact.evaluate()
            if self.layered:
                self.layers.evaluate()

    def _bind(self, first: int, ahead: float):
        with self.clock("contact"):
            self.contact.bind(first, ahead)
            if self.layered:
                self.layers.bind()

    def _search(self, before: float, inverse_dt: float, tolerated: float) -> float:
        """Go along d as far as Phi falls; returns the share of the way gone, 0 where none can be.

        Where two limbs meet, the body's gap jumps from the one to the other and Phi with it, while d is right for all
        the rest of the cloth: then the shortest share is gone if Phi rises by no more than a tolerated part of what is
        stored.
        """
        share = 1.0
        while True:
            self.way.go(share)
            self._evaluate(inverse_dt)
            rise = self._potential(inverse_dt) - before
            if rise <= 1e-9 * abs(before):
                return share
            if share < 2 * LEAST_SHARE:
                break
            share *= 0.5
        if rise <= tolerated * self._stored(inverse_dt):
            return share
        self.way.go(0.0)
        self._evaluate(inverse_dt)
        return 0.0

    def _stored(self, inverse_dt: float) -> float:
        """Elastic and contact energy [J] at the positions last evaluated."""
        between = self.layers.stored if self.layered else 0.0
        return float(self.elastic.energies(inverse_dt).sum()) + self.contact.energy() + between

    def _potential(self, inverse_dt: float) -> float:
        self._sum_particles(inverse_dt)
        inertia_and_gravity = float(self.sums.to_numpy()[:, 2].sum())
        return inertia_and_gravity + self._stored(inverse_dt)

    def _gather(self, inverse_dt: float) -> tuple[float, float]:
        """Right-hand side b = -grad Phi; returns |b| and the net force without inertia, both over the weight."""
        self._gather_forces(inverse_dt)
        self._sum_particles(inverse_dt)
        sums = self.sums.to_numpy().sum(axis=0)
        return tuple(float(v) for v in np.sqrt(sums[:2]) / self.weight)

    @ti.kernel
    def _begin(self):
        for i in range(self.nv):
            self.x_start[i], self.v_stage[i] = self.x[i], self.v[i]

    @ti.kernel
    def _begin_stage(self, ahead: float, beyond: float, h: float, inertia: float):
        for i in range(self.nv):
            start, v = self.x_start[i], self.v[i]
            self.x_ref[i] = start + ahead * v + beyond * (self.x[i] - start)
            self.v_ref[i] = v + ahead * self.a[i] + beyond * (self.v_stage[i] - v)
            self.x_hat[i] = self.x_ref[i] + h * inertia * self.v_ref[i]

    @ti.kernel
    def _end_stage(self, inverse_h: float):
        for i in range(self.nv):
            self.v_stage[i] = (self.x[i] - self.x_ref[i]) * inverse_h

    @ti.kernel
    def _sum_errors(self, inverse_h: float, first: float, middle: float, last: float):
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            total = ti.Vector([0.0, 0.0, 0.0, 0.0], ti.f64)
            for i in range(low, high):
                v = (self.x[i] - self.x_ref[i]) * inverse_h
                error = first * self.v[i] + middle * self.v_stage[i] + last * v
                total[0] += self.mass[i] * error.dot(error)
                total[1] += self.mass[i]
            self.sums[chunk] = total

    def _error(self, inverse_h: float, weights: tuple[float, float, float]) -> float:
        """Local error of the step over its length [m/s], root of the mean square over the mass."""
        self._sum_errors(inverse_h, *weights)
        square, mass = self.sums.to_numpy().sum(axis=0)[:2]
        return float(np.sqrt(square / mass))

    @ti.kernel
    def _lead_held(self):
        for i in range(self.nv):
            self.x[i] += (1.0 - self.free[i]) * (self.held_at[i] - self.x[i])

    @ti.kernel
    def _gather_forces(self, inverse_dt: float):
        for i in range(self.nv):
            pull = self.mass[i] * self.bears[i] * self.gravity[None] + self.elastic.force(i) + self.contact.force(i)
            if ti.static(self.layered):
                pull += self.layers.force(i)
            f = self.free[i] * pull
            self.pull[i], self.force[i] = pull, f
            drift = (self.x[i] - self.x_hat[i]) * (self.mass[i] * inverse_dt * inverse_dt)
            self.linear.b[i] = f - self.free[i] * drift

    @ti.kernel
    def _sum_particles(self, inverse_dt: float):
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            total = ti.Vector([0.0, 0.0, 0.0, 0.0], ti.f64)
            for i in range(low, high):
                away = self.x[i] - self.x_hat[i]
                inertia = 0.5 * self.mass[i] * inverse_dt * inverse_dt * away.dot(away)
                lift = self.mass[i] * self.bears[i] * self.gravity[None].dot(self.x[i])
                total[0] += self.linear.b[i].dot(self.linear.b[i])
                total[1] += self.force[i].dot(self.force[i])
                total[2] += inertia - lift
            self.sums[chunk] = total

    @ti.kernel
    def _finish(self, inverse_h: float):
        for i in range(self.nv):
            self.v[i] = (self.x[i] - self.x_ref[i]) * inverse_h
            self.a[i] = (self.v[i] - self.v_ref[i]) * inverse_h

    @ti.kernel
    def _restore(self):
        for i in range(self.nv):
            self.x[i] = self.x_start[i]

    # -- what others ask ------------------------------------------------------------------------------------------

    def compile(self) -> None:
        """Compile every kernel of a step, so that the first step costs no more than the others."""
        self.balance()
        self._begin_stage(0.0, 0.0, 1.0, 1.0)
        self._lead_held()
        self._gather(1.0)
        self._potential(1.0)
        self.matrix.assemble(1.0)
        self.linear.solve(0.5, 1, self.reach)
        self.way.aim(self.linear.d, 1e-6)
        self.way.go(0.0)
        self.way.gone_from(self.x_start)
        self._restore()
        self.contact.end_step()
        self.elastic.rub(False)
        self.elastic.end_step()
        self.elastic.rub(True)
        if schemes.SCHEMES[self.settings.scheme].order > 1:
            self.elastic.begin_stage(self.v, 0.0, 0.0)
            self._end_stage(0.0)
        self._finish(0.0)
        self.fastest()

    def state(self) -> dict[str, np.ndarray]:
        """What the next step depends on."""
        return {
            "positions": self.x.to_numpy(),
            "velocities": self.v.to_numpy(),
            "accelerations": self.a.to_numpy(),
            "acceleration_known": np.array(self.acceleration_known),
            "slip": self.contact.slip.to_numpy(),
            "along": self.contact.along.to_numpy(),
            "touched": self.flight.touched,
            **self.elastic.state(),
        }

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``."""
        fields.upload(self.x, state["positions"])
        fields.upload(self.v, state["velocities"])
        fields.upload(self.a, state["accelerations"])
        self.acceleration_known, self.flight.touched = bool(state["acceleration_known"]), state["touched"]
        fields.upload(self.contact.slip, state["slip"])
        fields.upload(self.contact.along, state["along"])
        self.elastic.restore(state)

    def place_held(self, targets: np.ndarray) -> None:
        """Where what is held shall be at the end of the next step: targets (nv, 3) [m]."""
        fields.upload(self.held_at, targets)

    def pulls(self) -> np.ndarray:
        """(nv, 3) force [N] of all but the holds on each vertex at rest where the cloth is."""
        self.balance()
        return self.pull.to_numpy()

    def set_weight(self, share: np.ndarray) -> None:
        """Let each vertex bear a share (nv,) of its weight."""
        fields.upload(self.bears, share)

    def net_forces(self) -> np.ndarray:
        """(nv, 3) net force [N] on each vertex at rest where the cloth is; zero in equilibrium and where held."""
        self.balance()
        return self.force.to_numpy()

    def fastest(self) -> float:
        """Greatest speed of a vertex [m/s]."""
        return self.way.peak(self.v)

    def balance(self) -> float:
        """Net force on the free vertices over the weight, 2-norms, at rest where the cloth is: 0 in equilibrium."""
        self._begin()
        self._begin_stage(0.0, 0.0, 0.0, 0.0)
        self.elastic.begin_step()
        self.way.start()
        self.way.arrive()
        self._evaluate(0.0)
        self._bind(1, 0.0)
        return self._gather(0.0)[1]
