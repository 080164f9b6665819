"""A strip is pulled over a cylinder: the capstan.

Reference: where all of it slips, a strip that bends at n edges by d = a / n each has at every edge T2 / T1 = (1 + mu
tan(d/2)) / (1 - mu tan(d/2)), the balance of two tensions, the normal force along their bisector, and friction; n of
them tend to e^(mu a) (Euler 1769, Eytelwein 1808). The number of edges is that of the mesh within the angle a.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.bench.record import Record, relative
from taichi_tryon.bench.simulate import simulate
from taichi_tryon.units import MM

RADIUS, FRICTION = 0.05, 0.3
LIMIT = 1.0
SCENES = {180: "capstan", 90: "capstan_quarter"}


def records(quick: bool) -> Iterator[Record]:
    """The ratio of the tensions at both ends, half and a quarter round; it takes too long to be ``quick``."""
    if quick:
        return
    for degrees, scene in SCENES.items():
        done = simulate(scene)
        tensions = {name: np.linalg.norm(force) for name, force in done.simulation.reactions().items()}
        ratio = tensions["right"] / tensions["left"]
        bends = round(np.radians(degrees) * RADIUS / (done.setup.scene.mesh.edge_length_mm * MM))
        exact = polygon(np.radians(degrees), bends)
        where = {"angle_degree": degrees, "bends": bends}
        yield relative("capstan", where, "tension_ratio", "1", ratio, exact, LIMIT, done.wall_s)


def polygon(angle: float, bends: int) -> float:
    """T2 / T1 over so many equal bends."""
    step = FRICTION * np.tan(angle / bends / 2)
    return float(((1 + step) / (1 - step)) ** bends)
