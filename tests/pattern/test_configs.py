"""The patterns that are shipped, against what their drafts say."""

from pathlib import Path

import pytest
import yaml

from taichi_tryon.pattern.panel import Pattern
from taichi_tryon.pattern.spec import PatternSpec

FOLDER = Path(__file__).parents[2] / "configs" / "patterns"


def load(name: str) -> Pattern:
    return Pattern.from_spec(PatternSpec.model_validate(yaml.safe_load((FOLDER / name).read_text(encoding="utf-8"))))


def lengths_cm(pattern: Pattern, *edges: tuple[str, str]) -> float:
    return 100 * pattern.side_length(edges)


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.yaml")), ids=lambda path: path.stem)
def test_says_what_it_was_drafted_from_and_is_named_like_its_file(path):
    spec = PatternSpec.model_validate(yaml.safe_load(path.read_text(encoding="utf-8")))
    assert spec.pattern == path.stem
    assert spec.drafted_from is not None and spec.drafted_from.measurements_cm and spec.drafted_from.reasons


@pytest.mark.parametrize("name", ["top_9AR.yaml", "top_dart_9AR.yaml", "jumpsuit_9AR.yaml"])
def test_neckline_and_sleeve_of_tops(name):
    top = load(name)
    body = "body_" if "jumpsuit" in name else ""
    necks = [
        (f"{body}front_l", "neck"),
        (f"{body}front_r", "neck"),
        (f"{body}back", "neck_l"),
        (f"{body}back", "neck_r"),
    ]
    assert lengths_cm(top, *necks) == pytest.approx(39.4, abs=0.02)
    assert lengths_cm(top, ("sleeve_l", "hem")) == pytest.approx(21.08, abs=0.02)
    cap = [("sleeve_l", f"cap_{part}") for part in ("front_lower", "front_upper", "back_upper", "back_lower")]
    armhole = [
        (f"{body}front_l", "armhole_lower"), (f"{body}front_l", "armhole_upper"),
        (f"{body}back", "armhole_upper_l"), (f"{body}back", "armhole_lower_l"),
    ]  # fmt: skip
    assert lengths_cm(top, *cap) - lengths_cm(top, *armhole) == pytest.approx(1.8, abs=0.01)


def test_top_has_ease_at_bust_and_hem():
    top = load("top_9AR.yaml")
    assert lengths_cm(top, ("front_l", "hem"), ("front_r", "hem"), ("back", "hem")) == pytest.approx(96.2, abs=0.01)
    underarm_front = top.panels["front_l"].edge("side_upper").end
    underarm_back = top.panels["back"].edge("side_upper_r").end
    bust = 2 * 100 * (underarm_front[0] + underarm_back[0])
    assert bust - 83 == pytest.approx(10, abs=0.01)


def test_waists_hold_at_64_cm():
    trousers = load("trousers_9AR.yaml")
    waist = [(panel, f"waist_{part}") for panel in trousers.panels for part in ("side", "centre")]
    assert lengths_cm(trousers, *waist) == pytest.approx(64, abs=0.02)
    skirt = load("skirt_9AR.yaml")
    waist = [(panel, f"waist_{part}") for panel in ("front", "back") for part in ("left", "right")]
    assert lengths_cm(skirt, *waist) == pytest.approx(64, abs=0.02)


def test_crotch_seam_and_hems_of_trousers():
    trousers = load("trousers_9AR.yaml")
    crotch = [(panel, edge) for panel in ("front_l", "back_l") for edge in ("centre_upper", "crotch")]
    assert lengths_cm(trousers, *crotch) == pytest.approx(76.91, abs=0.02)
    assert lengths_cm(trousers, ("front_l", "hem"), ("back_l", "hem")) == pytest.approx(32.2, abs=0.03)
