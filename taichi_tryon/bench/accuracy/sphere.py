"""A sheet lies at rest on a ball: the forces of contact and friction add up to its weight.

Reference: global equilibrium. Pressure on the samples of an unstructured mesh and friction along the slopes take part.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.bench.record import Record, absolute, relative
from taichi_tryon.bench.simulate import simulate

LIMIT = 0.5


def records(quick: bool) -> Iterator[Record]:
    """The upward part of the force, and what is left sideways."""
    done = simulate("sphere")
    force = done.contact_forces.sum(axis=0)
    weight = done.setup.cloth.masses.sum() * np.linalg.norm(done.setup.scene.gravity_m_s2)
    yield relative("sphere", {}, "force_up", "N", force[1], weight, LIMIT, done.wall_s)
    sideways = 100 * np.linalg.norm(force[[0, 2]]) / weight
    yield absolute("sphere", {}, "force_sideways", "% of weight", sideways, 0.0, LIMIT, done.wall_s)
