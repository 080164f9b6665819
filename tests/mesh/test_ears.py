import numpy as np

from taichi_tryon.mesh.ears import open_crowded_ears

# a square of two triangles that share the diagonal 1-3; point 0 and point 2 are ears
POINTS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
SQUARE = np.array([[0, 1, 3], [1, 2, 3]])


def test_nothing_changes_where_nothing_is_crowded():
    assert np.array_equal(open_crowded_ears(POINTS, SQUARE, np.arange(4)), SQUARE)


def test_one_of_two_coinciding_inner_sides_is_flipped():
    points = np.concatenate([POINTS, POINTS])
    triangles = np.concatenate([SQUARE, SQUARE[:, ::-1] + 4])
    triangles[2:] = triangles[2:, ::-1]  # both squares face the same way in the flat
    vertices = np.array([0, 1, 2, 3, 0, 1, 6, 3])
    opened = open_crowded_ears(points, triangles, vertices)
    sides = np.sort(vertices[np.stack([opened, np.roll(opened, -1, axis=1)], axis=2).reshape(-1, 2)], axis=1)
    _, uses = np.unique(sides, axis=0, return_counts=True)
    assert uses.max() == 2
    assert (opened == triangles).all(axis=1).sum() == 2
