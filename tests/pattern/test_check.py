import copy
from dataclasses import replace

import numpy as np
import pytest

from taichi_tryon.errors import PatternError
from taichi_tryon.pattern.check import check, faults
from taichi_tryon.pattern.edge import Edge
from taichi_tryon.pattern.panel import Band, Panel, Pattern, Seam
from taichi_tryon.pattern.spec import PatternSpec


@pytest.fixture
def pattern(tube) -> Pattern:
    return Pattern.from_spec(PatternSpec.model_validate(tube))


def with_front(pattern: Pattern, corners_cm: list[list[float]]) -> Pattern:
    """The pattern with its front's corners moved: bottom left, bottom right, top right, top left."""
    corners = np.array(corners_cm) / 100
    names = ("bottom", "right", "top", "left")
    edges = tuple(
        Edge(name, "line", np.stack(ends))
        for name, *ends in zip(names, corners, np.roll(corners, -1, axis=0), strict=True)
    )
    return replace(pattern, panels={**pattern.panels, "front": Panel("front", edges, np.array([0.0, 1.0]))})


def only_fault(pattern: Pattern):
    (fault,) = faults(pattern)
    return fault


def test_a_good_pattern_has_no_faults(pattern):
    assert faults(pattern) == []
    check(pattern)


def test_open_loop(pattern):
    front = pattern.panels["front"]
    bottom = front.edges[0]
    moved = Edge("bottom", "line", bottom.points - [[0.0, 0.0], [0.01, 0.0]])
    pattern.panels["front"] = replace(front, edges=(moved, *front.edges[1:]))
    fault = only_fault(pattern)
    assert fault.place == ("panels", "front", "edges", 0)
    assert "'front', edge 'bottom' ends 1 cm from where 'right' starts" in fault.message


def test_outline_that_crosses_itself(pattern):
    fault = only_fault(with_front(pattern, [[0, 0], [20, 0], [0, 30], [20, 30]]))
    assert fault.place == ("panels", "front", "edges")
    assert "crosses or touches itself near (10, 15) cm" in fault.message


def test_curve_that_crosses_the_opposite_edge(tube):
    tube["panels"]["front"]["edges"][0] = {"name": "bottom", "curve": ["A", [0, 60], [20, 60], "B"]}
    with pytest.raises(ValueError, match="crosses or touches itself"):
        PatternSpec.model_validate(tube)


def test_flat_arc_and_tiny_edge(pattern):
    front = pattern.panels["front"]
    flat = Edge("bottom", "arc", np.array([[0.0, 0.0], [0.1, 0.0], [0.2, 0.0]]))
    pattern.panels["front"] = replace(front, edges=(flat, *front.edges[1:]))
    assert "lie on a line" in only_fault(pattern).message
    stub = Edge("stub", "line", np.array([[0.2, 0.0], [0.2, 0.0005]]))
    rest = Edge("right", "line", np.array([[0.2, 0.0005], [0.2, 0.3]]))
    pattern.panels["front"] = replace(front, edges=(front.edges[0], stub, rest, *front.edges[2:]))
    assert "edge 'stub': 0.05 cm long" in only_fault(pattern).message


def test_two_edges_of_one_name_and_two_seams_of_one_name(tube):
    tube["panels"]["front"]["edges"][2]["name"] = "bottom"
    tube["seams"][1]["name"] = "side_l"
    with pytest.raises(ValueError, match="2 edges are called 'bottom'") as caught:
        PatternSpec.model_validate(tube)
    assert "2 seams are called 'side_l'" in str(caught.value)


def test_seam_of_a_missing_edge_or_panel(pattern):
    seams = (*pattern.seams, Seam("extra", (("front", "topp"),), (("bak", "top"),)))
    first, second = faults(replace(pattern, seams=seams))
    assert first.place == ("seams", 2, "a", 0) and "no edge 'topp'; there are bottom, right, top, left" in first.message
    assert second.place == ("seams", 2, "b", 0) and "no panel 'bak'; there are front, back" in second.message


def test_bands_along_missing_edges_or_twice(pattern):
    band = Band("elastic", (("front", "topp"), ("front", "top"), ("front", "top")), None, 100.0)
    found = {fault.place: fault.message for fault in faults(replace(pattern, bands=(band, band)))}
    assert "no edge 'topp'" in found["bands", 0, "edges", 0]
    assert "front.top is listed twice" in found["bands", 0, "edges", 2]
    assert "2 bands are called 'elastic'" in found["bands", 1, "name"]


def test_edge_sewn_twice(pattern):
    seams = (*pattern.seams, Seam("extra", (("front", "top"),), (("front", "right"),), ease=0.2))
    fault = only_fault(replace(pattern, seams=seams))
    assert fault.place == ("seams", 2, "b", 0)
    assert "front.right is sewn already, by seam 'side_l'" in fault.message


def test_unequal_seam_beyond_its_ease(pattern):
    longer = with_front(pattern, [[0, 0], [20, 0], [20, 31], [0, 30]])
    fault = only_fault(longer)
    assert fault.place == ("seams", 0)
    assert "31.00 cm long and side b 30.00 cm, but the stated ease is 0 cm" in fault.message
    eased = replace(longer, seams=(replace(longer.seams[0], ease=0.0096), longer.seams[1]))
    assert faults(eased) == []


def test_wrong_direction_would_turn_a_panel_inside_out(pattern, tube):
    twisted = replace(pattern, seams=(replace(pattern.seams[0], reversed=False), pattern.seams[1]))
    fault = only_fault(twisted)
    assert fault.place == ("seams", 0, "direction") and "direction: reverse" in fault.message
    clockwise = copy.deepcopy(tube)
    back = clockwise["panels"]["back"]["edges"]
    back.reverse()
    for edge in back:
        edge["line"].reverse()
    for seam in clockwise["seams"]:
        seam["direction"] = "same"
    PatternSpec.model_validate(clockwise)


def test_chain_in_the_wrong_order(tube):
    for panel in tube["panels"].values():
        panel["points_cm"]["M"] = [20, 12]
        panel["edges"][1:2] = [{"name": "lower", "line": ["B", "M"]}, {"name": "upper", "line": ["M", "C"]}]
    tube["seams"][0]["a"] = [["front", "upper"], ["front", "lower"]]
    tube["seams"][1]["b"] = [["back", "lower"], ["back", "upper"]]
    with pytest.raises(ValueError, match="'lower' comes before 'upper'"):
        PatternSpec.model_validate(tube)


def test_check_raises_everything_in_one_error(pattern):
    seams = (Seam("one", (("front", "x"),), (("front", "y"),)), Seam("two", (("front", "top"),), (("front", "top"),)))
    with pytest.raises(PatternError) as caught:
        check(replace(pattern, seams=seams))
    assert len(caught.value.faults) == 3
    assert all(line.startswith("pattern 'tube': seam '") for line in caught.value.faults)
