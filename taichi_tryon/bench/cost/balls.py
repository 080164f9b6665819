"""Time of asking the body for its gap, against the number of balls that make up the same volume.

A block about four times as high as wide is made of ever more, ever smaller balls on a grid, each as large in its
spacing as the others; gaps are asked for within 5 mm of its skin, where cloth asks. A query looks at the balls of its
cell only. The limit is our own.
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
from taichi_tryon.kernel_loops import shared
from taichi_tryon.units import CM

GRIDS = ((2, 6, 2), (3, 6, 3), (3, 11, 3), (4, 12, 4), (5, 16, 5))
"""Balls along x, y, z: 24 to 400 of them."""
SIZE, VOLUME = np.array([0.4, 1.6, 0.4]), 0.256
REACH, WEIGHT = 1.3, 4.0
"""Radii of the balls in their spacing, which lets them fuse, and their density."""
TIMES, POINTS, REPEATS = 1.5, 20_000, 10
SPACING = 0.02


def records(quick: bool) -> Iterator[Record]:
    """Time a query for every number of balls, and the greatest against the least number's."""
    times = {int(np.prod(grid)): apart(measured, grid) for grid in (GRIDS[::4] if quick else GRIDS)}
    for count, seconds in times.items():
        yield told("balls", {"balls": count}, "query", "us", 1e6 * seconds, seconds)
    first, last = min(times), max(times)
    growth = times[last] / times[first]
    yield absolute("balls", {"from": first, "to": last}, "query_times", "1", growth, 0.0, TIMES, sum(times.values()))


def measured(grid: tuple[int, int, int]) -> float:
    """Start Taichi; seconds a query."""
    runtime.start("cpu")
    return query(block(grid))


def block(grid: tuple[int, int, int]) -> Body:
    """The block made of a grid of balls, of the same volume whatever the grid."""
    return _block(grid, (VOLUME / volume(_block(grid, 1.0))) ** (1 / 3))


def volume(body: Body) -> float:
    """What the skin encloses [m^3], by the divergence theorem."""
    vertices, triangles = surface_mesh(body.posed(np.eye(4)[None]), SPACING)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def _block(grid: tuple[int, int, int], scale: float) -> Body:
    spacing = scale * SIZE / grid / CM
    places = np.stack(np.meshgrid(*(np.arange(n) - (n - 1) / 2 for n in grid), indexing="ij"), -1).reshape(-1, 3)
    shared = {"radii_cm": (REACH * spacing).tolist(), "weight": WEIGHT, "groups": ["block"], "bones": {"root": 1.0}}
    balls = {f"ball_{k}": {"center_cm": (place * spacing).tolist(), **shared} for k, place in enumerate(places)}
    bones = {"root": {"parent": None, "head_cm": [0.0, 0.0, 0.0]}}
    made = {"name": "block", "bones": bones, "groups": ["block"], "balls": balls}
    return Body.from_spec(BodySpec.model_validate(made))


def query(body: Body, points: int = POINTS) -> float:
    """Seconds to ask a body for the gap of one point near its skin, the shortest of REPEATS runs over all points."""
    skin, _ = surface_mesh(body.posed(np.eye(4)[None]), SPACING)
    rng = np.random.default_rng(0)
    near = rng.choice(skin, points) + rng.uniform(-5e-3, 5e-3, (points, 3))
    field = BodyField(body)
    field.set_pose(np.eye(4)[None])
    tables = fields.Tables()
    at, gaps = tables.vectors(near), ti.field(float, shape=points)
    tables.fill()

    @ti.kernel
    @shared
    def ask():
        for i in range(points):
            gap, _normal, _winner = field.gap(at[i])
            gaps[i] = gap

    ask()
    times = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        ask()
        ti.sync()
        times.append(time.perf_counter() - begin)
    return min(times) / points
