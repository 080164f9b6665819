"""A strip pulled along its length, cut along the warp, along the weft and at 45 degrees.

Its ends are led along x and free to slide along y, so that stress and strain are uniform: x = a X, y = s X + b Y with
the stretch a given. Reference: St. Venant-Kirchhoff's law itself. s and b follow from the two conditions that the sides
bear no force (P22 = P21 = 0 of the first Piola-Kirchhoff stress P = F S); the force is P11 times the width. At 45
degrees and small strains this is Young's modulus 1 / (sum of the compliances / 4) = 291 N/m of the Table 1 fabric.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.optimize import fsolve

from taichi_tryon.bench.record import Record, relative
from taichi_tryon.bench.simulate import simulate
from taichi_tryon.fabric import Moduli

LENGTH, WIDTH, STRETCH = 0.10, 0.05, 1.01
LIMIT = 0.5
DIRECTIONS = {"warp": 0.0, "weft": 90.0, "bias": 45.0}


def records(quick: bool) -> Iterator[Record]:
    """The pulling force for each direction of the grain."""
    for name, degrees in DIRECTIONS.items():
        done = simulate("uniaxial", f"garments.0.sheet.grain_degree={degrees}")
        moduli = Moduli.from_spec(done.setup.scene.garments[0].fabric)
        force = done.simulation.reactions()["right"][0]
        exact = stress(moduli.stretch, np.radians(degrees)) * WIDTH
        yield relative("uniaxial", {"cut": name}, "force", "N", force, exact, LIMIT, done.wall_s)


def stress(stretch: np.ndarray, grain: float) -> float:
    """P11 [N/m] of the uniform state; ``stretch``: C11, C22, C12, C66 [N/m], ``grain`` [rad]: from pull to warp."""
    c11, c22, c12, c66 = stretch
    turn = np.array([[np.cos(grain), -np.sin(grain)], [np.sin(grain), np.cos(grain)]])

    def piola(s: float, b: float) -> np.ndarray:
        f = np.array([[STRETCH, 0.0], [s, b]])
        e = turn.T @ ((f.T @ f - np.eye(2)) / 2) @ turn
        shear = 2 * c66 * e[0, 1]
        local = np.array([[c11 * e[0, 0] + c12 * e[1, 1], shear], [shear, c12 * e[0, 0] + c22 * e[1, 1]]])
        return f @ turn @ local @ turn.T

    s, b = fsolve(lambda sides: piola(*sides)[1], [0.0, 1.0], xtol=1e-12)
    return float(piola(s, b)[0, 0])
