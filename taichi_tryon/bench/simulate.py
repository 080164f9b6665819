"""A validation scene from file to worn shape, as ``run`` does it, without output."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taichi_tryon.errors import InputError, RunError
from taichi_tryon.scene.load import load_scene
from taichi_tryon.setup import Setup, prepare
from taichi_tryon.simulation import Simulation
from taichi_tryon.timing import Stopwatch

FOLDER = Path("configs/validation")


@dataclass(frozen=True)
class Outcome:
    """A simulation at its end, and the wall time [s] that it took with all that belongs to it."""

    simulation: Simulation
    wall_s: float

    @property
    def setup(self) -> Setup:
        return self.simulation.setup

    @property
    def positions(self) -> np.ndarray:
        """(nv, 3) [m]."""
        return self.simulation.stepper.x.to_numpy()

    @property
    def velocities(self) -> np.ndarray:
        """(nv, 3) [m/s]."""
        return self.simulation.stepper.v.to_numpy()

    @property
    def contact_forces(self) -> np.ndarray:
        """(k, 3) [N] force of the body on each contact sample that touches it, at rest where the cloth is."""
        self.simulation.stepper.balance()
        contact = self.simulation.stepper.contact
        return contact.load.to_numpy()[contact.depth.to_numpy() > 0]

    def edge(self, name: str, garment: int = 0) -> np.ndarray:
        """Vertices along an edge of a plain sheet."""
        return self.setup.garments[garment].mesh.edge_vertices("sheet", name)


def scene_path(name: str) -> Path:
    """A file of ``configs/validation``. Raises InputError where it is not below the working folder."""
    path = FOLDER / name
    if not path.is_file():
        raise InputError(f"{path}: no such file; start bench in the project's folder")
    return path


def simulate(name: str, *overrides: str, watch: Callable[[Simulation], None] = lambda running: None) -> Outcome:
    """Run ``configs/validation/NAME.yaml`` with values set as by ``--set``; ``watch`` sees it after every step.

    Taichi runs already, in the precision that is wanted. Raises RunError where a step fails or the end is no
    equilibrium though the scene asks for one.
    """
    begin = time.perf_counter()
    scene = load_scene(scene_path(f"{name}.yaml"), overrides)
    clock = Stopwatch()
    simulation = Simulation(prepare(scene, clock), clock)
    watch(simulation)
    while not simulation.finished:
        simulation.advance()
        watch(simulation)
    if scene.settle.max_steps and not simulation.settled:
        raise RunError(
            f"{name}: not settled after {scene.settle.max_steps} steps: net force {simulation.progress.residual:.1e} "
            f"of the weight, limit {scene.settle.residual:g}"
        )
    return Outcome(simulation, time.perf_counter() - begin)
