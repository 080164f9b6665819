"""The heavy elastica: the exact shape of an inextensible strip that bends under its own weight.

Clamped level at s = 0 and free at s = 1 (lengths in L), the angle theta below the level obeys theta'' + Gamma (1 - s)
cos theta = 0, theta(0) = 0, theta'(1) = 0, with Gamma = w L^3 / B; w weight per area, B bending rigidity.
Source: Bickley 1934, "The heavy elastica", Philosophical Magazine 17; solved here as a boundary-value problem.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_bvp
from scipy.optimize import brentq


def tip(gamma: float) -> tuple[float, float]:
    """Drop and reach of the free end, in lengths of the strip."""
    s, shape = np.linspace(0, 1, 201), np.zeros((4, 201))
    for load in np.linspace(0, gamma, 2 + int(gamma // 5))[1:]:
        found = solve_bvp(
            lambda s, y, load=load: np.array([y[1], -load * (1 - s) * np.cos(y[0]), np.sin(y[0]), np.cos(y[0])]),
            lambda a, b: np.array([a[0], b[1], a[2], a[3]]),
            s, shape, tol=1e-9, max_nodes=100_000,
        )  # fmt: skip
        s, shape = found.x, found.y
    return float(shape[2, -1]), float(shape[3, -1])


def load_of(drop: float, reach: float) -> float:
    """The Gamma whose free end lies in this direction; only the ratio counts, as stretch hardly changes it."""

    def excess(gamma: float) -> float:
        y, x = tip(gamma)
        return y / x - drop / reach

    return brentq(excess, 0.05, 60.0, rtol=1e-8)
