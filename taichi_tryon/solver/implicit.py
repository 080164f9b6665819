"""The implicit step: backward Euler, linearised and iterated where one linear solve is not enough, or TR-BDF2.

Each stage of a step (see ``schemes``; backward Euler has one, with dt = H) minimises the incremental potential

    Phi(x) = |x - x_hat|_M^2 / (2 dt^2) + E_elastic(x) + E_contact(x) - m g.x,   x_hat = x_ref + dt v_ref,

by Newton's method (see ``potential`` and ``newton``), whose first iteration alone is the linearly implicit Euler step
of Baraff and Witkin 1998.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth.elastic import Elastic
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.contact.body import BodyContact
from taichi_tryon.contact.cloth import ClothContact
from taichi_tryon.contact.raising import FURTHER
from taichi_tryon.contact.samples import Samples
from taichi_tryon.errors import StepFailure
from taichi_tryon.solver import schemes
from taichi_tryon.solver.momentum import FreeFlight
from taichi_tryon.solver.newton import Newton, Solution
from taichi_tryon.solver.potential import Potential
from taichi_tryon.solver.settings import StepResult, StepSettings
from taichi_tryon.solver.way import Way

# so often at most a step puts out what it would leave in the body, by so many Newton iterations at most, where it else
# takes fewer: what is not at rest where it was put is thrown from there
OUT, OUT_ITERATIONS = 10, 5


@ti.data_oriented
class ImplicitStep:
    """Positions ``x``, velocities ``v`` and laws of the cloth, and the step that moves them on."""

    def __init__(
        self, cloth: Cloth, body, positions, contact, gravity, settings: StepSettings, clock, free=None, layers=None
    ):
        """positions (nv, 3) [m]; contact: stiffness [N/m^3], thickness [m], friction, and whether what is far off
        the body sleeps; free (nv, 3), False where and along which axes a vertex is held; layers: stiffness,
        thickness and friction of the contact of cloth with cloth, None where it is not wanted."""
        self.nv, self.settings = cloth.vertex_count, settings
        self.x, self.v, self.a, self.x_start, self.path = (ti.Vector.field(3, float, shape=self.nv) for _ in range(5))
        # of the stage that is solved, and the velocity at which the one before ended: see schemes
        self.x_ref, self.v_stage = (ti.Vector.field(3, float, shape=self.nv) for _ in range(2))
        # after a step without inertia, ``a`` says nothing
        self.acceleration_known = False
        # where what is held shall be at the end of a step
        self.held_at = ti.Vector.field(3, float, shape=self.nv)
        self.elastic = Elastic(cloth, self.x)
        samples = Samples.none()
        if body.present:
            samples = Samples.of(cloth.triangles, cloth.rest, cloth.areas, cloth.hinges[:, :2], cloth.triangle_edges)
        self.contact = BodyContact(samples, body, self.x, self.x_start, self.v, *contact)
        self.layers = None if layers is None else ClothContact(cloth, self.x, self.path, *layers, self.x_start, self.v)
        self.rubbing = self.layers.rubbing if self.layers else None
        tables = fields.Tables()
        tables.set(self.x, positions)
        tables.set(self.held_at, positions)
        free = np.ones((self.nv, 3)) if free is None else free
        laws = (self.elastic, self.contact, self.layers)
        self.potential = Potential(self.x, cloth.masses, free, gravity, laws, tables, clock)
        tables.fill()
        self.mass, self.free, self.gravity = self.potential.mass, self.potential.free, self.potential.gravity
        self.way = Way(self.x, self.path, self.contact, self.layers, clock)
        self.newton = Newton(cloth, self.potential, self.way, settings.preconditioner, clock)
        self.flight = FreeFlight(cloth)
        self.sums = fields.sums(2)

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
        since, found, residual, reason, before = 0.0, True, 0.0, "", self.newton.state()
        for stage in scheme.stages:
            h = stage.h * dt
            self._begin_stage(stage.ahead * dt, stage.beyond, h, inertia)
            if stage.ahead + stage.beyond > 0.0:
                self.elastic.begin_stage(self.v, stage.ahead * dt, stage.beyond)
            try:
                self._lead(since, stage.end, pose)
                solution = self.newton.minimise(1.0 / h, (stage.end - since) * dt * inertia, self.settings)
            except StepFailure as fault:
                found, reason = False, str(fault)
                break
            newton, linear = newton + solution.newton_iterations, linear + solution.linear_iterations
            found, residual = solution.found, solution.residual
            if not found:
                break
            self.flight.meet(self.contact, self.layers, first=since == 0.0)
            since = stage.end
            if since < 1.0:
                self._end_stage(1.0 / h)
        moved = self.way.gone_from(self.x_start)
        error = dt * self._error(1.0 / h, scheme.error) if found and np.isfinite(error_limit) else 0.0
        accepted = found and error <= error_limit
        if accepted:
            self.flight.leave(self, dt * inertia)
            self._finish(stage.ahead * dt, stage.beyond, inertia / h)
            self.flight.keep(self)
            self.acceleration_known = inertia > 0.0
            if self.settings.puts_out:
                out = self._put_out(1.0 / h, dt * inertia)
                newton, linear = newton + out.newton_iterations, linear + out.linear_iterations
            self.contact.end_step()
            if self.rubbing:
                self.rubbing.end_step()
            self.elastic.end_step()
        else:
            self._restore()
            self.newton.restore(before)
        change = scheme.change(error, error_limit) if found else schemes.FAILED
        return StepResult(accepted, newton, linear, residual, moved, error, change, reason)

    def _scheme(self, inertia: float) -> schemes.Scheme:
        """The scheme of a step: without inertia there is nothing to be followed exactly."""
        scheme = schemes.SCHEMES[self.settings.scheme] if inertia > 0.0 else schemes.BACKWARD_EULER
        return schemes.STARTING if scheme.needs_acceleration and not self.acceleration_known else scheme

    def _lead(self, since: float, end: float, pose: Callable[[float], None] | None) -> None:
        """Move body, what it carries and what is held on, from a share of the step to another."""
        self.way.start()
        if pose is not None:
            pose(end)
            if self.contact.body.moves:
                self.contact.carry((end - since) / end)
        self._lead_held()
        self.way.arrive()

    @ti.kernel
    def _begin(self):
        for i in range(self.nv):
            self.x_start[i], self.v_stage[i] = self.x[i], self.v[i]

    @ti.kernel
    def _begin_stage(self, ahead: float, beyond: float, h: float, inertia: float):
        for i in range(self.nv):
            start, v = self.x_start[i], self.v[i]
            self.x_ref[i] = start + ahead * v + beyond * (self.x[i] - start)
            self.potential.x_hat[i] = self.x_ref[i] + h * inertia * self._v_ref(i, ahead, beyond)

    @ti.func
    def _v_ref(self, i: int, ahead: float, beyond: float):
        v = self.v[i]
        return v + ahead * self.a[i] + beyond * (self.v_stage[i] - v)

    @ti.kernel
    def _end_stage(self, inverse_h: float):
        for i in range(self.nv):
            self.v_stage[i] = (self.x[i] - self.x_ref[i]) * inverse_h

    @ti.kernel
    def _sum_errors(self, sums: ti.types.ndarray(), inverse_h: float, first: float, middle: float, last: float):
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            total = ti.Vector([0.0, 0.0], ti.f64)
            for i in range(low, high):
                v = (self.x[i] - self.x_ref[i]) * inverse_h
                error = first * self.v[i] + middle * self.v_stage[i] + last * v
                total[0] += self.mass[i] * error.dot(error)
                total[1] += self.mass[i]
            for k in ti.static(range(2)):
                sums[chunk, k] = total[k]

    def _error(self, inverse_h: float, weights: tuple[float, float, float]) -> float:
        """Local error of the step over its length [m/s], root of the mean square over the mass."""
        self._sum_errors(self.sums, inverse_h, *weights)
        square, mass = self.sums.sum(axis=0)
        return float(np.sqrt(square / mass))

    @ti.kernel
    def _lead_held(self):
        for i in range(self.nv):
            self.x[i] += (1.0 - self.free[i]) * (self.held_at[i] - self.x[i])

    @ti.kernel
    def _finish(self, ahead: float, beyond: float, inverse_h: float):
        for i in range(self.nv):
            v_ref = self._v_ref(i, ahead, beyond)
            self.v[i] = (self.x[i] - self.x_ref[i]) * inverse_h
            self.a[i] = (self.v[i] - v_ref) * inverse_h

    def _put_out(self, inverse_h: float, ahead: float) -> Solution:
        """Move the cloth, which keeps its velocities, so that what is in the body between its samples comes out; what
        that cost."""
        cost, least, best = Solution(), np.inf, None
        settings = replace(
            self.settings, max_newton_iterations=max(OUT_ITERATIONS, self.settings.max_newton_iterations)
        )
        for again in range(OUT):
            inside = self.contact.lift(np.inf, lets_down=not again)
            if inside == 0.0:
                return cost
            if inside >= max(least, FURTHER):
                # what is held further off has pushed other cloth in, too deep: the next steps will see
                break
            if inside < least:
                best, least = self.x.to_numpy(), inside
            try:
                solution = self.newton.minimise(inverse_h, ahead, settings)
            except StepFailure:
                break
            cost.newton_iterations += solution.newton_iterations
            cost.linear_iterations += solution.linear_iterations
        fields.upload(self.x, best)
        return cost

    @ti.kernel
    def _restore(self):
        for i in range(self.nv):
            self.x[i] = self.x_start[i]

    # -- what others ask ------------------------------------------------------------------------------------------

    def compile(self) -> None:
        """Compile every kernel of a step, so that the first step costs no more than the others."""
        self.balance()
        self._lead_held()
        self.newton.compile()
        self.way.gone_from(self.x_start)
        self._restore()
        self.contact.end_step()
        self.contact.kept.fill(0.0)
        self.elastic.rub(False)
        self.elastic.end_step()
        self.elastic.rub(True)
        if schemes.SCHEMES[self.settings.scheme].order > 1:
            self.elastic.begin_stage(self.v, 0.0, 0.0)
            self._end_stage(0.0)
        self._finish(0.0, 0.0, 0.0)
        self.fastest()

    def state(self) -> dict[str, np.ndarray]:
        """What the next step depends on."""
        return {
            "positions": self.x.to_numpy(),
            "velocities": self.v.to_numpy(),
            "accelerations": self.a.to_numpy(),
            "acceleration_known": np.array(self.acceleration_known),
            **self.contact.state(),
            "touched": self.flight.touched,
            **self.newton.state(),
            **self.elastic.state(),
            **(self.rubbing.state() if self.rubbing else {}),
        }

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``, the body being where it was."""
        fields.upload(self.x, state["positions"])
        fields.upload(self.v, state["velocities"])
        fields.upload(self.a, state["accelerations"])
        self.acceleration_known, self.flight.touched = bool(state["acceleration_known"]), state["touched"]
        self.newton.restore(state)
        self.contact.restore(state)
        self.elastic.restore(state)
        if self.rubbing:
            self.rubbing.restore(state)

    def place_held(self, targets: np.ndarray) -> None:
        """Where what is held shall be at the end of the next step: targets (nv, 3) [m]."""
        fields.upload(self.held_at, targets)

    def pulls(self) -> np.ndarray:
        """(nv, 3) force [N] of all but the holds on each vertex at rest where the cloth is."""
        self.balance()
        return self.potential.pull.to_numpy()

    def set_weight(self, share: np.ndarray) -> None:
        """Let each vertex bear a share (nv,) of its weight."""
        fields.upload(self.potential.bears, share)

    def net_forces(self) -> np.ndarray:
        """(nv, 3) net force [N] on each vertex at rest where the cloth is; zero in equilibrium and where held."""
        self.balance()
        return self.potential.pull.to_numpy() * self.free.to_numpy()

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
        self.potential.begin(0.0, 0.0)
        return self.newton.slope()[1]
