from __future__ import annotations

import numpy as np

from taichi_tryon.body.model import Balls
from taichi_tryon.dressing.check import body_gaps, crossings

FLOOR = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def pairs(second, first=FLOOR):
    return crossings(np.array([*first, *second], float), np.array([[0, 1, 2], [3, 4, 5]])).tolist()


def test_edge_through_the_inside_crosses():
    assert pairs([[0.2, 0.2, -1], [0.2, 0.2, 1], [2, 2, 0.5]]) == [[0, 1]]


def test_edge_of_the_first_through_the_second_crosses():
    assert pairs([[0.3, -1, -1], [0.3, 0.2, 1], [0.3, 0.2, -1]]) == [[0, 1]]


def test_edge_past_the_outline_does_not_cross():
    assert pairs([[0.6, 0.6, -1], [0.6, 0.6, 1], [2, 2, 0.5]]) == []


def test_parallel_triangles_do_not_cross():
    assert pairs([[0, 0, 1e-9], [1, 0, 1e-9], [0, 1, 1e-9]]) == []


def test_touching_with_a_corner_is_not_crossing():
    assert pairs([[0.2, 0.2, 0], [0.2, 0.2, 1], [1, 1, 1]]) == []


def test_common_edge_is_not_crossing_whatever_the_fold():
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.9, 1e-3]])
    assert len(crossings(x, np.array([[0, 1, 2], [1, 0, 3]]))) == 0


def test_common_corner_and_far_edge_through():
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, -1], [0.3, 0.3, 1]])
    assert crossings(x, np.array([[0, 1, 2], [0, 3, 4]])).tolist() == [[0, 1]]


def test_tiny_and_huge_triangles_are_compared():
    small = np.array([[50.0, 40.0, -0.01], [50.0, 40.0, 0.01], [50.01, 40.0, 0.0]])
    x = np.concatenate([[[0, 0, 0], [1000, 0, 0], [0, 1000, 0]], small, small + [0, 0, 1]])
    assert crossings(x, np.arange(9).reshape(3, 3)).tolist() == [[0, 1]]


def test_same_pairs_as_all_against_all():
    rng = np.random.default_rng(1)
    x = (rng.random((40, 1, 3)) + 0.2 * rng.standard_normal((40, 3, 3))).reshape(-1, 3)
    triangles = np.arange(120).reshape(40, 3)
    two = np.arange(6).reshape(2, 3)
    alone = [[j, i] for i in range(40) for j in range(i) if len(crossings(x[triangles[[i, j]]].reshape(-1, 3), two))]
    assert len(alone) > 10
    assert crossings(x, triangles).tolist() == sorted(alone)


def test_gap_is_taken_inside_the_triangle_too():
    # its corners are far from the ball, its middle is near
    ball = Balls(
        centers=np.zeros((1, 3)),
        radii=np.full((1, 3), 0.2),
        axes=np.eye(3)[None],
        weights=np.array([2.0]),
        membership=np.ones((1, 1), bool),
        bones=np.zeros((1, 2), int),
        bone_weights=np.array([[1.0, 0.0]]),
    )
    radius = 0.2 * np.sqrt(1 - 0.5 ** (1 / 3))
    angle = np.radians([90, 210, 330])
    x = np.stack([0.15 * np.cos(angle), 0.15 * np.sin(angle), np.full(3, 0.11)], axis=1)
    assert np.isclose(body_gaps(x, np.array([[0, 1, 2]]), ball)[0], 0.11 - radius, atol=1e-6)
