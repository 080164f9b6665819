import numpy as np
import pytest

from taichi_tryon.body.density import density
from taichi_tryon.body.model import _nearest_rotations
from taichi_tryon.body.skeleton import Pose, rotation_matrix
from taichi_tryon.errors import InputError


def test_trunk_balls_are_copied_into_limbs(woman):
    trunk, left, right = (woman.balls.membership[:, k] for k in woman.groups("trunk", "leg_l", "leg_r"))
    assert (trunk & left).any() and (trunk & right).any()
    assert not (left & right & ~trunk).any()


def test_body_is_symmetric(woman):
    x = np.random.default_rng(0).uniform([-0.5, 0, -0.1], [0.5, 1.5, 0.2], (20000, 3))
    np.testing.assert_allclose(density(woman.balls, x), density(woman.balls, x * [-1, 1, 1]), atol=2e-3)


def test_rest_pose_gives_the_balls_back(woman, pose):
    posed = woman.posed(woman.skeleton.transforms(pose("arms_raised_45")))
    np.testing.assert_allclose(posed.centers, woman.balls.centers, atol=1e-14)
    np.testing.assert_allclose(posed.axes, woman.balls.axes, atol=1e-14)


def test_moving_the_whole_body_moves_its_density(woman):
    turn = rotation_matrix([20, 30, 40])
    shift = np.array([0.1, 0.2, 0.3])
    root = woman.skeleton.heads[0]
    posed = woman.posed(woman.skeleton.transforms(Pose("moved", {"pelvis": turn}, shift)))
    x = np.random.default_rng(1).uniform([-0.3, 0.6, -0.1], [0.3, 1.4, 0.2], (2000, 3))
    np.testing.assert_allclose(density(posed, (x - root) @ turn.T + root + shift), density(woman.balls, x), atol=1e-10)


def test_ball_between_two_bones_turns_half_way(woman, turned):
    posed = woman.posed(woman.skeleton.transforms(turned(calf_l=[60, 0, 0])))
    axes = np.swapaxes(posed.axes, 1, 2) @ posed.axes
    np.testing.assert_allclose(axes, np.tile(np.eye(3), (100, 1, 1)), atol=1e-13)
    half = _nearest_rotations(0.5 * (np.eye(3) + rotation_matrix([60, 0, 0]))[None])[0]
    np.testing.assert_allclose(half, rotation_matrix([30, 0, 0]), atol=1e-14)


def test_nearest_rotation_never_mirrors():
    assert np.linalg.det(_nearest_rotations(np.diag([1.0, 1.0, -0.1])[None])[0]) == pytest.approx(1)


def test_landmark_moves_with_its_bone(woman, turned):
    transforms = woman.skeleton.transforms(turned(upperarm_l=[0, 0, -45]))
    shoulder, elbow = woman.landmark("shoulder_l", transforms), woman.landmark("elbow_l", transforms)
    np.testing.assert_allclose((elbow - shoulder)[[0, 2]], 0, atol=1e-4)
    with pytest.raises(InputError, match="no landmark 'tail'"):
        woman.landmark("tail", transforms)


def test_lines_lie_inside_and_points_on_the_skin(woman):
    lines = [mark.position for name, mark in woman.landmarks.items() if "line" in name]
    assert (density(woman.balls, np.array(lines)) > 1).all()


def test_extents_bound_the_density(woman):
    balls = woman.balls
    directions = np.random.default_rng(2).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for k in range(0, 100, 9):
        border = balls.centers[k] + (directions * balls.radii[k]) @ balls.axes[k].T
        reach = np.abs(border - balls.centers[k])
        assert (reach <= balls.extents[k] + 1e-12).all()
        assert (reach.max(axis=0) > 0.95 * balls.extents[k]).all()
