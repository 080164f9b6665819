from __future__ import annotations

import numpy as np
import pytest

from taichi_tryon.dressing.flatten import harmonic, locate, mean_value_weights, remap_rows, signed_areas
from taichi_tryon.errors import DressingError


def square(n: int, bend) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Flat points (n^2, 2) of a bent unit square, its triangles, and which points lie on the outline."""
    t = np.linspace(0, 1, n)
    x, y = (c.ravel() for c in np.meshgrid(t, t, indexing="ij"))
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.concatenate([np.stack([i, i + n, i + n + 1], 1), np.stack([i, i + n + 1, i + 1], 1)])
    outline = np.flatnonzero((x == 0) | (x == 1) | (y == 0) | (y == 1))
    return bend(np.stack([x, y], 1)), triangles, outline


def test_weights_are_positive_and_reproduce_linear_functions():
    points, triangles, outline = square(9, lambda p: p @ np.array([[1, 0.3], [0.2, 1]]))
    weights = mean_value_weights(triangles, points[triangles], len(points))
    assert weights.data.min() > 0
    linear = points @ np.array([[2.0, -1.0], [0.5, 3.0]]) + 1
    assert np.allclose(harmonic(weights, outline, linear[outline]), linear, atol=1e-12)


def test_one_to_one_where_the_outline_is_far_from_convex():
    def crescent(p):
        angle, radius = 4.5 * p[:, 0], 1 - 0.7 * p[:, 1]
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1)

    points, triangles, outline = square(15, crescent)
    plain, _, _ = square(15, lambda p: p)
    weights = mean_value_weights(triangles, points[triangles], len(points))
    mapped = harmonic(weights, outline, plain[outline])
    areas = signed_areas(triangles, mapped)
    assert areas.min() > 0
    assert np.isclose(areas.sum(), 1)


def test_rows_land_on_whole_numbers_and_nothing_folds():
    points, triangles, outline = square(21, lambda p: p)
    t = np.linspace(0, 1, 11)
    rows = [np.stack([0.3 + 0.1 * np.sin(3 * t), t], 1), np.stack([0.7 - 0.2 * t, t], 1)]
    u = remap_rows(points, rows, "p", ["a", "b", "c", "d"])
    assert np.isclose([u.min(), u.max()], [0, 3]).all()
    assert (signed_areas(triangles, np.stack([u, points[:, 1]], 1)) > 0).all()
    at = np.stack([np.interp(0.35, t, rows[0][:, 0]), 0.35])[None]
    assert np.isclose(remap_rows(at, rows, "p", ["a", "b", "c", "d"])[0], 1)


def test_rows_out_of_order_name_panel_and_disk():
    t = np.linspace(0, 1, 11)
    rows = [np.stack([0.5 + 0 * t, t], 1), np.stack([0.6 - 0.3 * t, t], 1)]
    with pytest.raises(DressingError, match="panel 'sleeve'.*disk 'c'"):
        remap_rows(np.random.default_rng(0).random((50, 2)), rows, "sleeve", ["a", "b", "c", "d"])


def test_locate_interpolates_and_knows_outside():
    corners = np.array([[[0, 0], [1, 0], [0, 1]], [[1, 0], [1, 1], [0, 1]]], float)
    values = corners @ np.array([[2.0], [3.0]])
    found = locate(np.array([[0.2, 0.3], [0.9, 0.8], [1.2, 0.5]]), corners, values)
    assert np.allclose(found[:2, 0], [1.3, 4.2])
    assert np.isnan(found[2, 0])
