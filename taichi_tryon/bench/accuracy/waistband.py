"""A waistband with two elastics presses as their stretch asks for: p = T / (R w), T the sum of all tensions round it.

Reference: Laplace's law for one curvature, over the width w. T is the elastics' pull, stiffness times stretch (given as
so many newtons at so many per cent), at the mean radius R found, and that of the cloth between them,
C11 w a (a^2 - 1) / 2 (St. Venant-Kirchhoff, C12 = 0). The body's surface feels what the garment does: pressure times
area adds up to the same on both.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.bench.record import Record, absolute, relative
from taichi_tryon.bench.simulate import simulate
from taichi_tryon.fabric import Moduli
from taichi_tryon.observe import Observer
from taichi_tryon.units import CM

PRESSURE_LIMIT, BALANCE_LIMIT = 2.0, 0.5


def records(quick: bool) -> Iterator[Record]:
    """Mean pressure under the band; its sum on the body over that on the garment; what is left of all forces."""
    done = simulate("waistband")
    garment = done.setup.scene.garments[0]
    width, height = np.array(garment.sheet.size_cm) * CM
    radius = np.hypot(*done.positions[:, :2].T).mean()
    around = 2 * np.pi * radius
    elastics = sum(band.build().stiffness * (around / (band.length_cm * CM) - 1) for band in garment.bands)
    stretch = around / width
    cloth = Moduli.from_spec(garment.fabric).stretch[0] * height * stretch * (stretch**2 - 1) / 2
    seen, _ = Observer(done.simulation).inspect()
    size = seen.contact_pressures @ seen.contact_areas
    exact = (elastics + cloth) / (radius * height)
    pressure = size / (around * height)
    yield relative("waistband", {}, "pressure", "Pa", pressure, exact, PRESSURE_LIMIT, done.wall_s)
    on_body = seen.skin_pressures @ seen.skin_areas
    yield relative("waistband", {}, "force_on_body", "N", on_body, size, BALANCE_LIMIT, done.wall_s)
    balance = 100 * np.linalg.norm(seen.normal_force) / size
    yield absolute("waistband", {}, "net_force", "% of all", balance, 0.0, BALANCE_LIMIT, done.wall_s)
