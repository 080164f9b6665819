"""A deep strip, clamped at one end with its width upright, is about to turn aside under its own weight.

Reference: Michell 1899, Prandtl 1899; Timoshenko and Gere 1961, "Theory of elastic stability", 6.3: with bending EI
aside and torsion GJ, w_c = 12.8538 sqrt(EI GJ) / L^3 for a narrow strip. Of a sheet b wide EI = D11 b, GJ = 4 D66 b
(Kirchhoff's plate, D12 = 0). A clamp also keeps its end from warping, with D11 b^3 / 12 (Vlasov 1961, "Thin-walled
elastic beams"); for b = L / 20 that raises w_c by 4.5 %, more than the limit, so it is part of the reference. Under a
sideways share e of the weight the angle f of twist plus e is proportional to g with

    c^2 g'''' = g'' + k^2 (1 - s)^4 g,    g'(0) = g''(1) = 0, g'(1) = c^2 g'''(1), g(1) = 1,

k = w L^3 / (2 sqrt(EI GJ)), c^2 = D11 b^2 / (48 D66 L^2), s from the clamp in L; k is critical where g(0) = 0. Below
it g(0) = e / (f(L) + e): the twist of the end gives k, and with it the equivalent critical load.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.optimize import brentq

from taichi_tryon.bench.record import Record, relative
from taichi_tryon.bench.simulate import scene_path, simulate
from taichi_tryon.fabric import Moduli
from taichi_tryon.scene.load import load_scene

LENGTH, WIDTH = 0.20, 0.01
SHARE, SIDEWAYS = 0.8, 5e-3
"""Load of the strip in critical ones, and the part of it that pulls sideways."""
EDGES_MM = (5.0, 2.5)
HIGHEST = 9.0
ELEMENTS = 50
GAUSS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(4)
LIMIT = 3.0


def records(quick: bool) -> Iterator[Record]:
    """The critical weight per length; it takes too long to be ``quick``."""
    if quick:
        return
    moduli = Moduli.from_spec(load_scene(scene_path("lateral_buckling.yaml")).garments[0].fabric)
    d11, _, _, d66 = moduli.bend
    warping = WIDTH / LENGTH * np.sqrt(d11 / (48 * d66))
    critical = load_of(0.0, warping)
    exact = 2 * critical * WIDTH * np.sqrt(4 * d11 * d66) / LENGTH**3
    for edge in EDGES_MM:
        value, seconds = critical_weight(exact, moduli.mass, critical, warping, edge)
        where = {"edge_mm": edge}
        yield relative("lateral_buckling", where, "critical_weight", "mN/m", 1e3 * value, 1e3 * exact, LIMIT, seconds)


def critical_weight(exact: float, mass: float, critical: float, warping: float, edge_mm: float) -> tuple[float, float]:
    """The equivalent one [N/m] of a fabric of that mass [kg/m^2], and the wall time [s]; ``exact`` [N/m]."""
    gravity = SHARE * exact / (mass * WIDTH)
    done = simulate(
        "lateral_buckling", f"mesh.edge_length_mm={edge_mm}", f"gravity_m_s2=[0, {-gravity}, {SIDEWAYS * gravity}]"
    )
    x = done.positions[done.edge("right")]
    _, y, z = x[x[:, 1].argmax()] - x[x[:, 1].argmin()]
    left = SIDEWAYS / (SIDEWAYS + abs(np.arctan2(z, y)))
    return SHARE * exact * critical / load_of(left, warping), done.wall_s


def left_of(load: float, warping: float) -> float:
    """g(0) at k = ``load`` and c = ``warping``, by the finite elements of a beam."""
    n = ELEMENTS
    h = 1 / n
    stiffness = np.zeros((2 * n + 2, 2 * n + 2))
    for element in range(n):
        for p, share in zip((GAUSS + 1) / 2, GAUSS_WEIGHTS / 2, strict=True):
            value = np.array(
                [1 - 3 * p**2 + 2 * p**3, h * (p - 2 * p**2 + p**3), 3 * p**2 - 2 * p**3, h * (p**3 - p**2)]
            )
            slope = (
                np.array([6 * p**2 - 6 * p, h * (1 - 4 * p + 3 * p**2), 6 * p - 6 * p**2, h * (3 * p**2 - 2 * p)]) / h
            )
            bend = np.array([12 * p - 6, h * (6 * p - 4), 6 - 12 * p, h * (6 * p - 2)]) / h**2
            pull = load**2 * (1 - (element + p) * h) ** 4
            rows = slice(2 * element, 2 * element + 4)
            stiffness[rows, rows] += (
                share * h * (np.outer(slope, slope) + warping**2 * np.outer(bend, bend) - pull * np.outer(value, value))
            )
    return float(1 / np.linalg.solve(stiffness[2:, 2:], -stiffness[2:, 0])[-2])


def load_of(left: float, warping: float) -> float:
    """The k up to the critical one at which g(0) is ``left``."""
    return brentq(lambda load: left_of(load, warping) - left, 0.1, HIGHEST, xtol=1e-9)
