import numpy as np

from taichi_tryon.view.appearance import cloth
from taichi_tryon.view.camera import Camera
from taichi_tryon.view.mesh import Mesh
from taichi_tryon.view.raster import RasterRenderer


def crowd(shapes):
    """Many triangles that cover the same samples."""
    points, triangles, rest = shapes.sheet(cells=40)
    layers = [cloth(points + [0, 0, 1e-3 * k], triangles, rest, "#8fb3d9", 0.05) for k in range(5)]
    return [*layers, Mesh(*shapes.sphere(0.3, 40), (0.8, 0.6, 0.5), two_sided=False)]


def test_same_bytes_every_time(raster, shapes):
    camera = Camera(np.array([0.5, 0.4, 5.0]), np.zeros(3))
    first = raster.render(crowd(shapes), camera)
    for _ in range(5):
        np.testing.assert_array_equal(raster.render(crowd(shapes), camera), first)
    np.testing.assert_array_equal(RasterRenderer(raster.size).render(crowd(shapes), camera), first)


def test_no_holes_between_neighbouring_triangles(raster, shapes):
    points, triangles, _ = shapes.sheet(cells=37)
    points = points @ np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1.0]])
    image = raster.render([Mesh(points, triangles, (0.2, 0.2, 0.2))], Camera(np.array([0, 0, 5.0]), np.zeros(3)))
    assert image[40:80, 60:100].max() < 150


def test_triangles_behind_the_camera_are_left_out(raster, shapes):
    points, triangles, _ = shapes.sheet()
    camera = Camera(np.array([0, 0, 1.0]), np.zeros(3))
    grey, behind = Mesh(points, triangles, (0.5, 0.5, 0.5)), Mesh(points + [0, 0, 3], triangles, (1, 0, 0))
    in_front, both = raster.render([grey], camera), raster.render([grey, behind], camera)
    assert (both[:, :, 0] <= in_front[:, :, 0] + 1).all()


def test_only_behind_the_camera_is_an_empty_picture(raster, shapes):
    points, triangles, _ = shapes.sheet()
    image = raster.render([Mesh(points + [0, 0, 9], triangles, (1, 0, 0))], Camera(np.array([0, 0, 1.0]), np.zeros(3)))
    assert np.ptp(image.reshape(-1, 3), axis=0).max() == 0
