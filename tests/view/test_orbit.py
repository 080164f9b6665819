import numpy as np
import pytest

from taichi_tryon.view.camera import Camera, view_camera
from taichi_tryon.view.orbit import Controls, Orbit

BOX = (np.array([-0.5, 0.0, -0.15]), np.array([0.5, 1.6, 0.2]))


@pytest.mark.parametrize("view", ["front", "back", "right", "left", "three_quarter"])
def test_orbit_starts_where_the_view_is(view):
    camera = view_camera(view, BOX, 1.0)
    np.testing.assert_allclose(Orbit.of(camera).camera.eye, camera.eye, atol=1e-9)


def test_top_view_stays_short_of_the_pole():
    camera = Orbit.of(view_camera("top", BOX, 1.0)).camera
    assert np.isfinite(camera.axes).all()
    assert camera.axes[2][1] > 0.999


def test_the_object_follows_the_hand():
    orbit = Orbit(np.zeros(3), 4.0)
    nose, size = np.array([[0, 0, 0.1]]), (100, 100)
    before = orbit.camera.project(nose, size)[0]
    right, up = orbit.turned(0.05, 0.0), orbit.turned(0.0, 0.05)
    assert right.camera.project(nose, size)[0, 0] > before[0]
    assert up.camera.project(nose, size)[0, 1] < before[1]
    moved = orbit.moved(0.1, 0.2, 1.0).camera.project(np.zeros((1, 3)), size)[0]
    np.testing.assert_allclose(moved, [60, 30], atol=1e-9)


def test_orbit_keeps_its_distance_and_never_turns_over():
    orbit = Orbit(np.array([0, 1.0, 0]), 4.0)
    for _ in range(50):
        orbit = orbit.turned(0.13, -0.09)
        assert orbit.camera.distance == pytest.approx(4.0)
        assert orbit.camera.axes[1][1] > 0
    assert orbit.nearer(1e9).distance == 0.3
    assert orbit.nearer(2.0).distance == 2.0


def test_space_pauses_and_n_makes_single_steps():
    controls = Controls(BOX, 1.0)
    assert [controls.take_step(), controls.take_step()] == [True, True]
    controls.press(" ")
    assert not controls.take_step()
    controls.press("n")
    assert [controls.take_step(), controls.take_step()] == [True, False]
    controls.press(" ")
    assert controls.take_step()
    controls.press("n")
    assert controls.paused
    assert [controls.take_step(), controls.take_step()] == [True, False]


def test_reset_and_quit_are_told_once():
    controls = Controls(BOX, 1.0)
    controls.press("r")
    assert [controls.take_reset(), controls.take_reset()] == [True, False]
    assert not controls.quit
    controls.press("Escape")
    assert controls.quit


def test_arrows_go_through_the_views_and_change_the_distance():
    controls = Controls(BOX, 1.0, ("front", "right", "back"))
    front = controls.orbit
    controls.press("Right")
    np.testing.assert_allclose(controls.orbit.camera.axes[2], [-1, 0, 0], atol=1e-9)
    controls.press("Left")
    controls.press("Left")
    np.testing.assert_allclose(controls.orbit.camera.axes[2], [0, 0, -1], atol=1e-9)
    controls.press("Right")
    assert controls.orbit == front
    controls.press("Up")
    assert controls.orbit.distance < front.distance
    controls.press("Down")
    assert controls.orbit.distance == pytest.approx(front.distance)


def test_mouse_acts_only_while_a_button_is_down():
    controls = Controls(BOX, 1.0)
    start = controls.orbit
    for x in (0.1, 0.5, 0.9):
        controls.mouse((x, 0.5), False, False)
    controls.mouse((0.2, 0.5), True, False)  # pressed here: nothing has moved yet
    assert controls.orbit is start
    controls.mouse((0.3, 0.5), True, False)
    assert controls.orbit.azimuth == pytest.approx(start.azimuth - 0.2 * np.pi)
    controls.mouse((0.9, 0.9), False, False)
    controls.mouse((0.4, 0.4), False, True)
    controls.mouse((0.4, 0.5), False, True)
    assert controls.orbit.target[1] < start.target[1]
    assert isinstance(controls.orbit.camera, Camera)
