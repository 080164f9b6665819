"""A tube too narrow for the cylinder that it is on presses with p = T / r.

Reference: equilibrium of a thin ring (Laplace's law for one curvature). r is the mean radius found; the tension T =
C11 a (a^2 - 1) / 2 (St. Venant-Kirchhoff, C12 = 0) follows from the stretch a = 2 pi r / width. The forces of contact
add up to nothing.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.bench.record import Record, absolute, relative
from taichi_tryon.bench.simulate import simulate
from taichi_tryon.fabric import Moduli
from taichi_tryon.units import CM

PRESSURE_LIMIT, BALANCE_LIMIT = 2.0, 0.5


def records(quick: bool) -> Iterator[Record]:
    """Mean pressure, and the sum of all contact forces over the sum of their sizes."""
    done = simulate("tube")
    garment = done.setup.scene.garments[0]
    width, height = np.array(garment.sheet.size_cm) * CM
    radius = np.hypot(*done.positions[:, :2].T).mean()
    stretch = 2 * np.pi * radius / width
    exact = Moduli.from_spec(garment.fabric).stretch[0] * stretch * (stretch**2 - 1) / 2 / radius
    forces = done.contact_forces
    size = np.linalg.norm(forces, axis=1).sum()
    pressure = size / (2 * np.pi * radius * height)
    yield relative("tube", {}, "pressure", "Pa", pressure, exact, PRESSURE_LIMIT, done.wall_s)
    balance = 100 * np.linalg.norm(forces.sum(axis=0)) / size
    yield absolute("tube", {}, "net_force", "% of all", balance, 0.0, BALANCE_LIMIT, done.wall_s)
