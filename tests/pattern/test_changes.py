"""What a scene changes about a pattern: openings and tapes, and what it cannot change."""

import pytest
from pydantic import ValidationError

from taichi_tryon.pattern.changes import OpeningSpec, changed, faults
from taichi_tryon.pattern.panel import Band, Pattern
from taichi_tryon.pattern.spec import BandSpec, PatternSpec, SeamSpec


@pytest.fixture
def pattern(tube) -> Pattern:
    """The tube with a zip on its left and an elastic along its top."""
    tube["seams"][0]["closure"] = "zip"
    tube["bands"] = [{"name": "elastic", "edges": [["front", "top"], ["back", "top"]], "stiffness_N": 30.0}]
    return Pattern.from_spec(PatternSpec.model_validate(tube))


def band(name: str, *edges, **values) -> BandSpec:
    return BandSpec(name=name, edges=[list(edge) for edge in edges], **values)


def test_an_opening_is_in_metres_along_its_own_seam(pattern):
    opened = changed(
        pattern, [OpeningSpec(seam="side_l", from_cm=5.0, to_cm=12.0), OpeningSpec(seam="side_l", from_cm=20.0)], []
    )
    assert opened.seams[0].openings == (pytest.approx((0.05, 0.12)), pytest.approx((0.2, 0.3)))
    assert opened.seams[1].openings == () and opened.bands == pattern.bands


def test_a_band_comes_on_top_or_takes_the_place_of_its_name(pattern):
    hem = band("hem", ("front", "bottom"), stiffness_N=5.0)
    short = band("elastic", ("front", "top"), length_cm=15.0, tension_N=3.0, at_stretch_percent=40.0)
    assert [b.name for b in changed(pattern, [], [hem]).bands] == ["elastic", "hem"]
    (found,) = changed(pattern, [], [short]).bands
    assert found == Band("elastic", (("front", "top"),), pytest.approx(0.15), pytest.approx(7.5))


@pytest.mark.parametrize(
    ("opening", "key", "message"),
    [
        ({"seam": "side"}, "seam", "'side' of pattern 'tube' is not there; seams with a zip or buttons: side_l"),
        ({"seam": "side_r"}, "seam", "'side_r' of pattern 'tube' has no closure; seams with a zip or buttons: side_l"),
        ({"seam": "side_l", "to_cm": 31.0}, "to_cm", "is 30 cm long (got 31)"),
        ({"seam": "side_l", "from_cm": 9.0, "to_cm": 9.0}, "from_cm", "must begin before its end at 9 cm"),
        ({"seam": "side_l", "from_cm": 30.0}, "from_cm", "must begin before its end at 30 cm"),
    ],
)
def test_openings_that_cannot_be(pattern, opening, key, message):
    (fault,) = faults(pattern, [OpeningSpec(**opening)], [])
    assert fault.place == ("open", 0, key) and message in fault.message


def test_bands_along_edges_that_are_not_there(pattern):
    (fault,) = faults(pattern, [], [band("hem", ("front", "hem"), stiffness_N=5.0)])
    assert fault.place == ("bands", 0, "edges", 0) and "no edge 'hem'" in fault.message


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"tension_N": 3.0},
        {"at_stretch_percent": 40.0},
        {"stiffness_N": 5.0, "tension_N": 3.0, "at_stretch_percent": 40.0},
    ],
)
def test_a_band_has_one_stiffness(values):
    with pytest.raises(ValidationError, match="band 'hem': give stiffness_N, or tension_N with at_stretch_percent"):
        band("hem", ("front", "bottom"), **values)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"closure": "buttons"}, "go together"),
        ({"closure": "zip", "buttons_cm": [1.0]}, "go together"),
        ({"buttons_cm": [1.0]}, "go together"),
        ({"closure": "buttons", "buttons_cm": [5.0, 1.0]}, "the places must rise"),
    ],
)
def test_buttons_have_places_that_rise(values, message):
    with pytest.raises(ValidationError, match=message):
        SeamSpec(name="s", a=[["front", "right"]], b=[["back", "left"]], **values)


def test_a_button_beyond_its_seam(tube):
    tube["seams"][0] |= {"closure": "buttons", "buttons_cm": [1.0, 31.0]}
    with pytest.raises(ValidationError, match="a button at 31 cm of a side that is 30 cm long"):
        PatternSpec.model_validate(tube)
