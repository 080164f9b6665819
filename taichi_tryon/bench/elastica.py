"""The heavy elastica: the exact shape of an inextensible strip that bends under its own weight.

With lengths in L and forces in B / L^2, theta'' = p sin theta - (q + Gamma s) cos theta, theta the angle above the
level and (p, q + Gamma s) the force across a section, with Gamma = w L^3 / B; w weight per area, B bending rigidity.
A cantilever, clamped level at s = 0 and free at s = 1, has p = 0, q = -Gamma; with theta below the level instead
theta'' + Gamma (1 - s) cos theta = 0, theta(0) = 0, theta'(1) = 0.
Source: Bickley 1934, "The heavy elastica", Philosophical Magazine 17; solved here as a boundary-value problem.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_bvp
from scipy.optimize import brentq

from taichi_tryon.errors import RunError


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


def bow(gamma: float, start_degree: float, gap: float, steps: int = 20) -> tuple[np.ndarray, float]:
    """A strip between two clamps side by side: points (n, 2) in its lengths, and p, the level force on its second end.

    It leaves the first clamp, at the origin, in the direction ``start_degree`` above the level, turns by 180 degrees to
    its left, and comes back to the second, ``gap`` away to the left of the first. Found from a half circle without
    weight by bringing gap and weight there together.
    Raises RunError where no such shape is found.
    """
    start = np.radians(start_degree)
    s = np.linspace(0, 1, 401)
    theta, side = start + np.pi * s, np.array([-np.sin(start), np.cos(start)])
    shape = np.array([theta, np.full_like(s, np.pi), *_circle(start, s)])
    force = np.zeros(2)
    for share in np.linspace(0, 1, steps + 1):
        load, end = share * gamma, ((1 - share) * 2 / np.pi + share * gap) * side
        found = solve_bvp(
            lambda s, y, f, load=load: np.array(
                [y[1], f[0] * np.sin(y[0]) - (f[1] + load * s) * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])]
            ),
            lambda a, b, f, end=end: np.array(
                [a[0] - start, a[2], a[3], b[0] - start - np.pi, b[2] - end[0], b[3] - end[1]]
            ),
            s, shape, p=force, tol=1e-8, max_nodes=100_000,
        )  # fmt: skip
        if not found.success:
            raise RunError(f"no elastica found at Gamma = {load:g}: {found.message}")
        s, shape, force = found.x, found.y, found.p
    return found.sol(np.linspace(0, 1, 2001))[2:].T, float(force[0])


def _circle(start: float, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Half a circle of length one."""
    theta = start + np.pi * s
    return (np.sin(theta) - np.sin(start)) / np.pi, (np.cos(start) - np.cos(theta)) / np.pi
