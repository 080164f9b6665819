"""A small unstructured sheet of the paper's fabric, as the product meshes it."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tryon.cloth.model import Cloth
from taichi_tryon.fabric import Moduli
from taichi_tryon.mesh.topology import Topology
from taichi_tryon.mesh.triangulate import triangulate

TABLE1 = Moduli(
    stretch=np.array([2392.8, 2373.2, 0.0, 77.54]),
    bend=np.array([1.4416e-5, 1.0591e-5, 0.0, 3.751e-6]),
    mass=0.29,
    damping_time=0.0,
)


def make_sheet(width: float, height: float, edge: float):
    """A flat rectangle, its grain along +x."""
    nx, ny = round(width / edge), round(height / edge)
    x, y = np.linspace(0, width, nx + 1), np.linspace(0, height, ny + 1)
    outline = np.concatenate(
        [
            np.column_stack([x[:-1], np.zeros(nx)]),
            np.column_stack([np.full(ny, width), y[:-1]]),
            np.column_stack([x[:0:-1], np.full(nx, height)]),
            np.column_stack([np.zeros(ny), y[:0:-1]]),
        ]
    )
    points, triangles = triangulate(outline, edge, "sheet")
    rest = points[triangles]
    a, b = rest[:, 1] - rest[:, 0], rest[:, 2] - rest[:, 0]
    return SimpleNamespace(
        name="sheet",
        points=points,
        triangles=triangles,
        rest=rest,
        areas=(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2,
        vertex_count=len(points),
        topology=Topology.of(triangles, len(points)),
    )


@pytest.fixture(scope="session")
def sheet():
    return make_sheet(0.12, 0.1, 0.012)


@pytest.fixture(scope="session")
def moduli():
    return TABLE1


@pytest.fixture(scope="session")
def cloth(sheet, moduli):
    return Cloth.join([(sheet, moduli)])
