"""A square sheared in a frame of four hinged bars.

The bars keep the length of the fibres that run along them, so the only strain is the KES shear angle 2 E12 = sin g at
the frame angle 90 degrees - g. Reference: the law; the energy A G sin^2 g / 2 gives the frame the moment A G sin g
cos g. It is measured as the work of all holds' forces on the motion x = X + Y sin g, y = Y cos g for a change of g.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.bench.record import Record, relative
from taichi_tryon.bench.simulate import simulate
from taichi_tryon.fabric import Moduli

SIDE, ANGLE = 0.10, np.radians(10.0)
LIMIT = 0.5


def records(quick: bool) -> Iterator[Record]:
    """The moment of the frame."""
    done = simulate("picture_frame")
    mesh, held = done.setup.garments[0].mesh, ~done.setup.holds.free
    y = np.zeros(mesh.vertex_count)
    y[mesh.point_vertex] = mesh.pattern_points[:, 1]
    motion = np.column_stack([y * np.cos(ANGLE), -y * np.sin(ANGLE), np.zeros_like(y)])
    moment = -(done.simulation.stepper.pulls() * held * motion).sum()
    rigidity = Moduli.from_spec(done.setup.scene.garments[0].fabric).stretch[3]
    exact = SIDE**2 * rigidity * np.sin(ANGLE) * np.cos(ANGLE)
    yield relative("picture_frame", {"angle_degree": 10}, "moment", "N m", moment, exact, LIMIT, done.wall_s)
