import numpy as np

from taichi_tryon.view.mesh import DrawList, Mesh
from taichi_tryon.view.occlusion import DIRECTIONS, Occlusion, frames


def openness(*meshes):
    return Occlusion().apply(DrawList.of(meshes)).openness


def test_directions_are_even_and_frames_right_handed():
    axes = frames(DIRECTIONS).astype(float)
    np.testing.assert_allclose(axes @ axes.transpose(0, 2, 1), np.broadcast_to(np.eye(3), axes.shape), atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(axes), 1, atol=1e-6)
    assert np.linalg.norm(axes[:, 2].mean(axis=0)) < 0.05


def test_a_lone_sheet_sees_the_whole_sky_from_both_sides(shapes):
    points, triangles, _ = shapes.sheet()
    assert openness(Mesh(points, triangles, (1, 1, 1))).min() > 0.95


def test_inside_of_a_closed_surface_sees_nothing_and_its_outside_all(shapes):
    seen = openness(Mesh(*shapes.sphere(0.5, 40), (1, 1, 1)))[80:-80]
    assert seen[:, 0].mean() > 0.95
    assert seen[:, 1].max() < 0.05


def test_a_sheet_close_before_a_wall_darkens_it(shapes):
    points, triangles, _ = shapes.sheet(cells=20)
    cover = Mesh(0.5 * points + [0, 0, 0.05], triangles, (1, 1, 1))
    seen = openness(Mesh(points, triangles, (1, 1, 1)), cover)[: len(points), 0].reshape(21, 21)
    assert seen[10, 10] < 0.5
    assert seen[0, 0] > 0.9
    assert openness(Mesh(points, triangles, (1, 1, 1)), cover)[: len(points), 1].min() > 0.95
