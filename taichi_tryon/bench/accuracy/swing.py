"""A hanging strip is pushed, as if it turned rigidly about its held edge, and swings as high as from 45 degrees.

Reference: our own solution with smaller steps, and the energy, of which nothing is lost within. The order of a scheme
is log2 of the change from halving the step over the change from halving it again, in the positions after half a second;
the energy's drift counts in what coming to rest would lose, which is the push.

The strip is a stiff pendulum: a hundred times as stiff along the warp as the fabric. The push is sudden, and with the
fabric's own stiffness it starts waves of stretch of 22 ms and 65 um, which no step above 2 ms follows: schemes damp
them the more the longer the step, and the order is seen only once they are resolved (Table 1 fabric: 1.2 from steps of
1/30, 1/60, 1/120 s, and 0.6 from half of them). A hundred times stiffer they are a hundred times smaller, and so below
the error of the swing.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from taichi_tryon.bench.energy import kinetic, mechanical
from taichi_tryon.bench.record import Record, absolute, at_least
from taichi_tryon.bench.simulate import Outcome, simulate
from taichi_tryon.errors import RunError
from taichi_tryon.simulation import Simulation

LENGTH = 0.5
# [gf/cm]
STIFF = 244_000
# the longest of three lengths of step [1/s]: where the orders have come out
COARSEST = {"tr_bdf2": 60, "backward_euler": 240}
LEAST_ORDER, DRIFT = {"tr_bdf2": 1.9, "backward_euler": 0.9}, 1.0
SHEET = ("garments.0.sheet.size_cm=[30, 50]", "mesh.edge_length_mm=30")


def records(quick: bool) -> Iterator[Record]:
    """Order of the schemes on a stiff strip; drift of the energy of the strip, and of a sheet of the fabric itself."""
    done = simulate("swing", f"garments.0.fabric.tensile_warp_gf_per_cm={STIFF}")
    start = pushed(done.simulation)
    for scheme in ("tr_bdf2",) if quick else ("tr_bdf2", "backward_euler"):
        begin = time.perf_counter()
        where = {"cloth": "stiff strip", "scheme": scheme}
        value = order(done, start, scheme)
        yield at_least("swing", where, "order", "1", value, LEAST_ORDER[scheme], time.perf_counter() - begin)
    yield _drift("stiff strip", done, start)
    if not quick:
        done = simulate("swing", *SHEET)
        yield _drift("sheet", done, pushed(done.simulation))


def pushed(simulation: Simulation) -> dict[str, np.ndarray]:
    """State in which what hangs below the height 0 turns about that line, fast enough to rise to 45 degrees: a rod's
    turn^2 = 3 g / L (1 - cos 45)."""
    state = simulation.stepper.state()
    gravity = np.linalg.norm(simulation.scene.gravity_m_s2)
    turn = np.sqrt(3 * gravity / LENGTH * (1 - np.sqrt(0.5)))
    velocities = np.zeros_like(state["positions"])
    velocities[:, 2] = -turn * state["positions"][:, 1]
    velocities[~simulation.setup.holds.free.any(axis=1)] = 0.0
    return {**state, "velocities": velocities, "acceleration_known": np.array(False)}


def swing(done: Outcome, start: dict[str, np.ndarray], scheme: str, per_second: int, duration: float) -> np.ndarray:
    """Positions (nv, 3) [m] after swinging for a ``duration`` [s]. Raises RunError where a step is not solved."""
    step = done.simulation.stepper
    step.settings = replace(step.settings, scheme=scheme)
    step.restore(start)
    for _ in range(round(duration * per_second)):
        result = step.step(1 / per_second)
        if not result.accepted or result.residual > step.settings.tolerance:
            raise RunError(f"swing: a step of 1/{per_second} s leaves a residual of {result.residual:.1e}")
    return step.x.to_numpy()


def order(done: Outcome, start: dict[str, np.ndarray], scheme: str) -> float:
    """Order of convergence seen in three lengths of step, each half of the one before."""
    masses = done.setup.cloth.masses
    ends = [swing(done, start, scheme, COARSEST[scheme] * 2**k, 0.5) for k in range(3)]
    coarse, fine = (
        np.sqrt(masses @ ((one - other) ** 2).sum(axis=1)) for one, other in zip(ends, ends[1:], strict=False)
    )
    return float(np.log2(coarse / fine))


def _drift(cloth: str, done: Outcome, start: dict[str, np.ndarray]) -> Record:
    begin = time.perf_counter()
    swing(done, start, "tr_bdf2", 120, 0.0)
    energy, push = mechanical(done.simulation.stepper), kinetic(done.simulation.stepper)
    swing(done, start, "tr_bdf2", 120, 1.0)
    lost = 100 * (mechanical(done.simulation.stepper) - energy) / push
    where = {"cloth": cloth, "scheme": "tr_bdf2", "step": "1/120 s"}
    return absolute("swing", where, "energy_drift", "% of push", lost, 0.0, DRIFT, time.perf_counter() - begin)
