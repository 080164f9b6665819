import numpy as np
import pytest

from taichi_tryon.errors import InputError
from taichi_tryon.view.camera import VIEWS, Camera, bounds_of, view_camera, view_cameras

BOX = (np.array([-0.5, 0.0, -0.15]), np.array([0.5, 1.6, 0.2]))
CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (0.0, 1.6) for z in (-0.15, 0.2)])


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
def test_view_shows_the_whole_box_and_wastes_no_room(name, aspect):
    size = (300 * aspect, 300)
    pixels = view_camera(name, BOX, aspect).project(CORNERS, size) / size
    assert pixels.min() >= 0.05 - 1e-9
    assert pixels.max() <= 0.95 + 1e-9
    assert pixels.max() > 0.9


@pytest.mark.parametrize(
    ("name", "to_the_right"),
    [("front", [1, 0, 0]), ("back", [-1, 0, 0]), ("right", [0, 0, 1]), ("left", [0, 0, -1]), ("top", [1, 0, 0])],
)
def test_directions_in_the_picture(name, to_the_right):
    camera = view_camera(name, BOX, 1.0)
    np.testing.assert_allclose(camera.axes[0], to_the_right, atol=1e-12)
    np.testing.assert_allclose(camera.axes @ camera.axes.T, np.eye(3), atol=1e-12)


def test_right_is_seen_from_the_wearers_right():
    assert view_camera("right", BOX, 1.0).eye[0] < -1


def test_projection_of_a_known_point():
    camera = Camera(np.array([0, 0, 2.0]), np.zeros(3), fov_deg=90.0)
    np.testing.assert_allclose(camera.project(np.array([[1.0, 0.5, 0.0]]), (200, 100)), [[125.0, 37.5]])
    assert camera.metres_per_pixel(100) == pytest.approx(0.04)


def test_views_side_by_side_have_one_scale():
    cameras = view_cameras(["front", "right", "back"], BOX, 0.75)
    assert list(cameras) == ["front", "right", "back"]
    assert np.ptp([camera.distance for camera in cameras.values()]) < 1e-12
    assert cameras["front"].distance == pytest.approx(view_camera("front", BOX, 0.75).distance, rel=0.2)


def test_unknown_view_is_said():
    with pytest.raises(InputError, match="unknown view 'behind'; allowed are front, back"):
        view_camera("behind", BOX, 1.0)


def test_bounds():
    low, high = bounds_of([np.array([[0, 1, 2.0]]), np.array([[-1, 5, 0.0], [0, 0, 0]])])
    np.testing.assert_array_equal([low, high], [[-1, 0, 0], [0, 5, 2]])
