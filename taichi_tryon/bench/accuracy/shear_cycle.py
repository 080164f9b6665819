"""A square of a fabric that rubs, sheared back and forth in the frame of ``picture_frame``, as KES does it.

At the angle 0 elasticity is silent, and what the frame bears is friction: half the loop's width 2HG. Reference: its
definition; friction's work A HG d(sin g) gives the frame the moment A HG cos g, against the way it came. It is measured
as the work of all holds' forces on the motion x = X + Y g. The width is the mean one of shirting.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon import units
from taichi_tryon.bench.record import Record, relative
from taichi_tryon.bench.simulate import simulate

SIDE, WIDTH = 0.10, 1.0
LIMIT = 0.5


def records(quick: bool) -> Iterator[Record]:
    """The width of the loop that the moment of the frame says."""
    done = simulate("shear_cycle", f"garments.0.fabric.shear_hysteresis_gf_per_cm={WIDTH}")
    mesh, held = done.setup.garments[0].mesh, ~done.setup.holds.free
    y = np.zeros(mesh.vertex_count)
    y[mesh.point_vertex] = mesh.pattern_points[:, 1]
    motion = np.column_stack([y, np.zeros_like(y), np.zeros_like(y)])
    moment = -(done.simulation.stepper.pulls() * held * motion).sum()
    width = 2 * moment / SIDE**2 / units.GF_PER_CM
    yield relative("shear_cycle", {"angle_degree": 8}, "2HG", "gf/cm", width, WIDTH, LIMIT, done.wall_s)
