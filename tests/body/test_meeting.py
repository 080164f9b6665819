"""Limbs that run into each other are told from limbs that are joined."""

import numpy as np
import pytest

from taichi_tryon.body.density import density
from taichi_tryon.body.meeting import meeting


def creases(balls, one, other, points):
    """Points where the skins of two groups cross."""
    away = np.abs([density(balls, points, (group,)) - 1 for group in (one, other)]).max(axis=0)
    return points[np.argsort(away)[:5]]


@pytest.fixture
def lattice():
    """Makes points 4 mm apart within 6 cm of a place [m]."""
    steps = np.arange(-0.06, 0.061, 0.004)
    around = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    return lambda place: np.array(place) + around


def test_a_hand_in_the_thigh(woman, turned, lattice):
    hand_in_thigh = {"upperarm_r": [27, -25, 28], "lowerarm_r": [0, 95, 0], "thigh_r": [-68, 12, -35]}
    balls = woman.posed(woman.skeleton.transforms(turned(**hand_in_thigh, calf_r=[44, 0, 0], spine_01=[15, 6, 0])))
    arm, leg = woman.group_names.index("arm_r"), woman.group_names.index("leg_r")
    for place in creases(balls, arm, leg, lattice([-0.09, 0.86, -0.05])):
        assert meeting(balls, place) == (arm, leg)


@pytest.mark.parametrize("name", ["arms_raised_45", "standing"])
@pytest.mark.parametrize(("limb", "bone"), [("arm_l", "upperarm_l"), ("leg_r", "thigh_r")])
def test_where_a_limb_is_joined(woman, pose, lattice, name, limb, bone):
    transforms = woman.skeleton.transforms(pose(name))
    balls = woman.posed(transforms)
    joint = transforms[woman.skeleton.index(bone)] @ np.append(woman.skeleton.heads[woman.skeleton.index(bone)], 1)
    trunk, group = (woman.group_names.index(each) for each in ("trunk", limb))
    for place in creases(balls, trunk, group, lattice(joint[:3])):
        assert meeting(balls, place) is None
    assert meeting(balls, joint[:3] + [0, 0, 0.5]) is None
