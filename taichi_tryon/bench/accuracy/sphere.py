"""A sheet lies at rest on a ball: the forces of contact and friction add up to its weight.

Reference: global equilibrium. Pressure on the samples of an unstructured mesh and friction along the slopes take part.
The pressure that is mapped onto the ball's surface pushes it down as the garment's pushes the garment up.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.bench.record import Record, absolute, relative
from taichi_tryon.bench.simulate import simulate
from taichi_tryon.observe import Observer
from taichi_tryon.output.imprint import surface_vectors

LIMIT, MAPPED_LIMIT = 0.5, 2.0


def records(quick: bool) -> Iterator[Record]:
    """The upward part of the force, what is left sideways, and the pressure on the body against that on the cloth."""
    done = simulate("sphere")
    force = done.contact_forces.sum(axis=0)
    weight = done.setup.cloth.masses.sum() * np.linalg.norm(done.setup.scene.gravity_m_s2)
    yield relative("sphere", {}, "force_up", "N", force[1], weight, LIMIT, done.wall_s)
    sideways = 100 * np.linalg.norm(force[[0, 2]]) / weight
    yield absolute("sphere", {}, "force_sideways", "% of weight", sideways, 0.0, LIMIT, done.wall_s)
    observer = Observer(done.simulation)
    seen, _ = observer.inspect()
    on_body = seen.skin_pressures @ surface_vectors(*observer.skin())[1]
    yield relative(
        "sphere", {}, "pressure_up_on_body", "N", on_body[1], seen.normal_force[1], MAPPED_LIMIT, done.wall_s
    )
