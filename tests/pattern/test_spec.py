import numpy as np
import pytest
from pydantic import ValidationError

from taichi_tryon.pattern.panel import Pattern
from taichi_tryon.pattern.spec import PatternSpec


def faults(data: dict) -> dict[tuple, str]:
    """Place and message of every fault."""
    with pytest.raises(ValidationError) as caught:
        PatternSpec.model_validate(data)
    return {error["loc"]: error["msg"] for error in caught.value.errors()}


def test_centimetres_become_metres_and_names_become_points(tube):
    pattern = Pattern.from_spec(PatternSpec.model_validate(tube))
    front = pattern.panels["front"]
    assert front.edge("right").points == pytest.approx(np.array([[0.2, 0.0], [0.2, 0.3]]))
    assert front.area == pytest.approx(0.06)
    assert np.array_equal(front.grain, [0, 1])
    assert pattern.seams[0].reversed and pattern.seams[0].a == (("front", "right"),)


def test_grain_is_a_unit_vector_and_levels_are_metres(tube):
    tube["panels"]["front"] |= {"grain": [3, 4], "levels_cm": {"waist": 10}}
    front = Pattern.from_spec(PatternSpec.model_validate(tube)).panels["front"]
    assert front.grain == pytest.approx([0.6, 0.8])
    assert front.levels == {"waist": pytest.approx(0.1)}


def test_curves_and_arcs_take_points_by_name_or_by_coordinates(tube):
    edges = tube["panels"]["front"]["edges"]
    edges[0] = {"name": "bottom", "curve": ["A", [5, -2], [15, -2], "B"]}
    edges[2] = {"name": "top", "arc": ["C", [10, 35.5], [0, 30]]}
    front = Pattern.from_spec(PatternSpec.model_validate(tube)).panels["front"]
    assert [edge.kind for edge in front.edges] == ["cubic", "line", "arc", "line"]
    assert front.edge("top").points[1] == pytest.approx([0.1, 0.355])


def test_a_mirrored_panel_keeps_names_and_sense(tube):
    tube["panels"]["front"]["grain"] = [1, 2]
    tube["mirrored_panels"] = {"front_m": "front"}
    pattern = Pattern.from_spec(PatternSpec.model_validate(tube))
    front, image = pattern.panels["front"], pattern.panels["front_m"]
    assert image.mirror_of == "front"
    assert image.signed_area == pytest.approx(front.signed_area)
    assert image.edge("right").points == pytest.approx(front.edge("right").points[::-1] * [-1, 1])
    assert image.grain == pytest.approx(front.grain * [-1, 1])
    assert all(
        np.array_equal(edge.end, following.start)
        for edge, following in zip(image.edges, (*image.edges[1:], image.edges[0]), strict=True)
    )


def test_two_shapes_or_none_are_refused(tube):
    edges = tube["panels"]["front"]["edges"]
    edges[0]["arc"] = ["A", [10, -3], "B"]
    del edges[1]["line"]
    found = faults(tube)
    assert "exactly one of line, curve and arc" in found["panels", "front", "edges", 0]
    assert "exactly one of line, curve and arc" in found["panels", "front", "edges", 1]


def test_a_point_that_is_neither_name_nor_pair_gives_one_message(tube):
    tube["panels"]["front"]["edges"][0]["line"] = ["A", [1, 2, 3]]
    found = faults(tube)
    assert list(found) == [("panels", "front", "edges", 0, "line", 1)]
    assert "two coordinates" in next(iter(found.values()))


def test_unknown_points_panels_and_keys_are_named_where_they_stand(tube):
    tube["panels"]["front"]["edges"][0]["line"] = ["A", "Z"]
    tube["mirrored_panels"] = {"other": "side"}
    found = faults(tube)
    assert "no point 'Z'" in found["panels", "front", "edges", 0, "line", 1]
    assert "no panel 'side'" in found["mirrored_panels", "other"]
    tube["panels"]["front"]["colour"] = "red"
    assert ("panels", "front", "colour") in faults(tube)


def test_all_faults_come_at_once_with_their_places(tube):
    tube["panels"]["back"]["grain"] = [0, 0]
    tube["seams"].append({"name": "third", "a": [["front", "right"]], "b": [["front", "no_such"]]})
    found = faults(tube)
    assert set(found) == {("panels", "back", "grain"), ("seams", 2, "a", 0), ("seams", 2, "b", 0)}
