import numpy as np

from taichi_tryon.view.camera import Camera
from taichi_tryon.view.ggui import SUPERSAMPLING
from taichi_tryon.view.mesh import Mesh
from taichi_tryon.view.shading import BACKGROUND


def test_vertices_live_until_ggui_reads_them(ggui, shapes):
    """GGUI reads its vertices only when the picture is asked for: memory freed before would be used anew."""
    vertices, triangles = shapes.sphere(0.5, 40)
    camera = Camera(np.array([0, 0, 6.0]), np.zeros(3))
    for _ in range(3):
        ggui._scene.draw(ggui.prepare([Mesh(vertices, triangles, (0.8, 0.1, 0.1), two_sided=False)]), camera)
        junk = [np.full((3 * len(triangles), 12), np.nan, np.float32) for _ in range(20)]
        pixels = ggui._window.get_image_buffer_as_numpy()
        assert pixels.shape[:2] == tuple(SUPERSAMPLING * side for side in ggui.size)
        assert pixels[ggui.size[0], ggui.size[1], 0] > pixels[ggui.size[0], ggui.size[1], 1] + 0.2
        np.testing.assert_allclose(pixels[2, 2, :3], BACKGROUND, atol=0.01)
        del junk


def test_closing_twice_is_harmless(ggui):
    ggui.close()
    ggui.close()
