"""Gap between points and bodies whose skin is known exactly.

A ball of weight 8 alone has its skin at sqrt(1/2) of its radii (8 (1 - s)^3 = 1 at s = 1/2): sphere, cylinder and
ellipsoid. Points are put at known distances of up to 5 mm along the skin's normals, inside and outside: that is their
exact gap.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import taichi as ti

from taichi_tryon.bench.record import Record, absolute
from taichi_tryon.bench.simulate import scene_path
from taichi_tryon.body.field import BodyField
from taichi_tryon.body.model import Body
from taichi_tryon.body.spec import BodySpec
from taichi_tryon.contact.probe import Probe
from taichi_tryon.scene.load import load_part

HALF_AXES = {"sphere": (0.1, 0.1, 0.1), "cylinder": (0.05, 0.05, np.inf), "ellipsoid": (0.08, 0.12, 0.05)}
BAND, POINTS = 5e-3, 4000
LIMIT_MM = 0.1


def records(quick: bool) -> Iterator[Record]:
    """The greatest error of the gap."""
    for name, half_axes in HALF_AXES.items():
        begin = time.perf_counter()
        body = Body.from_spec(load_part(scene_path(f"bodies/{name}.yaml"), BodySpec))
        points, exact = around(np.array(half_axes))
        error = np.abs(gaps(body, points) - exact).max()
        wall = time.perf_counter() - begin
        yield absolute("body_field", {"body": name}, "gap_error", "mm", 1e3 * error, 0.0, LIMIT_MM, wall)


def around(half_axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) [m] around an ellipsoid, and their distances (n,) [m] from it, negative inside."""
    rng = np.random.default_rng(0)
    direction = rng.normal(size=(POINTS, 3))
    unbounded = np.isinf(half_axes)
    direction[:, unbounded] = 0.0
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    skin = direction * np.where(unbounded, 0.0, half_axes)
    normal = direction / half_axes
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    distance = rng.uniform(-BAND, BAND, POINTS)
    along = np.where(unbounded, rng.uniform(-0.1, 0.1, (POINTS, 3)), 0.0)
    return skin + distance[:, None] * normal + along, distance


def gaps(body: Body, points: np.ndarray) -> np.ndarray:
    """The product's gaps (n,) [m] at points (n, 3) around a body in its rest pose."""
    field = BodyField(body)
    field.set_pose(np.tile(np.eye(4), (len(body.skeleton.names), 1, 1)))
    x = ti.Vector.field(3, float, shape=len(points))
    x.from_numpy(points)
    return Probe(np.zeros((1, 3), int), field, x).gaps()
