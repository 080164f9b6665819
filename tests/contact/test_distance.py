"""Closest points of a vertex and a triangle and of two edges: against a search, in general and degenerate positions."""

import numpy as np
import pytest

from taichi_tryon.contact.distance import EDGES, FACE


def searched(kind: int, corners: np.ndarray) -> np.ndarray:
    """Distances (n,): where on the first side, a convex problem, by thirds; on the second side in closed form."""
    a, b, c, d = np.moveaxis(corners, 1, 0)
    if kind == FACE:
        # b + s (c - b) + t (d - b) - a, t from 0 to 1 - s
        start, along, across = b - a, c - b, d - b
    else:
        # c + t (d - c) - a - s (b - a), t from 0 to 1
        start, along, across = c - a, a - b, d - c

    def rest(s):
        at = start + s[:, None] * along
        most = 1 - s if kind == FACE else 1
        t = np.clip(-(at * across).sum(axis=1) / (across**2).sum(axis=1), 0, most)
        return np.linalg.norm(at + t[:, None] * across, axis=1)

    low, high = np.zeros(len(a)), np.ones(len(a))
    for _ in range(90):
        third = (high - low) / 3
        left = rest(low + third) < rest(high - third)
        low, high = np.where(left, low, low + third), np.where(left, high - third, high)
    return np.minimum(rest(0.5 * (low + high)), np.minimum(rest(np.zeros(len(a))), rest(np.ones(len(a)))))


def general(kind: int, count=4000) -> np.ndarray:
    """Pairs of all shapes: near, far, long, short."""
    rng = np.random.default_rng(kind)
    corners = rng.normal(size=(count, 4, 3)) * rng.choice([0.03, 0.3, 1.0], size=(count, 4, 1))
    other = slice(1 if kind == FACE else 2, None)
    corners[:, other] += rng.normal(size=(count, 1, 3)) * rng.choice([0.0, 0.5, 3.0], size=(count, 1, 1))
    return corners


def check(closest, kind, corners):
    weights, length = closest(np.full(len(corners), kind), corners)
    assert length == pytest.approx(searched(kind, corners), rel=1e-9, abs=1e-9)
    first = 1 if kind == FACE else 2
    assert weights[:, :first].sum(axis=1) == pytest.approx(1, abs=1e-12)
    assert weights[:, first:].sum(axis=1) == pytest.approx(-1, abs=1e-12)
    assert weights[:, :first].min() >= 0 and weights[:, first:].max() <= 0
    assert length == pytest.approx(np.linalg.norm(np.einsum("pk,pki->pi", weights, corners), axis=1), abs=1e-12)
    return weights


@pytest.mark.parametrize("kind", [FACE, EDGES])
def test_random_pairs(closest, kind):
    weights = check(closest, kind, general(kind))
    # inside, at ends and on sides: every case is met
    inner = (weights != 0).sum(axis=1)
    assert all((inner == count).mean() > 0.05 for count in (2, 3, 4))


TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0.2, 0.8, 0]])


@pytest.mark.parametrize("place", [[1, 0, 0], [0, 0, 1], [0.5, 0.5, 0], [0, 0.25, 0.75], [0.3, 0.3, 0.4]])
def test_a_vertex_right_over_a_corner_an_edge_and_the_inside(closest, place):
    for height in (0.1, 1e-3, 1e-6):
        corners = np.array([[np.array(place) @ TRIANGLE + [0, 0, height], *TRIANGLE]])
        weights, length = closest([FACE], corners)
        assert weights[0] == pytest.approx([1, *(-w for w in place)], abs=1e-9)
        assert length[0] == pytest.approx(height, rel=1e-9)


def test_a_vertex_in_the_plane_outside(closest):
    rng = np.random.default_rng(0)
    outside = np.column_stack([rng.uniform(-2, 2, (500, 2)), np.zeros(500)])
    check(closest, FACE, np.concatenate([outside[:, None], np.broadcast_to(TRIANGLE, (500, 3, 3))], axis=1))


def test_slivers(closest):
    """Triangles a thousand times as long as high."""
    rng = np.random.default_rng(1)
    corners = np.zeros((500, 4, 3))
    corners[:, 0] = rng.uniform(-0.2, 1.2, (500, 3))
    corners[:, 2, 0], corners[:, 3, 0] = 1, rng.uniform(-0.2, 1.2, 500)
    corners[:, 3, 1] = 1e-3
    check(closest, FACE, corners)


@pytest.mark.parametrize("tilt", [0.0, 1e-12, 1e-8, 1e-6, 1e-4, 1e-2])
def test_edges_that_are_all_but_parallel(closest, tilt):
    """Beside each other, one behind the other, with equal and with opposite sense."""
    rng = np.random.default_rng(2)
    count = 1000
    corners = np.zeros((count, 4, 3))
    corners[:, 1, 0] = 1
    first = rng.uniform(-2, 2, count)
    corners[:, 2, 0], corners[:, 3, 0] = first, first + rng.choice([-1.0, 1.0], count) * rng.uniform(0.2, 2, count)
    corners[:, 2:, 1] = rng.uniform(0.01, 1, (count, 1))
    corners[:, 3] += tilt * rng.normal(size=(count, 3))
    weights, length = closest(np.full(count, EDGES), corners)
    # taken for parallel, edges may be as much nearer elsewhere as they come together over their lengths
    lost = length - searched(EDGES, corners)
    assert lost.min() > -1e-9
    assert lost.max() < 1e-5 * 2


def test_edges_over_each_others_ends(closest):
    corners = np.array(
        [
            [[0, 0, 0], [1, 0, 0], [1, 0, 0.1], [1, 1, 0.1]],
            [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0.5, 0.5]],
            [[0, 0, 0], [1, 0, 0], [-1, -1, 0.1], [-1, 1, 0.1]],
            [[0, 0, 0], [1, 0, 0], [0.5, -1, 0.2], [0.5, 1, 0.2]],
        ],
        float,
    )
    weights, length = closest(np.full(4, EDGES), corners)
    assert weights == pytest.approx(
        np.array([[0, 1, -1, 0], [0, 1, -1, 0], [1, 0, -0.5, -0.5], [0.5, 0.5, -0.5, -0.5]]), abs=1e-12
    )
    assert length == pytest.approx([0.1, 1, np.sqrt(1.01), 0.2], rel=1e-12)


@pytest.mark.parametrize("kind", [FACE, EDGES])
def test_gradient_is_weights_times_direction(closest, kind):
    corners = general(kind, 300)
    kinds, eps = np.full(len(corners), kind), 1e-7
    weights, length = closest(kinds, corners)
    away = np.einsum("pk,pki->pi", weights, corners) / length[:, None]
    gradient = weights[:, :, None] * away[:, None]
    for seed in range(3):
        direction = np.random.default_rng(seed).normal(size=corners.shape)
        slope = (closest(kinds, corners + eps * direction)[1] - closest(kinds, corners - eps * direction)[1]) / (
            2 * eps
        )
        assert np.einsum("pki,pki->p", gradient, direction) == pytest.approx(slope, abs=1e-4)
