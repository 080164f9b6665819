"""The course of a simulation: dress, lay, drape, move, settle, one step at a time."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from taichi_tryon import fields, kernel_loops
from taichi_tryon.body.absent import AbsentField
from taichi_tryon.body.field import BodyField
from taichi_tryon.contact.raising import FURTHER
from taichi_tryon.errors import NoStep
from taichi_tryon.setup import Setup
from taichi_tryon.solver.implicit import ImplicitStep
from taichi_tryon.solver.settings import StepResult, StepSettings
from taichi_tryon.timing import Stopwatch
from taichi_tryon.units import MM

PHASES = ("dress", "lay", "drape", "move", "settle")
FORCED = ("dress", "lay")
# dressing, and laying, are over when no vertex moves further in so many steps running [m], for what is stopped by a
# fold may go on, or after so many steps
DRESSED_MOVE, CALM_STEPS, DRESS_STEPS, LAY_STEPS = 1e-3, 3, 24, 8
# the linear tolerance of dressing, whose way matters little: ten times less takes as many steps
DRESSING_TOLERANCE = 0.1
# that of settling, whose end does not depend on it: five times less takes as many steps, and half as many iterations
# again
SETTLING_TOLERANCE = 0.05
# so many times the Newton iterations while draping and moving, where a step would end with cloth in the body
GET_OUT = 20
# the body moves no further between two steps [m]
BODY_MOVE = 6e-3
# part of the stored energy by which it may rise where no smaller rise leads on
OVER_A_JUMP = 0.1
# part of settle.residual to which a step of settling is solved: what slips at its end may change it a little
SETTLED = 0.9
# so often cloth that has settled in the body between its samples is held further off there, and settles again
LIFTS = 5
# the longest step of settling [s], where there is no inertia left to follow
LONGEST_SETTLING_STEP = 1.0


@dataclass
class Progress:
    """Where a simulation stands, and what it has cost. All of it is in a checkpoint."""

    phase: str = "dress"
    phase_steps: int = 0
    phase_time: float = 0.0
    time: float = 0.0
    dt: float = 0.0
    steps: int = 0
    rejected: int = 0
    newton_iterations: int = 0
    linear_iterations: int = 0
    calm_steps: int = 0
    residual: float = np.inf
    moved: float = 0.0  # [m], the farthest that the last step took a vertex
    lifts: int = 0


class Simulation:
    """Steps a Setup from the dressed start to the worn shape; Taichi has been started.

    dress: steps without inertia and friction, in which the forced garment takes its own shape, so that nothing of the
    force sticks to the body; hands hold up what is ``held_up``; lay: steps alike, in which the body gives way no more
    and what is in it is put out, so that it sets nothing in motion; drape: it falls into place; move: body and holds go
    through their motions; settle: steps without inertia and of growing length, until the net force on the free vertices
    is below ``settle.residual`` of the weight. Phases in which a scene has nothing to do are left out.
    """

    def __init__(self, setup: Setup, clock: Stopwatch):
        scene = setup.scene
        self.setup, self.scene, self.clock = setup, scene, clock
        contact, layers, solver, skip = scene.contact, scene.contact.layers, scene.solver, scene.skip
        few = StepSettings(
            tolerance=solver.newton_tolerance,
            max_newton_iterations=solver.max_newton_iterations,
            linear_tolerance=solver.linear_tolerance,
            max_linear_iterations=solver.max_linear_iterations,
            longest_move=solver.longest_move_mm * MM,
            preconditioner=solver.preconditioner,
            scheme=solver.scheme,
        )
        inside = solver.max_newton_inside or GET_OUT * solver.max_newton_iterations
        self._moving = replace(few, max_newton_inside=inside)
        self._dressing = replace(few, linear_tolerance=max(DRESSING_TOLERANCE, few.linear_tolerance))
        self._laying = replace(self._dressing, max_newton_inside=inside)
        self._settling = replace(
            few,
            tolerance=SETTLED * scene.settle.residual,
            linear_tolerance=max(SETTLING_TOLERANCE, few.linear_tolerance),
            max_newton_iterations=2 * solver.max_newton_iterations,
        )
        with clock("body"):
            self.field = AbsentField()
            if scene.body:
                self.field = BodyField(setup.body, everywhere=not skip.far_balls, rests=skip.still_body)
                self.field.cover(setup.positions.min(axis=0), setup.positions.max(axis=0))
            self.transforms = setup.motion.transforms(0.0)
            self.field.set_pose(self.transforms)
        kernel_loops.compile_for(setup.cloth.vertex_count)
        # compiling contact is no contact
        with clock("compile", whole=True):
            self.stepper = ImplicitStep(
                setup.cloth,
                self.field,
                setup.positions,
                (contact.stiffness_N_per_m3, contact.thickness_mm * MM, contact.friction, skip.far_samples),
                np.array(scene.gravity_m_s2),
                self._moving,
                clock,
                setup.holds.free,
                layers and (layers.stiffness_N_per_m3, layers.thickness_mm * MM, layers.friction),
            )
            if not skip.constant_matrices:
                self.stepper.potential.assemble_all()
            self.stepper.compile()
            if setup.velocities.any():
                fields.upload(self.stepper.v, setup.velocities)
        self.progress = Progress(phase=self._needed(PHASES), dt=solver.step_s)
        self._set_forces()
        self._begin_rubbing()
        self.step_seconds: list[float] = []

    # -- course ---------------------------------------------------------------------------------------------------

    @property
    def finished(self) -> bool:
        return self.progress.phase == "done"

    @property
    def settled(self) -> bool:
        """Whether the net force is small enough for an equilibrium."""
        return self.progress.residual <= self.scene.settle.residual

    @property
    def fraction(self) -> float:
        """How far the present phase has come, 0 to 1; for settling by the fall of the residual."""
        p, scene = self.progress, self.scene
        if p.phase == "dress":
            return min(1.0, p.phase_steps / DRESS_STEPS)
        if p.phase == "lay":
            return min(1.0, p.phase_steps / LAY_STEPS)
        if p.phase == "drape":
            return p.phase_time / max(scene.drape.duration_s, 1e-9)
        if p.phase == "move":
            return p.phase_time / max(self.setup.end_time, 1e-9)
        if p.phase == "settle" and np.isfinite(p.residual):
            return float(np.clip(1 - np.log10(max(p.residual / scene.settle.residual, 1.0)) / 3, 0, 1))
        return 1.0 if p.phase == "done" else 0.0

    def advance(self) -> None:
        """One accepted step; where none is found while the garment is forced on, that phase is over. Raises NoStep when
        the smallest step fails; the last good state is kept."""
        p, least = self.progress, self.scene.solver.min_step_s
        while not (result := self._try_step()).accepted:
            p.rejected += 1
            if p.dt < least:
                result = self._try_over_a_jump()
                if result.accepted:
                    break
                if p.phase in FORCED and self._following() != "done":
                    # there is more than one way into a garment: the next phase takes it from here
                    self._next_phase()
                    return
                reason = result.reason or f"no step longer than solver.min_step_s = {least:g} s lowers the energy"
                raise NoStep(f"{reason}, in phase {p.phase} at {p.time:.4f} s")
        if self._phase_over():
            self._next_phase()

    def _try_over_a_jump(self) -> StepResult:
        """The smallest step once more, the energy being let rise by more. Bending jumps where cloth that does not feel
        itself is folded so far that a triangle passes through the next one: right before that, no step is short enough.
        """
        settings, step = self.stepper.settings, self.progress.dt
        self.stepper.settings = replace(settings, tolerated=OVER_A_JUMP)
        self.progress.dt = self.scene.solver.min_step_s
        try:
            result = self._try_step()
        finally:
            self.stepper.settings = settings
        if not result.accepted:
            self.progress.dt = step
        return result

    def _try_step(self) -> StepResult:
        p = self.progress
        still = p.phase not in ("drape", "move")
        dt = p.dt
        if p.phase == "drape":
            dt = min(dt, max(self.scene.drape.duration_s - p.phase_time, 1e-6))
        before = self.transforms
        if p.phase == "move":
            dt = min(dt, max(self.setup.end_time - p.phase_time, 1e-6))
            dt = self._body_step(p.phase_time, dt)

        def pose(share: float) -> None:
            if p.phase == "move":
                self.transforms = self.setup.motion.transforms(p.phase_time + share * dt)
                self.stepper.place_held(self.setup.holds.targets(p.phase_time + share * dt))
            with self.clock("body"):
                self.field.set_pose(self.transforms, before)

        error_mm = self.scene.solver.error_mm
        limited = error_mm is not None and not still and dt > self.scene.solver.min_step_s
        limit = error_mm * MM if limited else np.inf
        with self.clock("solve"):
            moving = pose if p.phase == "move" or not self.scene.skip.still_body else None
            result = self.stepper.step(dt, inertia=0.0 if still else 1.0, pose=moving, error_limit=limit)
        p.newton_iterations += result.newton_iterations
        p.linear_iterations += result.linear_iterations
        if not result.accepted:
            self.transforms = before
            self.field.set_pose(before)
            self._place_held()
            least = self.scene.solver.min_step_s if result.error > limit else 0.0
            p.dt = max(p.dt * result.change, least)
            return result
        p.steps, p.phase_steps, p.moved = p.steps + 1, p.phase_steps + 1, result.moved
        # the long steps of settling are no time that passes
        p.time, p.phase_time = p.time + min(dt, self.scene.solver.step_s), p.phase_time + dt
        p.calm_steps = p.calm_steps + 1 if result.moved <= DRESSED_MOVE else 0
        longest = LONGEST_SETTLING_STEP if p.phase == "settle" else self.scene.solver.step_s
        p.dt = min(max(p.dt * result.change, self.scene.solver.min_step_s), longest)
        return result

    def _place_held(self) -> None:
        """Hold where the paths are now."""
        p, end = self.progress, self.setup.end_time
        time = {"settle": end, "move": p.phase_time}.get(p.phase, 0.0)
        self.stepper.place_held(self.setup.holds.targets(time))

    def _set_forces(self) -> None:
        """What acts in the present phase, and how exactly it is solved."""
        phase, scene = self.progress.phase, self.scene
        settings = {"dress": self._dressing, "lay": self._laying, "settle": self._settling}
        self.stepper.settings = settings.get(phase, self._moving)
        forced = phase in FORCED
        self.stepper.contact.friction[None] = scene.contact.friction * (not forced)
        self.stepper.contact.firm(phase != "dress")
        if self.stepper.rubbing:
            self.stepper.rubbing.coefficient[None] = scene.contact.layers.friction * (not forced)
        # in the fabric too; its anchors wait where the garment lay flat, whatever way it was forced
        self.stepper.elastic.rub(not forced)
        bears = np.ones(self.setup.cloth.vertex_count)
        if forced:
            for part, garment in zip(self.setup.cloth.parts, self.setup.garments, strict=True):
                # a sheet waits where it was placed
                bears[part.vertices] = garment.spec.sheet is None and not garment.spec.dressing.held_up
        self.stepper.set_weight(bears)

    def _body_step(self, start: float, dt: float) -> float:
        """The part of dt in which no ball of the body and nothing held moves further than BODY_MOVE."""

        def led(time: float) -> np.ndarray:
            balls = self.setup.body.posed(self.setup.motion.transforms(time))
            return np.concatenate([balls.centers, self.setup.holds.targets(time)])

        now = led(start)
        while dt > self.scene.solver.min_step_s:
            if np.linalg.norm(led(start + dt) - now, axis=1).max() <= BODY_MOVE:
                break
            dt *= 0.5
        return dt

    def _phase_over(self) -> bool:
        p, scene = self.progress, self.scene
        if p.phase == "dress":
            return p.calm_steps >= CALM_STEPS or p.phase_steps >= DRESS_STEPS
        if p.phase == "lay":
            return min(p.calm_steps, p.phase_steps) >= CALM_STEPS or p.phase_steps >= LAY_STEPS
        if p.phase == "drape":
            return p.phase_time >= scene.drape.duration_s - 1e-9
        if p.phase == "move":
            return p.phase_time >= self.setup.end_time - 1e-9
        with self.clock("solve"):
            p.residual = self.stepper.balance()
        # while cloth settles, how far off it is held must stay, or it never rests
        lifted = self.settled and p.lifts < LIFTS and self.stepper.contact.lift(FURTHER) > 0.0
        p.lifts += lifted
        return (self.settled and not lifted) or p.phase_steps >= scene.settle.max_steps

    def _next_phase(self) -> None:
        p = self.progress
        p.phase = self._following()
        p.phase_steps, p.phase_time, p.dt = 0, 0.0, self.scene.solver.step_s
        if p.phase == "settle":
            self.field.set_pose(self.transforms)
        self._set_forces()
        self._begin_rubbing()

    def _begin_rubbing(self) -> None:
        """Where dry friction begins to act, cloth that lay flat has been bent and sheared to its present shape."""
        self.stepper.elastic.end_step()

    def _following(self) -> str:
        return self._needed(PHASES[PHASES.index(self.progress.phase) + 1 :])

    def _needed(self, phases: tuple[str, ...]) -> str:
        """The first of the phases that this scene has anything to do in, "done" where none has."""
        dressed = any(garment.spec.dressing for garment in self.setup.garments)
        falls, moves = self.scene.drape.duration_s > 0, self.setup.end_time > 0
        needed = {
            "dress": dressed,
            "lay": dressed and (falls or moves),
            "drape": falls,
            "move": moves,
            "settle": self.scene.settle.max_steps > 0,
        }
        return next((phase for phase in phases if needed[phase]), "done")

    def rounding(self) -> float:
        """Net force on the free vertices over the weight, 2-norms, that rounding of positions makes by itself: in
        single precision 0.1 um in stiff cloth. What is below it cannot be reached."""
        step, state = self.stepper, self.stepper.state()
        forces, positions = step.net_forces(), state["positions"]
        signs = np.random.default_rng(0).choice([-1, 1], positions.shape).astype(positions.dtype)
        step.restore({**state, "positions": np.nextafter(positions, signs * np.inf)})
        change = step.net_forces() - forces
        step.restore(state)
        # a digit was changed, while rounding is evenly between half a digit less and half a digit more
        return float(np.linalg.norm(change) / (np.sqrt(12) * step.potential.weight))

    def reactions(self) -> dict[str, np.ndarray]:
        """Force (3,) [N] of each hold on the cloth, at rest where it is."""
        return self.setup.holds.reactions(self.stepper.pulls())

    # -- state ----------------------------------------------------------------------------------------------------

    def state(self) -> dict[str, np.ndarray]:
        """Everything that the further course depends on, as arrays."""
        arrays = {f"progress_{key}": np.array(value) for key, value in asdict(self.progress).items()}
        return {**self.stepper.state(), **arrays, "transforms": self.transforms}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``."""
        self.transforms = state["transforms"]
        self.field.set_pose(self.transforms)
        self.stepper.restore(state)
        self.progress = Progress(**{key: state[f"progress_{key}"].item() for key in asdict(self.progress)})
        self._set_forces()
        self.stepper.contact.cover()
        self._place_held()
