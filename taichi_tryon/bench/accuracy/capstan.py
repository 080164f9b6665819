"""A strip is pulled over a cylinder: the capstan.

Reference: where all of it slips, a strip that bends at n edges by d = 180 degrees / n each has at every edge T2 / T1 =
(1 + mu tan(d/2)) / (1 - mu tan(d/2)), the balance of two tensions, the normal force along their bisector, and friction;
n of them tend to e^(mu pi) (Euler 1769, Eytelwein 1808). The number of edges is that of the mesh within the half turn.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.bench.record import Record, relative
from taichi_tryon.bench.simulate import simulate
from taichi_tryon.units import MM

RADIUS, FRICTION = 0.05, 0.3
LIMIT = 1.0


def records(quick: bool) -> Iterator[Record]:
    """The ratio of the tensions at both ends; it takes too long to be ``quick``."""
    if quick:
        return
    done = simulate("capstan")
    tensions = {name: -force[1] for name, force in done.simulation.reactions().items()}
    ratio = tensions["right"] / tensions["left"]
    bends = round(np.pi * RADIUS / (done.setup.scene.mesh.edge_length_mm * MM))
    exact = polygon(np.pi, bends)
    yield relative("capstan", {"angle_degree": 180, "bends": bends}, "tension_ratio", "1", ratio, exact, LIMIT,
                   done.wall_s)  # fmt: skip


def polygon(angle: float, bends: int) -> float:
    """T2 / T1 over so many equal bends."""
    step = FRICTION * np.tan(angle / bends / 2)
    return float(((1 + step) / (1 - step)) ** bends)
