import numpy as np
import pytest

from taichi_tryon.errors import RunError
from taichi_tryon.view.mesh import DrawList, Mesh, Weave, smoothed, vertex_normals


def test_normals_of_a_sphere_point_outwards(shapes):
    vertices, triangles = shapes.sphere(0.3, 40)
    used = np.unique(triangles)
    assert np.einsum("ij,ij->i", vertex_normals(vertices, triangles), vertices / 0.3)[used].min() > 0.99


def test_normals_weigh_triangles_by_area_and_are_zero_for_a_lone_vertex():
    vertices = np.array([[0, 0, 0], [2.0, 0, 0], [0, 2, 0], [0, 0, 1], [9, 9, 9]])
    normals = vertex_normals(vertices, np.array([[0, 1, 2], [0, 2, 3]]))
    np.testing.assert_allclose(normals[0], np.array([1, 0, 2]) / np.sqrt(5))
    np.testing.assert_array_equal(normals[4], 0)


def test_draw_list_joins_meshes(shapes):
    (va, ta), (vb, tb) = shapes.tetrahedron(), shapes.tetrahedron(2.0)
    weave = Weave(np.full((4, 3, 2), 0.3), 0.1, (1, 1, 1))
    draw = DrawList.of([Mesh(va, ta, (1, 0, 0), two_sided=False), Mesh(vb, tb, np.eye(4)[:, :3], weave=weave)])
    np.testing.assert_array_equal(draw.triangles[4:], tb + 4)
    np.testing.assert_array_equal(draw.mesh, [0, 0, 0, 0, 1, 1, 1, 1])
    np.testing.assert_allclose(draw.colors[:4], np.broadcast_to([1, 0, 0], (4, 3, 3)))
    np.testing.assert_allclose(draw.colors[4:], np.eye(4)[:, :3][tb])
    np.testing.assert_allclose(draw.weave[4:], 3.0, rtol=1e-6)
    np.testing.assert_array_equal(draw.style[:, :2], [[0, 0], [1, 1]])


def test_nothing_to_draw_or_not_finite_is_refused(shapes):
    vertices, triangles = shapes.tetrahedron()
    with pytest.raises(RunError, match="nothing to draw"):
        DrawList.of([Mesh(vertices, triangles[:0], (1, 1, 1))])
    vertices[2, 1] = np.nan
    with pytest.raises(RunError, match="not a finite number"):
        DrawList.of([Mesh(vertices, triangles, (1, 1, 1))])


def test_smoothing_keeps_constants_evens_out_steps_and_leaves_lone_vertices(shapes):
    points, triangles, _ = shapes.sheet()
    values = np.stack([np.full(len(points) + 1, 3.0), np.append(points[:, 0] > 0, 7.0)], axis=1)
    even = smoothed(values, triangles, 3)
    np.testing.assert_allclose(even[:, 0], 3.0)
    assert np.abs(np.diff(even[:9, 1])).max() < 0.7
    assert even[-1, 1] == 7.0
