"""The skin W = 1 as triangles, for pictures and tests; the simulation itself never needs it."""

from __future__ import annotations

import numpy as np
from skimage.measure import marching_cubes

from taichi_tryon.body.density import closest
from taichi_tryon.body.model import Balls

_UNBOUNDED_REACH = 1.0  # [m] how far from its centre an infinite ball is drawn


def surface_mesh(balls: Balls, spacing: float = 8e-3) -> tuple[np.ndarray, np.ndarray]:
    """Closed surface: vertices (n, 3) [m] on W = 1 and outward triangles (m, 3), from a grid of ``spacing`` [m].

    Marching cubes (Lewiner et al. 2003) on a grid where each ball is added only where it reaches. Infinite balls are
    cut off 1 m from their centres. Without balls there is no surface.
    """
    if not len(balls.weights):
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    extents = np.minimum(balls.extents, _UNBOUNDED_REACH)
    low = np.floor((balls.centers - extents).min(axis=0) / spacing).astype(int) - 1
    high = np.ceil((balls.centers + extents).max(axis=0) / spacing).astype(int) + 1
    sums = np.zeros((balls.membership.shape[1], *(high - low + 1)), np.float32)
    for k, quadratic in enumerate(balls.quadratics):
        start = np.ceil((balls.centers[k] - extents[k]) / spacing).astype(int)
        stop = np.floor((balls.centers[k] + extents[k]) / spacing).astype(int) + 1
        offsets = [np.arange(a, b) * spacing - c for a, b, c in zip(start, stop, balls.centers[k], strict=True)]
        rest = np.maximum(1 - _quadratic_form(quadratic, *offsets), 0)
        block = (slice(None), *(slice(a - o, b - o) for a, b, o in zip(start, stop, low, strict=True)))
        sums[block][balls.membership[k]] += (balls.weights[k] * rest**3).astype(np.float32)
    vertices, triangles, _, _ = marching_cubes(sums.max(axis=0), 1.0, spacing=(spacing,) * 3)
    # Interpolated along the grid's edges, vertices are up to 2 mm off: seen as skin that shows through the cloth.
    vertices = closest(balls, vertices.astype(float) + low * spacing, iterations=1)[1]
    return vertices, triangles[:, ::-1].astype(np.int64)


def _quadratic_form(q: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """(i, j, k) values of p^T Q p on the grid of coordinates x (i,), y (j,), z (k,)."""
    x, y, z = x[:, None, None], y[None, :, None], z[None, None, :]
    in_plane = q[0, 0] * x * x + q[1, 1] * y * y + 2 * q[0, 1] * x * y
    return in_plane + z * (2 * q[0, 2] * x + 2 * q[1, 2] * y) + q[2, 2] * z * z
