"""Some steps of a scene, in a process of its own, and what they cost."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import taichi as ti

from taichi_tryon import runtime
from taichi_tryon.errors import InputError
from taichi_tryon.scene.load import load_scene
from taichi_tryon.setup import prepare
from taichi_tryon.simulation import Simulation
from taichi_tryon.timing import Stopwatch

FOLDER = Path("configs")


@dataclass(frozen=True)
class Course:
    """Where the cloth is after ``steps``: positions (nv, 3) [m]; and what it cost.

    seconds: wall time a step by stage, "step" being all of it. compile_s: from Taichi's start to the first step without
    mesh and dressing; kernels: how many Taichi had to make for all of it. linear_iterations: of all steps. looks: at
    the body by samples of the cloth, of ``chances``; balls: listed now, of all.
    """

    positions: np.ndarray
    steps: int
    seconds: dict[str, float]
    compile_s: float
    kernels: int
    linear_iterations: int
    looks: int
    chances: int
    balls: tuple[int, int]


def run(scene: str, overrides: tuple[str, ...], before: int, steps: int, cold: bool = False) -> Course:
    """Start Taichi, and go ``steps`` steps of ``configs/SCENE`` after some ``before``, fewer where it ends; with values
    set as by ``--set``. cold: kernels compiled earlier are not used.

    Raises InputError where there is no such scene below the working folder, RunError where a step fails.
    """
    path = FOLDER / scene
    if not path.is_file():
        raise InputError(f"{path}: no such file; start bench in the project's folder")
    spec = load_scene(path, overrides)
    begin = time.perf_counter()
    runtime.start("cpu", spec.solver.precision, spec.solver.threads, offline_cache=not cold)
    return _measured(spec, begin, before, steps)


def _measured(spec, begin: float, before: int, steps: int) -> Course:
    clock = Stopwatch()
    simulation = Simulation(prepare(spec, clock), clock)
    compile_s = time.perf_counter() - begin - clock.seconds["mesh"] - clock.seconds["dressing"]
    _advance(simulation, before)
    stages, begin = dict(clock.seconds), time.perf_counter()
    done = _advance(simulation, steps)
    seconds = {"step": time.perf_counter() - begin}
    seconds |= {name: clock.seconds[name] - stages.get(name, 0.0) for name in ("body", "contact", "solve")}
    contact, field = simulation.stepper.contact, simulation.field
    return Course(
        simulation.stepper.x.to_numpy(),
        done,
        {name: value / max(done, 1) for name, value in seconds.items()},
        compile_s,
        sum(len(kernel.compiled_kernels) for kernel in ti.lang.impl.get_runtime().kernels),
        simulation.progress.linear_iterations,
        int(contact.looked.to_numpy().sum()),
        contact.evaluations * contact.count,
        (int(field.near.sum()), field.count) if spec.body else (0, 0),
    )


def _advance(simulation: Simulation, steps: int) -> int:
    """Go so many steps, fewer where the simulation ends; how many were gone."""
    for done in range(steps):
        if simulation.finished:
            return done
        simulation.advance()
    return steps
