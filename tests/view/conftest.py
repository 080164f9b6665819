"""Renderers of small pictures and shapes to draw."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tryon.errors import RunError
from taichi_tryon.view.ggui import GguiRenderer
from taichi_tryon.view.raster import RasterRenderer

SIZE = (160, 120)


@pytest.fixture(scope="module")
def raster(_taichi):
    return RasterRenderer(SIZE)


@pytest.fixture(scope="module")
def ggui(_taichi):
    try:
        renderer = GguiRenderer(SIZE)
    except RunError as fault:
        pytest.skip(str(fault))
    yield renderer
    renderer.close()


@pytest.fixture(params=["raster", "ggui"])
def renderer(request):
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="session")
def shapes():
    return SimpleNamespace(tetrahedron=_tetrahedron, sheet=_sheet, sphere=_sphere)


def _tetrahedron(size=1.0, shift=(0, 0, 0)):
    """Asymmetric, closed, outward."""
    vertices = size * np.array([[0, 0, 0], [1.0, 0, 0.1], [0.2, 1.4, 0], [0.3, 0.2, 0.8]]) + shift
    return vertices, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def _sheet(width=1.0, height=1.0, cells=8, z=0.0):
    """(vertices, triangles, rest): in the xy plane around the origin, outward +z; warp along y."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, cells + 1) * width, np.linspace(-0.5, 0.5, cells + 1) * height)
    vertices = np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    lower = np.stack([corner, corner + 1, corner + cells + 2], axis=1)
    upper = np.stack([corner, corner + cells + 2, corner + cells + 1], axis=1)
    triangles = np.concatenate([lower, upper])
    return vertices, triangles, vertices[triangles][:, :, [1, 0]]


def _sphere(radius=1.0, rings=24):
    """Closed, outward."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.arange(2 * rings) * np.pi / rings, indexing="ij")
    vertices = radius * np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], axis=-1)
    index = np.arange(theta.size).reshape(theta.shape)
    a, b = index[:-1], index[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    triangles = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, c, b), (a, d, c))])
    vertices = vertices.reshape(-1, 3)
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    area = np.cross(b - a, c - a)
    return vertices, triangles[np.linalg.norm(area, axis=1) > 1e-12]
