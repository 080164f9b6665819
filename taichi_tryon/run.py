"""``run``: a scene from file to worn shape, with everything written on the way."""

from __future__ import annotations

import logging
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taichi_tryon import STARTED, runtime
from taichi_tryon import progress as progress_report
from taichi_tryon.body.meeting import meeting
from taichi_tryon.errors import InputError, Interrupted, NoStep, RunError, TryonError
from taichi_tryon.failure import DEEP, Failure, explain
from taichi_tryon.figures import fit_lines
from taichi_tryon.observe import Observer
from taichi_tryon.output import checkpoint, folder, report
from taichi_tryon.output.files import replace_atomically
from taichi_tryon.output.observation import Inspection
from taichi_tryon.recorder import Recorder
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.scene.resolved import to_yaml
from taichi_tryon.setup import prepare
from taichi_tryon.simulation import Simulation
from taichi_tryon.skipped import skipped
from taichi_tryon.timing import Stopwatch
from taichi_tryon.units import CM, MM

# what a checkpoint holds beside the simulation's own state
RECORDED = ("frame_index", "skin_pose", "skin_frame", "next_frame")
# how a warning of cloth in the body ends that has no way out
MEETING = "run into each other"
EXIT_CODES = {"settled": 0, "finished": 0, "failed": 3, "interrupted": 130}


@dataclass(frozen=True)
class Result:
    """How a run ended, and where its files are; ``advice`` says where and why it failed and what to try."""

    status: str
    reason: str
    output: Path
    advice: str = ""

    @property
    def exit_code(self) -> int:
        return EXIT_CODES[self.status]


def run_scene(
    scene: SceneSpec,
    output: Path,
    *,
    arch: str | None = None,
    resume: bool = False,
    progress: progress_report.Report = progress_report.silent,
) -> Result:
    """Run a scene and write the output folder.

    Raises InputError before anything is written where the input is at fault, Interrupted where the user stops it before
    there is anything to keep, RunError where the disk refuses the report or what comes before the first step.
    """
    with stop_by_signal() as stop:
        try:
            return _run_scene(scene, output, arch, resume, progress, stop)
        except KeyboardInterrupt as fault:
            raise Interrupted("interrupted before the first step: nothing is kept") from fault


def _run_scene(scene, output, arch, resume, progress, stop) -> Result:
    folder.require_writable(output)
    folder.require_free(output)
    clock = Stopwatch()
    text = to_yaml(scene)
    state = checkpoint.load(output, text) if resume else None
    with clock("startup"):
        device = runtime.start(arch, scene.solver.precision, scene.solver.threads)
    clock.seconds["startup"] += time.perf_counter() - STARTED - clock.seconds["startup"]
    progress("prepare", 0.0)
    setup = prepare(scene, clock)
    progress("compile", 0.0)
    simulation = Simulation(setup, clock)
    if state is not None:
        _restore(simulation, state, output)
    with log_to(output):
        folder.clear(output, resumed=state is not None)
        one = _Run(simulation, output, text, clock, device, progress, state)
        try:
            return one.go(stop)
        finally:
            one.recorder.close()


def _restore(simulation: Simulation, state: dict[str, np.ndarray], output: Path) -> None:
    """Bring a simulation to where a checkpoint was written. Raises InputError where it is of another program."""
    try:
        simulation.restore({name: values for name, values in state.items() if name not in RECORDED})
        _ = [state[name] for name in RECORDED]
    except (KeyError, ValueError, TypeError, AttributeError, RuntimeError) as fault:
        raise InputError(
            f"{output / checkpoint.NAME}: does not fit this program ({fault}); leave --resume out to start anew"
        ) from fault


class _Run:
    """One run: its loop, its end, its report."""

    def __init__(self, simulation, output, text, clock, device, progress, state):
        self.simulation, self.output, self.clock = simulation, output, clock
        self.device, self.text, self.progress = device, text, progress
        self.log = logging.getLogger("taichi_tryon")
        self.next_frame = 0.0 if state is None else float(state["next_frame"])
        with clock("output"):
            replace_atomically(output / "scene.yaml", lambda path: path.write_text(text))
            self.observer = Observer(simulation)
            self.recorder = Recorder(self.observer, output, state)
        if self.recorder.message:
            self.log.warning(self.recorder.message)
        self.interval = 1.0 / simulation.scene.output.frames_per_s
        self.step_seconds: list[float] = []
        self.residuals: list[float] = []
        self.warnings = [*simulation.setup.notes]
        if self.recorder.message:
            self.warnings.append(self.recorder.message)

    def go(self, stop: Stop) -> Result:
        stop.gently, of_cloth = True, True
        try:
            self._loop(stop)
            status, reason = self._outcome()
        except KeyboardInterrupt:
            status, reason = "interrupted", "stopped by the user; --resume goes on from here"
        except RunError as fault:
            # else the disk's
            status, reason, of_cloth = "failed", str(fault), isinstance(fault, NoStep)
        failure = self._end(status, reason, status == "failed" and of_cloth)
        advice = failure.lines() if failure else ""
        self.log.info("%s", "\n".join(filter(None, (f"{status}: {reason}", advice))))
        return Result(status, reason, self.output, advice)

    def _loop(self, stop: Stop) -> None:
        simulation, saved = self.simulation, time.monotonic()
        if self.recorder.index == 0:
            self._record()
            self._save()
        while not simulation.finished:
            if stop.asked:
                raise KeyboardInterrupt
            phase, begin = simulation.progress.phase, time.perf_counter()
            simulation.advance()
            self.step_seconds.append(time.perf_counter() - begin)
            p = simulation.progress
            if phase == "settle":
                self.residuals.append(p.residual)
            if phase != "settle" and p.time >= self.next_frame - 1e-9:
                self._record()
            self.progress(phase, simulation.fraction if p.phase == phase else 1.0, f"{p.time:.2f} s simulated")
            if phase != p.phase:
                self.log.info("%s done after %d steps, %.3f s simulated", phase, p.steps, p.time)
            # at the end only behind the last frame: who goes on from there does not write it any more
            if not simulation.finished and time.monotonic() - saved > simulation.scene.output.checkpoint_s:
                self._save()
                saved = time.monotonic()
        if self.step_seconds:  # else the run that went on from a checkpoint was over already
            self._record()
        folder.clear_frames(self.output, self.recorder.index)

    def _record(self) -> None:
        with self.clock("output"):
            self.recorder.record()
        self.next_frame = (int(self.simulation.progress.time / self.interval + 1e-9) + 1) * self.interval

    def _save(self) -> None:
        with self.clock("output"):
            state = {**self.simulation.state(), **self.recorder.state(), "next_frame": np.array(self.next_frame)}
            checkpoint.save(self.output, self.text, state)

    def _outcome(self) -> tuple[str, str]:
        limit, p = self.simulation.scene.settle.residual, self.simulation.progress
        if self.simulation.settled:
            inside, deep = self._inside()
            if deep:
                return "failed", inside
            if inside:
                self.log.warning(inside)
                self.warnings.append(inside)
            return "settled", f"net force {p.residual:.2e} of the weight (limit {limit:g}) after {p.steps} steps"
        if limit_is_off(self.simulation.scene):
            return "finished", f"the motion is over; settling was not asked for ({p.steps} steps)"
        force = f"net force {p.residual:.2e} of the weight, limit {limit:g}"
        if (rounding := self.simulation.rounding()) > limit:
            force += f"; rounding of positions alone makes {rounding:.2e}"
        if inside := self._inside()[0]:
            force += f"; {inside}"
        return "failed", f"not settled after settle.max_steps: {force}"

    def _inside(self) -> tuple[str, bool]:
        """What is said of cloth that rests in the body, nothing where none does; and whether it is DEEP in it though no
        limbs run into each other there: then a limb may be in the cloth."""
        depths, simulation = self.observer.probe.look()[0], self.simulation
        deepest, cloth = int(np.argmax(depths)), simulation.setup.cloth
        if depths[deepest] == 0:
            return "", False
        at = simulation.stepper.x.to_numpy()[cloth.triangles[deepest]].mean(axis=0)
        told = f"cloth is {depths[deepest] / MM:.2g} mm inside the body"
        if limbs := self._meeting(at):
            return f"{told} where {' and '.join(limbs)} {MEETING}", False
        parts = zip(cloth.parts, simulation.setup.garments, strict=True)
        part, mesh = next((part, garment.mesh) for part, garment in parts if deepest < part.triangles.stop)
        panel = mesh.panel_names[mesh.panel[deepest - part.triangles.start]]
        place = ", ".join(f"{x:.1f}" for x in at / CM)
        return f"{told}, in {part.name}, panel {panel}, at [{place}] cm", bool(depths[deepest] > DEEP)

    def _meeting(self, at: np.ndarray) -> tuple[str, str] | None:
        """The limbs that run into each other around a point (3,) [m]."""
        simulation = self.simulation
        if not simulation.scene.body or not np.isfinite(at).all():
            return None
        body = simulation.setup.body
        pair = meeting(body.posed(simulation.transforms), at)
        return pair and tuple(body.group_names[group] for group in pair)

    def _end(self, status: str, reason: str, explained: bool) -> Failure | None:
        """Everything that can still be written is written, whatever the status; why the cloth failed, where that is to
        be ``explained``."""
        faults, failure = [], None

        def attempt(action: Callable[[], None]) -> None:
            try:
                with self.clock("output"):
                    action()
            except TryonError as fault:
                faults.append(str(fault))

        attempt(self._save)
        attempt(self.recorder.finish)
        with self.clock("output"):
            whole, garments = self.observer.inspect()
        if explained:
            setup, progress = self.simulation.setup, self.simulation.progress
            rounding = self.simulation.rounding()
            failure = explain(setup.scene, setup.garments, garments, progress, self.residuals, rounding, self._meeting)
            spot, caption = np.array(failure.world_cm) * CM, f"{failure.garment}, panel {failure.panel}"
            attempt(lambda: self.recorder.mark(spot, failure.outward, caption))
        self.warnings += faults
        found = self._report(status, reason, whole, garments)
        report.write(self.output, found | ({"failure": failure.report()} if failure else {}))
        return failure

    def _report(self, status: str, reason: str, whole: Inspection, garments: list[Inspection]) -> dict:
        simulation, setup = self.simulation, self.simulation.setup
        parts = {seen.name: report.quality(seen) for seen in garments}
        positions = simulation.stepper.x.to_numpy()
        for garment in setup.garments:
            parts[garment.name]["fit_mm"] = fit_lines(setup, garment, positions, simulation.transforms)
        p, steps = simulation.progress, self.step_seconds or [0.0]
        return {
            "scene": setup.scene.scene,
            "status": status,
            "reason": reason,
            "versions": report.versions(),
            "device": {**vars(self.device), "renderer": self.recorder.renderer_name},
            "mesh": report.mesh_figures(
                np.concatenate([garment.mesh.edge_lengths for garment in setup.garments]),
                setup.cloth.vertex_count,
                len(setup.cloth.triangles),
                min(garment.mesh.min_angle_deg for garment in setup.garments),
            ),
            "run": {
                "simulated_s": round(p.time, 6),
                "steps": p.steps,
                "rejected_steps": p.rejected,
                "newton_iterations": p.newton_iterations,
                "linear_iterations": p.linear_iterations,
                "step_ms": {name: round(1000 * pick(steps), 3) for name, pick in _PICKS.items()},
            },
            "timing_s": self.clock.timings(),
            "quality": report.quality(whole),
            "garments": parts,
            "holds": {
                name: {"reaction_N": [float(f"{value:.6g}") for value in force]}
                for name, force in simulation.reactions().items()
            },
            "skipped": skipped(setup, simulation),
            "warnings": self.warnings,
        }


_PICKS = {"min": min, "mean": lambda values: sum(values) / len(values), "max": max}


def limit_is_off(scene: SceneSpec) -> bool:
    """Whether the scene asks for no settling at all."""
    return scene.settle.max_steps == 0


class Stop:
    """Ctrl-C and SIGTERM. Before ``gently`` they end what is going on; afterwards they are ``asked`` for, so that the
    present step and everything written can be finished."""

    def __init__(self) -> None:
        self.gently = self.asked = False

    def __call__(self, *_) -> None:
        if not self.gently:
            raise KeyboardInterrupt
        self.asked = True


@contextmanager
def stop_by_signal() -> Iterator[Stop]:
    """Catch SIGINT and SIGTERM; in the main thread only, as others get no signals."""
    stop, before = Stop(), {}
    if threading.current_thread() is threading.main_thread():
        before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _LogFile(logging.FileHandler):
    def handleError(self, record: logging.LogRecord) -> None:
        """A disk that refuses the log refuses more: the run ends by that, without tracebacks from here."""


@contextmanager
def log_to(path: Path) -> Iterator[None]:
    """``log.txt`` in the output folder takes what the run has to say, and keeps other runs out."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        handler = _LogFile(path / folder.LOG, mode="a")
    except OSError as fault:
        raise RunError(f"{path}: cannot be written: {fault.strerror}; choose another folder with --output") from fault
    try:
        folder.lock(handler.stream, path)
    except InputError:
        handler.close()
        raise
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    logger = logging.getLogger("taichi_tryon")
    logger.setLevel(logging.INFO)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        handler.close()
