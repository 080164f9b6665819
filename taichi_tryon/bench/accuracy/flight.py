"""A sheet flies and tumbles in empty space for half a second: linear and angular momentum stay.

Reference: no force from outside acts. Backward Euler keeps linear momentum to the tolerance of Newton's method, but not
angular momentum: it loses dt sum of m v_n+1 x (v_n+1 - v_n) every step, even solved exactly.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.bench.record import Record, absolute
from taichi_tryon.bench.simulate import simulate

LIMIT = 1e-6


def records(quick: bool) -> Iterator[Record]:
    """The relative change of both momenta."""
    done = simulate("flight")
    masses = done.setup.cloth.masses
    before = momenta(masses, done.setup.positions, done.setup.velocities)
    after = momenta(masses, done.positions, done.velocities)
    for name, one, other in zip(("linear_momentum", "angular_momentum"), before, after, strict=True):
        change = np.linalg.norm(other - one) / np.linalg.norm(one)
        yield absolute("flight", {}, f"{name}_change", "relative", change, 0.0, LIMIT, done.wall_s)


def momenta(masses: np.ndarray, positions: np.ndarray, velocities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear (3,) [kg m/s] and, about the centre of mass, angular (3,) [kg m^2/s] momentum."""
    arms = positions - masses @ positions / masses.sum()
    return masses @ velocities, masses @ np.cross(arms, velocities)
