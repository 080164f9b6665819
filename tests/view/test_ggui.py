import numpy as np

from taichi_tryon.view.camera import Camera
from taichi_tryon.view.mesh import Mesh
from taichi_tryon.view.shading import BACKGROUND

CAMERA = Camera(np.array([0, 0, 6.0]), np.zeros(3))


def _red(ggui, shapes):
    return ggui.prepare([Mesh(*shapes.sphere(0.5, 40), (0.8, 0.1, 0.1), two_sided=False)])


def test_a_picture_that_stays_empty_is_taken_again(ggui, shapes, monkeypatch):
    """Taichi's window now and then hands back the bare background."""
    empty = np.ones((2 * ggui.size[0], 2 * ggui.size[1], 4), np.float32)
    empty[..., :3] = BACKGROUND
    window, taken = ggui._window, []

    class Forgetful:
        def get_image_buffer_as_numpy(self):
            taken.append(window.get_image_buffer_as_numpy())
            return empty if len(taken) == 1 else taken[-1]

    monkeypatch.setattr(ggui, "_window", Forgetful())
    image = ggui.render(_red(ggui, shapes), CAMERA).astype(int)
    middle = image[ggui.size[1] // 2, ggui.size[0] // 2]
    assert len(taken) >= 2
    assert middle[0] > middle[1] + 50


def test_vertices_live_until_ggui_reads_them(ggui, shapes):
    """GGUI reads its vertices only when the picture is asked for: memory freed before would be used anew."""
    corners = []
    for _ in range(3):
        ggui._scene.draw(_red(ggui, shapes), CAMERA)
        corners.append(ggui._scene._corners)
        ggui._window.get_image_buffer_as_numpy()
    assert all(array is corners[0] for array in corners)


def test_closing_twice_is_harmless(ggui):
    ggui.close()
    ggui.close()
