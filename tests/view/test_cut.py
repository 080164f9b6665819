import numpy as np
import pytest

from taichi_tryon.view.cut import cut_along_lines


def area(points):
    a, b = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


@pytest.mark.parametrize("scale", [0.3, 1.0, 7.0])
def test_pieces_cover_each_triangle_once_and_cross_no_line(scale):
    weave = scale * np.random.default_rng(5).normal(size=(300, 3, 2))
    parent, weights = cut_along_lines(weave)
    points = np.einsum("nij,njk->nik", weights, weave[parent])
    np.testing.assert_allclose(weights.sum(axis=2), 1, atol=1e-12)
    assert weights.min() > -1e-12
    np.testing.assert_allclose(np.bincount(parent, area(points), len(weave)), area(weave), rtol=1e-9, atol=1e-12)
    assert (area(points) * area(weave)[parent] >= -1e-18).all()
    assert (points.max(axis=1) - np.floor(points.min(axis=1) + 1e-4)).max() < 1 + 1e-4


def test_corners_on_lines_make_no_slivers():
    weave = np.array([[[0, 0], [1, 0], [0, 1.0]], [[1, 1], [1, 2], [0, 1.0]], [[0.2, 0.2], [0.8, 0.2], [0.2, 0.8]]])
    parent, weights = cut_along_lines(weave)
    np.testing.assert_array_equal(parent, [0, 1, 2])
    np.testing.assert_array_equal(weights, np.tile(np.eye(3), (3, 1, 1)))


def test_no_triangle_gives_no_piece():
    parent, weights = cut_along_lines(np.zeros((0, 3, 2)))
    assert parent.shape == (0,)
    assert weights.shape == (0, 3, 3)
