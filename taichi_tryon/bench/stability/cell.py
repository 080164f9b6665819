"""One cell of the grid: a scene under a stress, run to its end and judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_tryon import runtime
from taichi_tryon.bench.energy import held_and_height
from taichi_tryon.bench.simulate import FOLDER
from taichi_tryon.bench.stability.starts import started
from taichi_tryon.bench.stability.stresses import SCENES, Change
from taichi_tryon.errors import InputError, NoStep, RunError
from taichi_tryon.scene.load import load_scene
from taichi_tryon.setup import Setup, prepare
from taichi_tryon.simulation import Simulation
from taichi_tryon.timing import Stopwatch

# part that a cloth may hold of the energy that it was given; energy that counts as none [J]
BOUND, NOTHING = 1.05, 1e-9


@dataclass(frozen=True)
class Outcome:
    """``kind``: "held"; "refused" with a reason, where physics may say no, or the digits of the numbers do; else what
    happened: "no step", "unsettled", "energy grew", "not finite", "state lost", "input refused", "hung", "crashed".
    ``steps`` were taken, ``rejected`` others; ``energy_share``: see Ledger."""

    kind: str
    reason: str = ""
    steps: int = 0
    rejected: int = 0
    energy_share: float = 0.0

    @property
    def held(self) -> bool:
        return self.kind in ("held", "refused")


def run_cell(name: str, change: Change) -> Outcome:
    """Run a scene of SCENES with a change, in a process in which Taichi may be started."""
    file, settings = SCENES[name]
    path = FOLDER.parent / file
    try:
        scene = load_scene(path, (*settings, *_scaled(load_scene(path, settings), change), *change.settings))
        runtime.start("cpu", scene.solver.precision, scene.solver.threads)
        clock = Stopwatch()
        setup = prepare(scene, clock)
    except InputError as fault:
        return Outcome("input refused", str(fault))
    if change.start:
        setup = started(setup, *change.start)
    try:
        simulation = Simulation(setup, clock)
    except RunError as refusal:
        return Outcome("refused" if change.may_refuse else "no step", str(refusal))
    return _judged(simulation, change.may_refuse)


def _scaled(scene, change: Change) -> list[str]:
    """Settings of the figures of the fabrics, times their factors; what is not given stays so."""
    return [
        f"garments.{number}.fabric.{key}={factor * value!r}"
        for number, garment in enumerate(scene.garments)
        for key, factor in change.fabric.items()
        if (value := getattr(garment.fabric, key)) is not None
    ]


def _judged(simulation: Simulation, may_refuse: bool) -> Outcome:
    ledger, p = Ledger(simulation), simulation.progress

    def end(kind: str, reason: str = "") -> Outcome:
        return Outcome(kind, reason, p.steps, p.rejected, ledger.share)

    while not simulation.finished:
        before, phase = simulation.state(), p.phase
        try:
            simulation.advance()
        except NoStep as refusal:
            good = all(np.array_equal(before[key], simulation.state()[key]) for key in ("positions", "velocities"))
            return end(("refused" if may_refuse else "no step") if good else "state lost", str(refusal))
        if not all(np.isfinite(simulation.state()[key]).all() for key in ("positions", "velocities")):
            return end("not finite")
        ledger.count(moved=phase in ("drape", "move"))
        if ledger.share > BOUND:
            return end("energy grew", f"after {p.time:.3f} s, in step {p.steps}")
    if simulation.scene.settle.max_steps and not simulation.settled:
        reason, rounding = f"net force {p.residual:.2e} of the weight", simulation.rounding()
        if rounding > simulation.scene.settle.residual:
            return end("refused", f"{reason}, of which rounding of positions alone makes {rounding:.2e}")
        return end("refused" if may_refuse else "unsettled", reason)
    return end("held")


class Ledger:
    """What energy a cloth holds (motion, strain, contact of cloth with cloth), and what it was given.

    That is what it held at first, the work of gravity, and that of body and holds that lead it at a speed v over a way
    h, at most 2 M v^2, as if it bounced off, and M g h. Steps without inertia are not counted. Nor is what contact with
    the body stores: as a step begins it sets how far off it holds the cloth, further where cloth was found in the body,
    and so stores what the cloth was not given, which the step mostly loses. What comes out is motion and strain.
    """

    def __init__(self, simulation: Simulation):
        self.simulation, setup = simulation, simulation.setup
        mass, gravity = setup.cloth.masses.sum(), np.linalg.norm(setup.scene.gravity_m_s2)
        speed, way = _led(setup)
        self.led = mass * (2 * speed**2 + gravity * way)
        self.share, self.first = 0.0, None
        simulation.stepper.balance()
        self.count(True)

    def count(self, moved: bool) -> None:
        """After a step, with inertia (``moved``) or without: ``share`` becomes the greatest part of what it was given
        that the cloth has ever held."""
        held, height = held_and_height(self.simulation.stepper)
        held -= self.simulation.stepper.contact.energy()
        if self.first is None or not moved:
            self.first = held, height
        given = max(self.first[0] + self.first[1] - height + self.led, 0.0)
        self.share = max(self.share, held / (given + NOTHING))


def _led(setup: Setup) -> tuple[float, float]:
    """Greatest speed [m/s] and greatest distance [m] at which what is held is led, and the body where the cloth is."""
    times = np.linspace(0, setup.end_time, 2001) if setup.end_time else np.zeros(2)
    ends = np.array([setup.positions.min(axis=0), setup.positions.max(axis=0)])
    box = np.array([[ends[i, 0], ends[j, 1], ends[k, 2], 1] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    rest = np.linalg.inv(setup.motion.transforms(0.0))

    def places(time: float) -> np.ndarray:
        carried = box @ (setup.motion.transforms(time) @ rest).transpose(0, 2, 1)
        return np.concatenate([carried[..., :3].reshape(-1, 3), setup.holds.targets(time)])

    at = [places(time) for time in times]
    steps = max(np.linalg.norm(after - before, axis=1).max() for before, after in zip(at, at[1:], strict=False))
    return float(steps / max(times[1], 1e-9)), max(float(np.linalg.norm(now - at[0], axis=1).max()) for now in at)
