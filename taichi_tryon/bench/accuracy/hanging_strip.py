"""A strip of 1 m hangs by its upper edge.

Reference: the law. The tension at the height X above the lower end carries the weight w X below; C11 a (a^2 - 1) / 2 =
w X gives the stretch a(X) [St. Venant-Kirchhoff; to first order the extension is w L^2 / 2 C11].
"""

from __future__ import annotations

from collections.abc import Iterator

from scipy.integrate import quad
from scipy.optimize import brentq

from taichi_tryon.bench.record import Record, relative
from taichi_tryon.bench.simulate import simulate
from taichi_tryon.fabric import Moduli

LENGTH = 1.0
LIMIT = 0.5


def records(quick: bool) -> Iterator[Record]:
    """How far the lower edge comes down, and the force on the upper one."""
    done = simulate("hanging_strip")
    scene = done.setup.scene
    moduli = Moduli.from_spec(scene.garments[0].fabric)
    weight = -moduli.mass * scene.gravity_m_s2[1]
    drop = -done.positions[done.edge("bottom"), 1].mean()
    exact = extension(moduli.stretch[0], weight)
    yield relative("hanging_strip", {}, "extension", "mm", 1e3 * drop, 1e3 * exact, LIMIT, done.wall_s)
    force, whole = done.simulation.reactions()["top"][1], weight * done.setup.cloth.areas.sum()
    yield relative("hanging_strip", {}, "force", "N", force, whole, LIMIT, done.wall_s)


def extension(rigidity: float, weight: float) -> float:
    """[m], of ``rigidity`` C11 [N/m] under ``weight`` [N/m^2]."""

    def strain(x: float) -> float:
        return brentq(lambda a: rigidity * a * (a * a - 1) / 2 - weight * x, 0.9, 2.0, xtol=1e-15) - 1

    return quad(strain, 0, LENGTH)[0]
