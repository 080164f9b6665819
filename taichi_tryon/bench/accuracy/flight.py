"""A sheet flies and tumbles in empty space for half a second: linear and angular momentum stay, and its energy.

Reference: no force from outside acts, and nothing within dissipates. The momenta are those that ``solver.momentum``
keeps; the energy, of motion and of strain, tells how well the scheme does by itself. The sheet starts without strain,
so that it shakes a little until the spin has stretched it: what a scheme damps of that is gone for good.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.bench.energy import mechanical
from taichi_tryon.bench.record import Record, absolute, relative
from taichi_tryon.bench.simulate import simulate
from taichi_tryon.simulation import Simulation

LIMIT = 1e-6
# of the energy [%]; backward Euler is not judged: it damps
DRIFT = {"tr_bdf2": 1.0}


def records(quick: bool) -> Iterator[Record]:
    """The relative change of both momenta and of the energy."""
    for scheme in ("tr_bdf2",) if quick else ("tr_bdf2", "backward_euler"):
        start: list[float] = []

        def watch(running: Simulation, start: list[float] = start) -> None:
            if not start:
                start.append(mechanical(running.stepper))

        done = simulate("flight", f"solver.scheme={scheme}", watch=watch)
        masses, where = done.setup.cloth.masses, {"scheme": scheme}
        before = momenta(masses, done.setup.positions, done.setup.velocities)
        after = momenta(masses, done.positions, done.velocities)
        for name, one, other in zip(("linear_momentum", "angular_momentum"), before, after, strict=True):
            change = np.linalg.norm(other - one) / np.linalg.norm(one)
            yield absolute("flight", where, f"{name}_change", "relative", change, 0.0, LIMIT, done.wall_s)
        yield relative("flight", where, "energy", "J", mechanical(done.simulation.stepper), start[0], DRIFT.get(scheme),
                       done.wall_s)  # fmt: skip


def momenta(masses: np.ndarray, positions: np.ndarray, velocities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear (3,) [kg m/s] and, about the centre of mass, angular (3,) [kg m^2/s] momentum."""
    arms = positions - masses @ positions / masses.sum()
    return masses @ velocities, masses @ np.cross(arms, velocities)
