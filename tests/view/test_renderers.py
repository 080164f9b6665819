"""What holds for both renderers, and that they agree."""

import numpy as np
import pytest

from taichi_tryon.view.appearance import cloth
from taichi_tryon.view.camera import Camera, bounds_of, view_camera
from taichi_tryon.view.mesh import Mesh
from taichi_tryon.view.shading import BACKGROUND

RED, GREEN = (0.8, 0.1, 0.1), (0.1, 0.8, 0.1)
PAPER = np.round(np.array(BACKGROUND) * 255)


def silhouette(image):
    return np.abs(image.astype(int) - PAPER).max(axis=2) > 12


def test_picture_is_upright_and_not_mirrored(renderer, shapes):
    points, triangles, _ = shapes.sheet(0.2, 0.2)
    shapes = [
        Mesh(points + [-0.5, 0.6, 0], triangles, RED),
        Mesh(points + [0.5, 0.6, 0], triangles, GREEN),
        Mesh(points + [-0.5, -0.6, 0], triangles, GREEN),
    ]
    camera = Camera(np.array([0, 0, 5.0]), np.zeros(3))
    image = renderer.render(shapes, camera).astype(int)
    assert image.shape == (120, 160, 3)
    places = camera.project(np.array([[-0.5, 0.6, 0], [0.5, 0.6, 0], [-0.5, -0.6, 0]]), (160, 120)).astype(int)
    (ax, ay), (bx, by), (cx, cy) = places
    assert ax < bx and ay < cy
    assert image[ay, ax, 0] > image[ay, ax, 1] + 60
    assert image[by, bx, 1] > image[by, bx, 0] + 60
    assert image[cy, cx, 1] > image[cy, cx, 0] + 60
    np.testing.assert_allclose(image[2, 2], PAPER, atol=1)


def test_nearer_surface_hides_the_other_whatever_the_order(renderer, shapes):
    points, triangles, _ = shapes.sheet()
    near, far = Mesh(points + [0, 0, 0.01], triangles, RED), Mesh(points, triangles, GREEN)
    camera = Camera(np.array([0, 0, 6.0]), np.zeros(3))
    one, two = renderer.render([near, far], camera), renderer.render([far, near], camera)
    np.testing.assert_allclose(one, two, atol=1)
    assert (one[50:70, 70:90, 0].astype(int) > one[50:70, 70:90, 1] + 60).all()


def test_area_in_the_picture_is_that_of_the_shape(renderer, shapes):
    vertices, triangles = shapes.sphere(0.5, 48)
    camera = Camera(np.array([0, 0, 10.0]), np.zeros(3), fov_deg=8.0)
    inside = silhouette(renderer.render([Mesh(vertices, triangles, RED, two_sided=False)], camera))
    radius = 0.5 / camera.metres_per_pixel(120)
    assert inside.sum() == pytest.approx(np.pi * radius**2, rel=0.03)


def test_inside_of_cloth_is_darker_and_lit_towards_the_viewer(renderer, shapes):
    points, triangles, _ = shapes.sheet()
    camera = Camera(np.array([0, 0, 6.0]), np.zeros(3))
    outside = renderer.render([Mesh(points, triangles, RED)], camera)[60, 80].astype(int)
    inside = renderer.render([Mesh(points, triangles[:, ::-1], RED)], camera)[60, 80].astype(int)
    assert 0.5 * outside[0] < inside[0] < 0.9 * outside[0]


def test_closed_surface_hides_its_inside(renderer, shapes):
    points, triangles, _ = shapes.sheet()
    camera = Camera(np.array([0, 0, 6.0]), np.zeros(3))
    assert not silhouette(renderer.render([Mesh(points, triangles[:, ::-1], RED, two_sided=False)], camera)).any()


def test_check_follows_the_material(renderer, shapes):
    """Colour changes along warp (y) and weft (x) with the stripes, and both renderers show the same squares."""
    points, triangles, rest = shapes.sheet(cells=5)
    camera = Camera(np.array([0, 0, 5.0]), np.zeros(3), fov_deg=14.0)
    image = renderer.render([cloth(points, triangles, rest, "#204080", 0.25, "#ffffff")], camera).astype(int)
    red = {}
    for warp in (0, 1):
        for weft in (0, 1):  # the middle of the square in stripe number (warp, weft)
            middle = np.array([[0.125 - 0.25 * weft, 0.125 - 0.25 * warp, 0]])
            x, y = camera.project(middle, (160, 120))[0].astype(int)
            red[warp, weft] = image[y, x, 0]
    # Both yarns of the first colour; the weft yarn of the second (paler only in part); the warp yarn; both.
    assert red[0, 0] + 15 < red[1, 0] < red[0, 1] - 5
    assert red[1, 1] > red[0, 1] + 15


def test_light_comes_from_above(renderer, shapes):
    vertices, triangles = shapes.sphere(0.5, 32)
    camera = Camera(np.array([0, 0, 6.0]), np.zeros(3))
    image = renderer.render([Mesh(vertices, triangles, (0.6, 0.6, 0.6), two_sided=False)], camera).astype(int)
    assert image[40, 72, 1] > image[82, 88, 1] + 20


def test_arrays_may_grow_and_shrink_between_pictures(renderer, shapes):
    camera = Camera(np.array([0, 0, 6.0]), np.zeros(3))
    small, large = shapes.sphere(0.5, 6), shapes.sphere(0.5, 40)
    first = renderer.render([Mesh(*small, RED)], camera)
    renderer.render([Mesh(*large, RED), Mesh(*shapes.sphere(0.6, 40), RED)], camera)
    np.testing.assert_array_equal(renderer.render([Mesh(*small, RED)], camera), first)


@pytest.mark.parametrize("view", ["front", "right", "back", "top", "three_quarter"])
def test_renderers_show_the_same(raster, ggui, view, shapes):
    vertices, triangles = shapes.tetrahedron(0.5, (0.3, 1.0, 0.1))
    points, sheet_triangles, rest = shapes.sheet(0.7, 0.5, 12)
    points[:, 2] += 0.06 * np.sin(9 * points[:, 0])
    meshes = [
        Mesh(vertices, triangles, RED, two_sided=False),
        cloth(points + [-0.1, 0.9, -0.1], sheet_triangles, rest, "#8fb3d9", 0.05),
    ]
    camera = view_camera(view, bounds_of([mesh.vertices for mesh in meshes]), 160 / 120)
    one, two = raster.render(meshes, camera), ggui.render(meshes, camera)
    a, b = silhouette(one), silhouette(two)
    assert (a & b).sum() / (a | b).sum() > 0.97
    assert np.abs(one.astype(int) - two).mean() < 1.5
