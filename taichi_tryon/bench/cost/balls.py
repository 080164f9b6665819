"""Time of asking the body for its gap, against the number of balls that fill the same volume.

A block of 0.4 m x 1.6 m x 0.4 m is filled with ever more, ever smaller balls; gaps are asked for within 5 mm of its
skin, where cloth asks. A query looks at the balls of its cell only. The limit is our own.
"""

import time
from collections.abc import Iterator

import numpy as np
import taichi as ti

from taichi_tryon import fields, runtime
from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.record import Record, absolute, told
from taichi_tryon.body.field import BodyField
from taichi_tryon.body.model import Body
from taichi_tryon.body.spec import BodySpec
from taichi_tryon.body.surface import surface_mesh
from taichi_tryon.units import CM

COUNTS = (25, 50, 100, 200, 400)
SIZE = np.array([0.4, 1.6, 0.4])
REACH, WEIGHT = 1.3, 4.0
"""Radius of the balls in their spacing, which lets them fuse, and their density."""
TIMES, POINTS, REPEATS = 1.5, 20_000, 10


def records(quick: bool) -> Iterator[Record]:
    """Time a query for every number of balls, and the greatest against the least number's."""
    times = {count: apart(measured, count) for count in (COUNTS[::4] if quick else COUNTS)}
    for count, seconds in times.items():
        yield told("balls", {"balls": count}, "query", "us", 1e6 * seconds, seconds)
    first, last = min(times), max(times)
    growth = times[last] / times[first]
    yield absolute("balls", {"from": first, "to": last}, "query_times", "1", growth, 0.0, TIMES, sum(times.values()))


def measured(count: int) -> float:
    """Start Taichi; seconds a query."""
    runtime.start("cpu")
    return query(filled(count))


def filled(count: int) -> Body:
    """The block filled with about so many balls: at most ``count``, on a grid as nearly cubic as can be."""
    shape = min(_shapes(count), key=lambda shape: (abs(np.prod(shape) - count), np.ptp(np.log(SIZE / shape))))
    centers = np.stack(np.meshgrid(*((np.arange(n) + 0.5) / n - 0.5 for n in shape), indexing="ij"), -1).reshape(-1, 3)
    radius = REACH * float((SIZE / shape).max()) / CM
    shared = {"radii_cm": [radius] * 3, "weight": WEIGHT, "groups": ["block"], "bones": {"root": 1.0}}
    balls = {f"ball_{k}": {"center_cm": (c * SIZE / CM).tolist(), **shared} for k, c in enumerate(centers)}
    bones = {"root": {"parent": None, "head_cm": [0.0, 0.0, 0.0]}}
    return Body.from_spec(BodySpec.model_validate({"name": "block", "bones": bones, "groups": ["block"], "balls": balls}))


def _shapes(count: int) -> list[np.ndarray]:
    """Grids of up to so many points whose spacings are nearest to each other."""
    found = []
    for across in range(1, count + 1):
        along = round(across * SIZE[1] / SIZE[0])
        for n in (along - 1, along, along + 1):
            for depth in (across, across + 1):
                if n > 0 and across * n * depth <= count:
                    found.append(np.array([across, n, depth]))
    return found


def query(body: Body, points: int = POINTS) -> float:
    """Seconds to ask a body for the gap of one point near its skin, the shortest of REPEATS runs over all points."""
    skin, _ = surface_mesh(body.posed(np.eye(4)[None]), 0.02)
    rng = np.random.default_rng(0)
    near = rng.choice(skin, points) + rng.uniform(-5e-3, 5e-3, (points, 3))
    field = BodyField(body)
    field.set_pose(np.eye(4)[None])
    tables = fields.Tables()
    at, gaps = tables.vectors(near), ti.field(float, shape=points)
    tables.fill()

    @ti.kernel
    def ask():
        for i in range(points):
            gap, _, _ = field.gap(at[i])
            gaps[i] = gap

    ask()
    times = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        ask()
        ti.sync()
        times.append(time.perf_counter() - begin)
    return min(times) / points
