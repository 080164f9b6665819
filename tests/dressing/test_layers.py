from __future__ import annotations

import numpy as np
import pytest

from taichi_tryon.dressing.layers import BEYOND, REACH, beneath, heights, lift


def half_tube(radius: float = 0.1, height: float = 0.2, around: int = 12, along: int = 5):
    """Half a tube about the y axis, open to -x; counter-clockwise seen from outside."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, around + 1)
    y = np.linspace(0, height, along + 1)
    a, y = np.meshgrid(angle, y, indexing="ij")
    positions = np.stack([radius * np.cos(a), y, -radius * np.sin(a)], axis=2).reshape(-1, 3)
    corner = (np.arange(around)[:, None] * (along + 1) + np.arange(along)).ravel()
    p, q, r, s = corner, corner + along + 1, corner + along + 2, corner + 1
    return positions, np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])


def around(radius: float, degrees, height: float = 0.09) -> np.ndarray:
    a = np.radians(degrees)
    return np.stack([radius * np.cos(a), np.full(len(a), height), -radius * np.sin(a)], axis=1)


@pytest.mark.parametrize("radius, expected", [(0.08, True), (0.098, True), (0.1001, False), (0.13, False)])
def test_sides_of_a_tube(radius, expected):
    """0.098 lies within the polygon, whose flat sides come to 0.0991 from the axis."""
    found = beneath(around(radius, np.linspace(-80, 80, 57)), half_tube())
    assert (found == expected).all()


def test_nothing_lies_beneath_the_rim():
    above = around(0.09, np.linspace(-80, 80, 9), height=0.22)
    at_the_slit = np.array([[-0.01, 0.1, 0.098], [-0.01, 0.1, 0.102]])
    assert not beneath(np.concatenate([above, at_the_slit]), half_tube()).any()


def test_heights_over_a_flat_sheet_and_beyond_its_rim():
    sheet = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0, -0.1], [0, 0, -0.1]]), np.array([[0, 1, 2], [0, 2, 3]])
    at = [[0.05, 0.03, -0.05], [0.05, -0.03, -0.02], [0.05, 0, -0.05], [-0.01, -0.01, -0.05], [-2 * BEYOND, 0, -0.05],
          [0.05, 1.1 * REACH, -0.05]]  # fmt: skip
    height, up, at_rim = heights(np.array(at), sheet, REACH)
    assert height == pytest.approx([0.03, -0.03, 0, -0.01, np.inf, np.inf], abs=1e-12)
    assert np.allclose(up[:4], [0, 1, 0]) and not up[4:].any()
    assert at_rim.tolist() == [False, False, False, True, False, False]
    assert heights(np.array(at), sheet, np.inf)[0][5] == pytest.approx(1.1 * REACH)


def test_points_are_lifted_over_all_layers_that_they_are_too_low_for():
    inner, outer = half_tube(0.1), half_tube(0.11)
    points = np.concatenate([around(radius, [-60, 0, 60]) for radius in (0.09, 0.105, 0.12)])
    lifted = points + lift(points, [inner, outer], 3e-3)
    over_outer = heights(lifted, outer, REACH)[0]
    assert over_outer[:6] == pytest.approx(3e-3) and (lifted[6:] == points[6:]).all()
    assert np.allclose(points + lift(points, [inner], 3e-3), points + lift(points, [inner, inner], 3e-3))


@pytest.mark.parametrize("inward", [1, -1])
def test_sharp_folds_have_the_sides_of_their_corners(inward):
    """At the ridge of a roof of 40 degrees the normal of one side points away from points above the other."""
    low, slope = np.tan(np.radians(70)), np.linspace(0, 2, 3)
    x = np.array([[s * d, -abs(s) * low, z] for s in (-1, 0, 1) for z in slope for d in (1.0,)]) * [0.02, 0.02, 0.02]
    triangles = np.array([[a, b, c] for i in (0, 3) for k in (0, 1)
                          for a, b, c in ((i + k, i + k + 1, i + k + 4), (i + k, i + k + 4, i + k + 3))])  # fmt: skip
    rng = np.random.default_rng(0)
    off = rng.uniform([-0.004, 1e-3, 0.01], [0.004, 4e-3, 0.03], (200, 3))
    over, under = off + [0, 1e-3, 0], off * [0.1, -1, 1] - [0, 5e-3, 0]
    up = np.cross(x[triangles[0, 1]] - x[triangles[0, 0]], x[triangles[0, 2]] - x[triangles[0, 0]])[1] > 0
    outward = triangles if up else triangles[:, ::-1]
    over, under = (over, under) if inward == 1 else (under, over)
    sheet = (x, outward[:, ::inward])
    assert not beneath(over, sheet).any()
    assert beneath(under, sheet).all()


def test_same_sides_as_by_all_triangles_of_a_ball():
    """Of a closed surface the inner side is what it holds, here a rough ball cut into tetrahedra about its centre."""
    rng = np.random.default_rng(3)
    from scipy.spatial import ConvexHull

    directions = rng.standard_normal((60, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    hull = ConvexHull(directions)
    triangles = hull.simplices.copy()
    turned = np.linalg.det(directions[triangles]) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    positions = directions * rng.uniform(0.04, 0.06, (60, 1))
    points = rng.uniform(-0.06, 0.06, (400, 3))
    shares = np.linalg.solve(positions[triangles].transpose(0, 2, 1)[None], points[:, None, :, None])[..., 0]
    inside = ((shares > 0).all(axis=2) & (shares.sum(axis=2) < 1)).any(axis=1)
    assert 50 < inside.sum() < 350
    assert (beneath(points, (positions, triangles)) == inside).all()
