"""The semi-implicit step: backward Euler, linearised, iterated where one linear solve is not enough.

Each step minimises the incremental potential

    Phi(x) = |x - x_hat|_M^2 / (2 dt^2) + E_elastic(x) + E_contact(x) - m g.x,   x_hat = x_n + dt v_n,

by Newton's method: (M / dt^2 + H) d = -grad Phi, H made positive semi-definite block by block, and a line search on Phi
that costs nothing where the full step lowers it. The first iteration alone is the linearly implicit Euler step of
Baraff and Witkin 1998.
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth.elastic import Elastic
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.contact.body import BodyContact
from taichi_tryon.contact.samples import Samples
from taichi_tryon.solver import coarse as coarse_space
from taichi_tryon.solver.conjugate_gradients import ConjugateGradients
from taichi_tryon.solver.matrix import Matrix

# vertices of the cloth per node of the coarse space, and its greatest size: E is dense
VERTICES_PER_NODE, MOST_NODES = 50, 160
# the line search tries no smaller share of a step; part of the stored energy by which Phi may rise where it jumps
LEAST_SHARE, TOLERATED = 1 / 64, 0.01
# Newton iterations that share a coarse space
REFRESH = 2


@dataclass(frozen=True)
class StepSettings:
    """What a step may cost and how exact it is.

    tolerance: out-of-balance force of the step relative to the weight, 2-norms. linear_tolerance: preconditioned
    residual of the linear solve. longest_move [m]: no vertex goes further in one Newton iteration, so that nothing
    jumps through a limb.
    """

    tolerance: float
    max_newton_iterations: int
    linear_tolerance: float
    max_linear_iterations: int
    longest_move: float
    preconditioner: str = "coarse"


@dataclass(frozen=True)
class StepResult:
    """How a step went. ``residual`` is the out-of-balance force over the weight that was left; ``moved`` [m] the
    farthest that any vertex went."""

    accepted: bool
    newton_iterations: int
    linear_iterations: int
    residual: float
    moved: float


@ti.data_oriented
class ImplicitStep:
    """Positions ``x``, velocities ``v`` and laws of the cloth, and the step that moves them on."""

    def __init__(
        self, cloth: Cloth, body, positions: np.ndarray, contact, gravity, settings: StepSettings, clock, free=None
    ):
        """positions (nv, 3) [m]; contact: stiffness [N/m^3], thickness [m], friction; free (nv, 3), False where and
        along which axes a vertex is held."""
        self.nv, self.settings, self.clock = cloth.vertex_count, settings, clock
        self.x, self.v, self.x_start, self.x_hat, self.x_base, self.force = (
            ti.Vector.field(3, float, shape=self.nv) for _ in range(6)
        )
        fields.upload(self.x, positions)
        self.mass = fields.scalars(cloth.masses)
        self.free = fields.vectors(np.ones((self.nv, 3)) if free is None else np.asarray(free, float))
        self.gravity = ti.Vector.field(3, float, shape=())
        self.gravity[None] = gravity
        # share of its weight that each vertex bears
        self.bears = fields.scalars(np.ones(self.nv))
        # where what is held shall be at the end of a step; forces of all else on every vertex
        self.held_at, self.pull = (ti.Vector.field(3, float, shape=self.nv) for _ in range(2))
        fields.upload(self.held_at, positions)
        held = np.zeros(self.nv, bool) if free is None else ~np.asarray(free, bool).any(axis=1)
        self.weight = float(np.linalg.norm(gravity) * np.linalg.norm(cloth.masses[~held])) or 1.0
        self.elastic = Elastic(cloth, self.x)
        samples = Samples.of(cloth.triangles, cloth.areas, cloth.hinges[:, :2], cloth.triangle_edges, self.nv)
        self.contact = BodyContact(samples, body, self.x, self.x_start, self.v, *contact)
        self.matrix = Matrix(self.elastic, self.contact, self.mass, self.free)
        self.coarse, self.reach = None, 1.0
        if settings.preconditioner == "coarse":
            self.coarse, self.reach = self._coarse_space(cloth)
        self.linear = ConjugateGradients(self.matrix, self.coarse)
        self.sums = ti.Vector.field(4, ti.f64, shape=fields.CHUNKS)
        self.peaks = ti.field(ti.f64, shape=fields.CHUNKS)

    def _coarse_space(self, cloth: Cloth):
        # rest lengths of the triangles' sides, from the hats' gradients: |e_k| = 2 A |g_k|
        sides = 2 * cloth.areas[:, None] * np.linalg.norm(cloth.gradients, axis=2)
        lengths = np.zeros(len(cloth.hinges))
        lengths[cloth.triangle_edges.ravel()] = sides.ravel()
        nodes = int(np.clip(self.nv // VERTICES_PER_NODE, 1, MOST_NODES))
        ids, weights = coarse_space.spread(cloth.hinges[:, :2], lengths, self.nv, nodes)
        reach = float(np.sqrt(cloth.areas.sum() / nodes))
        return coarse_space.CoarseSpace(self.matrix, self.x, ids, weights), reach

    # -- one step -------------------------------------------------------------------------------------------------

    def step(self, dt: float, inertia: float = 1.0, body_moves: bool = False) -> StepResult:
        """Move the cloth on by ``dt`` [s]; where it fails the cloth stays as it was. ``inertia`` 0: from rest."""
        s, inverse_dt = self.settings, 1.0 / dt
        self._begin(dt * inertia)
        self.elastic.begin_step()
        if body_moves:
            self.contact.carry()
        self._lead_held()
        self._evaluate(inverse_dt)
        self.contact.bind(1, dt * inertia)
        residual = self._gather(inverse_dt)[0]
        newton = linear = 0
        progress = False
        while newton < s.max_newton_iterations:
            before = self._potential(inverse_dt)
            self.matrix.assemble(inverse_dt)
            iterations, _ = self.linear.solve(
                s.linear_tolerance, s.max_linear_iterations, self.reach, refresh=newton % REFRESH == 0
            )
            newton, linear = newton + 1, linear + iterations
            share = self._search(before, inverse_dt)
            if share == 0.0:
                break
            progress = True
            self.contact.bind(0, 0.0)
            residual = self._gather(inverse_dt)[0]
            if residual <= s.tolerance:
                break
        moved = self._farthest()
        accepted = bool(np.isfinite(residual) and (progress or residual <= s.tolerance))
        if accepted:
            self._finish(inverse_dt * inertia)
            self.contact.end_step()
        else:
            self._restore()
        return StepResult(accepted, newton, linear, residual, moved)

    def _evaluate(self, inverse_dt: float):
        self.elastic.evaluate(inverse_dt)
        with self.clock("contact"):
            self.contact.evaluate()

    def _search(self, before: float, inverse_dt: float) -> float:
        """Go along d as far as Phi falls; returns the share of d gone, 0 where none can be.

        Where two limbs meet, the body's gap jumps from the one to the other and Phi with it, while d is right for all
        the rest of the cloth: then the shortest share is gone if Phi rises by no more than TOLERATED of what is stored.
        """
        longest = self._longest_direction()
        if not np.isfinite(longest):
            return 0.0
        share = min(1.0, self.settings.longest_move / max(longest, 1e-30))
        self._keep_base()
        while True:
            self._move(share)
            self._evaluate(inverse_dt)
            rise = self._potential(inverse_dt) - before
            if rise <= 1e-9 * abs(before):
                return share
            if share < 2 * LEAST_SHARE:
                break
            share *= 0.5
        if rise <= TOLERATED * self._stored(inverse_dt):
            return share
        self._move(0.0)
        self._evaluate(inverse_dt)
        return 0.0

    def _stored(self, inverse_dt: float) -> float:
        """Elastic and contact energy [J] at the positions last evaluated."""
        return float(self.elastic.energies(inverse_dt).sum()) + self.contact.energy()

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
    def _begin(self, ahead: float):
        for i in range(self.nv):
            self.x_start[i] = self.x[i]
            self.x_hat[i] = self.x[i] + ahead * self.v[i]

    @ti.kernel
    def _lead_held(self):
        for i in range(self.nv):
            self.x[i] += (1.0 - self.free[i]) * (self.held_at[i] - self.x[i])

    @ti.kernel
    def _gather_forces(self, inverse_dt: float):
        for i in range(self.nv):
            pull = self.mass[i] * self.bears[i] * self.gravity[None] + self.elastic.force(i) + self.contact.force(i)
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
                total += ti.Vector(
                    [
                        self.linear.b[i].dot(self.linear.b[i]),
                        self.force[i].dot(self.force[i]),
                        inertia - lift,
                        0.5 * self.mass[i] * self.v[i].dot(self.v[i]),
                    ],
                    ti.f64,
                )
            self.sums[chunk] = total

    @ti.kernel
    def _keep_base(self):
        for i in range(self.nv):
            self.x_base[i] = self.x[i]

    @ti.kernel
    def _move(self, share: float):
        for i in range(self.nv):
            self.x[i] = self.x_base[i] + share * self.linear.d[i]

    @ti.kernel
    def _finish(self, inverse_dt: float):
        for i in range(self.nv):
            self.v[i] = (self.x[i] - self.x_start[i]) * inverse_dt

    @ti.kernel
    def _restore(self):
        for i in range(self.nv):
            self.x[i] = self.x_start[i]

    @ti.kernel
    def _peak(self, which: ti.template()):
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            peak = ti.cast(0.0, ti.f64)
            for i in range(low, high):
                a = self.linear.d[i]
                if ti.static(which == 1):
                    a = self.x[i] - self.x_start[i]
                if ti.static(which == 2):
                    a = self.v[i]
                size = ti.cast(a.norm(), ti.f64)
                # a NaN or infinity must win over every number
                if not size < 1e300:
                    size = 1e300
                peak = ti.max(peak, size)
            self.peaks[chunk] = peak

    def _longest_direction(self) -> float:
        self._peak(0)
        peak = float(self.peaks.to_numpy().max())
        return peak if peak < 1e300 else np.inf

    def _farthest(self) -> float:
        self._peak(1)
        return float(self.peaks.to_numpy().max())

    # -- what others ask ------------------------------------------------------------------------------------------

    def compile(self) -> None:
        """Compile every kernel of a step, so that the first step costs no more than the others."""
        self.balance()
        self._begin(1.0)
        self._lead_held()
        self._gather(1.0)
        self._potential(1.0)
        self.matrix.assemble(1.0)
        self.linear.solve(0.5, 1, self.reach)
        self._longest_direction()
        self._keep_base()
        self._move(0.0)
        self._farthest()
        self._restore()
        self.contact.end_step()
        self._finish(0.0)
        self.fastest()

    def state(self) -> dict[str, np.ndarray]:
        """What the next step depends on."""
        return {
            "positions": self.x.to_numpy(),
            "velocities": self.v.to_numpy(),
            "slip": self.contact.slip.to_numpy(),
            "along": self.contact.along.to_numpy(),
            "rotation": self.elastic.rotation.to_numpy(),
        }

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``."""
        fields.upload(self.x, state["positions"])
        fields.upload(self.v, state["velocities"])
        fields.upload(self.contact.slip, state["slip"])
        fields.upload(self.contact.along, state["along"])
        fields.upload(self.elastic.rotation, state["rotation"])

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
        self._peak(2)
        return float(self.peaks.to_numpy().max())

    def balance(self) -> float:
        """Net force on the free vertices over the weight, 2-norms, at rest where the cloth is: 0 in equilibrium."""
        self._begin(0.0)
        self.elastic.begin_step()
        self._evaluate(0.0)
        self.contact.bind(1, 0.0)
        return self._gather(0.0)[1]
