import pytest
from pydantic import ValidationError

from taichi_tryon.body.spec import BodySpec, PoseSpec


def _message(data: dict) -> str:
    with pytest.raises(ValidationError) as caught:
        BodySpec.model_validate(data)
    return str(caught.value)


def test_shipped_body_has_the_papers_size(woman_data):
    spec = BodySpec.model_validate(woman_data())
    assert (len(spec.balls), len(spec.groups), len(spec.bones)) == (100, 5, 22)


@pytest.mark.parametrize("key", ["center_cm", "radii_cm", "weight", "groups", "bones"])
def test_missing_key_of_a_ball_is_a_fault(woman_data, key):
    data = woman_data()
    del data["balls"]["leg_l_03"][key]
    assert f"balls.leg_l_03.{key}" in _message(data)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("radii_cm", [1.0, 0.0, 1.0], "greater than or equal to 0.01"),
        ("radii_cm", [float("inf")] * 3, "at least one must be finite"),
        ("radii_cm", [float("nan"), 1.0, 1.0], "greater than or equal to 0.01"),
        ("center_cm", [float("inf"), 1.0, 1.0], "finite"),
        ("weight", -1.0, "greater than or equal to 0.000001"),
        ("groups", ["tail"], "no group 'tail'"),
        ("bones", {"tail": 1.0}, "no bone 'tail'"),
        ("bones", {"pelvis": 0.5, "thigh_l": 0.4}, "sum to 0.9"),
        ("color", "red", "Extra inputs"),
    ],
)
def test_bad_ball_is_a_fault(woman_data, key, value, words):
    data = woman_data()
    data["balls"]["leg_l_03"][key] = value
    assert words in _message(data)


def test_parent_must_stand_before_its_child(woman_data):
    data = woman_data()
    data["bones"]["thigh_l"]["parent"] = "ball_l"
    assert "no bone 'ball_l' stands before 'thigh_l'" in _message(data)


def test_second_root_is_a_fault(woman_data):
    data = woman_data()
    data["bones"]["thigh_l"]["parent"] = None
    assert "second root beside 'pelvis'" in _message(data)


@pytest.mark.parametrize("part", ["landmarks", "measurements"])
def test_bone_of_a_mark_must_exist(woman_data, part):
    data = woman_data()
    next(iter(data[part].values()))["bone"] = "tail"
    assert "no bone 'tail'" in _message(data)


def test_pose_takes_whole_numbers_and_refuses_two():
    assert PoseSpec.model_validate({"name": "p", "rotations_degree": {"a": [0, 0, 31]}}).rotations_degree["a"][2] == 31
    with pytest.raises(ValidationError):
        PoseSpec.model_validate({"name": "p", "rotations_degree": {"a": [0, 31]}})
