"""Ranges of the joints: poses beyond them are told, and the shipped body keeps its skin within them."""

from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from taichi_tryon.body.ranges import beyond
from taichi_tryon.body.skeleton import Pose
from taichi_tryon.body.spec import BodySpec, PoseSpec
from taichi_tryon.body.surface import surface_mesh
from taichi_tryon.scene.load import load_part

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def spec(woman_data) -> BodySpec:
    return BodySpec.model_validate(woman_data())


def turned_by(**turns: list[float]) -> PoseSpec:
    return PoseSpec(name="try", rotations_degree=turns)


def test_a_turn_beyond_the_range_is_told_with_joint_axis_and_range(spec):
    (line,) = beyond(turned_by(calf_l=[150, 0, 0]), spec)
    assert line == (
        "pose try: calf_l is turned by 150 degrees about x, beyond its range of -2 to 90 (range_degree of body adult "
        "woman 9AR)"
    )
    assert len(list(beyond(turned_by(thigh_r=[-91, 31, 11]), spec))) == 3


def test_a_turn_up_to_the_range_or_of_no_range_is_not_told(spec):
    # the knee has no range about z, the pelvis none at all
    assert not list(beyond(turned_by(calf_l=[90, 0, 40], pelvis=[0, 170, 0]), spec))


@pytest.mark.parametrize("limits", [[5, 20], [-20, -5], [10, -10]])
def test_a_range_without_the_rest_pose_is_a_fault(woman_data, limits):
    data = woman_data()
    data["bones"]["calf_l"]["range_degree"] = {"x": limits}
    with pytest.raises(ValidationError, match="must hold 0, the rest pose") as caught:
        BodySpec.model_validate(data)
    assert "bones.calf_l.range_degree.x" in str(caught.value)


def test_shipped_poses_lie_within_the_ranges(spec):
    for path in (ROOT / "configs/poses").glob("*.yaml"):
        assert not list(beyond(load_part(path, PoseSpec), spec)), path


def test_left_and_right_have_mirrored_ranges(spec):
    for name, bone in spec.bones.items():
        if name.endswith("_l"):
            mirrored = {a: [-v for v in r[::-1]] if a in "yz" else r for a, r in bone.range_degree.axes.items()}
            assert spec.bones[f"{name[:-2]}_r"].range_degree.axes == mirrored, name


def test_the_skin_keeps_its_volume_and_stays_closed_over_every_range(spec, woman):
    def volume(turns: PoseSpec) -> float:
        pose = Pose.from_spec(turns)
        vertices, triangles = surface_mesh(woman.posed(woman.skeleton.transforms(pose)), 0.025)
        sides = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        assert (np.unique(sides, axis=0, return_counts=True)[1] == 2).all(), turns
        a, b, c = vertices[triangles].transpose(1, 0, 2)
        return float(np.einsum("ki,ki->k", a, np.cross(b, c)).sum() / 6)

    rest, tried = volume(turned_by()), 0
    for name, bone in spec.bones.items():
        for axis, limits in bone.range_degree.axes.items():
            for turn in limits if not name.endswith("_r") else ():
                turns = turned_by(**{name: [turn if a == axis else 0.0 for a in "xyz"]})
                assert volume(turns) == pytest.approx(rest, rel=0.03), turns
                tried += 1
    assert tried > 40
