import numpy as np
import pytest

from taichi_tryon.body.skeleton import Motion, Pose, rotation_matrix
from taichi_tryon.errors import InputError


def test_rotation_is_about_x_then_y_then_z():
    x, y = rotation_matrix([90, 0, 0]), rotation_matrix([0, 90, 0])
    np.testing.assert_allclose(rotation_matrix([90, 90, 0]), y @ x, atol=1e-15)
    np.testing.assert_allclose(rotation_matrix([90, 0, 0]) @ [0, 1, 0], [0, 0, 1], atol=1e-15)


def test_rest_pose_moves_nothing(woman, pose):
    np.testing.assert_array_equal(woman.skeleton.transforms(pose("arms_raised_45")), np.tile(np.eye(4), (22, 1, 1)))


def test_joint_stays_and_carries_its_children(woman, turned):
    transforms = woman.skeleton.transforms(turned(upperarm_l=[0, 0, -45]))
    shoulder, elbow = (woman.skeleton.index(name) for name in ("upperarm_l", "lowerarm_l"))
    head = woman.skeleton.heads[shoulder]
    arm = woman.skeleton.heads[elbow] - head
    moved = transforms[elbow] @ np.append(woman.skeleton.heads[elbow], 1)
    np.testing.assert_allclose(transforms[shoulder] @ np.append(head, 1), np.append(head, 1), atol=1e-14)
    # The arm points 45 degrees down at rest, so that it hangs now.
    np.testing.assert_allclose(moved[:3] - head, [0, -np.linalg.norm(arm), 0], atol=1e-6)
    np.testing.assert_array_equal(transforms[woman.skeleton.index("thigh_l")], np.eye(4))


def test_childs_turn_is_relative_to_its_parent(woman, turned):
    transforms = woman.skeleton.transforms(turned(thigh_r=[-28, 0, 5], calf_r=[12, 0, 0]))
    expected = rotation_matrix([-28, 0, 5]) @ rotation_matrix([12, 0, 0])
    np.testing.assert_allclose(transforms[woman.skeleton.index("foot_r")][:3, :3], expected, atol=1e-14)


def test_translation_shifts_all(woman):
    transforms = woman.skeleton.transforms(Pose("shifted", translation=np.array([1.0, 2.0, 3.0])))
    np.testing.assert_allclose(transforms[:, :3, 3], np.tile([1.0, 2.0, 3.0], (22, 1)), atol=1e-14)


def test_unknown_bone_is_named(woman, turned):
    with pytest.raises(InputError, match="no bone 'tail'; bones: pelvis"):
        woman.skeleton.transforms(turned(tail=[0, 0, 1]))


def test_motion_meets_its_poses_and_stands_still_outside(woman, pose):
    start, end = pose("standing"), pose("arms_raised_45")
    motion = Motion(woman.skeleton, (0.5, 1.5), (start, end))
    assert motion.end_time == 1.5
    for time, at in ((0.0, start), (0.5, start), (1.5, end), (9.0, end)):
        np.testing.assert_allclose(motion.transforms(time), woman.skeleton.transforms(at), atol=1e-14)


def test_motion_is_smooth(woman, pose):
    poses = [pose(name) for name in ("standing", "step_forward_right", "arms_raised_45")]
    motion = Motion(woman.skeleton, (0.0, 1.0, 1.5), tuple(poses))
    h = 1e-5
    times = np.linspace(-0.2, 1.7, 381)

    def velocity(time):
        return (motion.transforms(time + h) - motion.transforms(time - h)) / (2 * h)

    velocities = np.array([velocity(time) for time in times])
    # A jump of the velocity would show as a change that does not shrink with the time between samples.
    assert np.abs(np.diff(velocities, axis=0)).max() < 0.06 * np.abs(velocities).max()
    for time in motion.times:
        assert np.abs(velocity(time)).max() < 1e-3


def test_halfway_is_half_the_turn(woman, turned):
    motion = Motion(woman.skeleton, (0.0, 2.0), (turned(), turned(upperarm_l=[0, 0, -40])))
    halfway = woman.skeleton.transforms(turned(upperarm_l=[0, 0, -20]))
    np.testing.assert_allclose(motion.transforms(1.0), halfway, atol=1e-14)


def test_still_motion_ends_at_once(woman, pose):
    motion = Motion.still(woman.skeleton, pose("standing"))
    assert motion.end_time == 0
    np.testing.assert_array_equal(motion.transforms(3.0), woman.skeleton.transforms(pose("standing")))


def test_times_must_grow(woman, turned):
    with pytest.raises(ValueError, match="must grow"):
        Motion(woman.skeleton, (0.0, 0.0), (turned(), turned()))
