from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image
from shapely import Polygon

from taichi_tryon.errors import InputError
from taichi_tryon.pattern.draw import GAP, SHEET_WIDTH, draw, layout
from taichi_tryon.pattern.measure import panel_rows, seam_rows
from taichi_tryon.pattern.panel import Pattern
from taichi_tryon.pattern.spec import PatternSpec

TROUSERS = Path(__file__).parents[2] / "configs" / "patterns" / "trousers_9AR.yaml"


@pytest.fixture(scope="module")
def trousers() -> Pattern:
    return Pattern.from_spec(PatternSpec.model_validate(yaml.safe_load(TROUSERS.read_text(encoding="utf-8"))))


def test_svg_names_panels_edges_and_seams_and_is_the_same_every_time(trousers, tmp_path):
    first, second = tmp_path / "first.svg", tmp_path / "second.svg"
    draw(trousers, first)
    draw(trousers, second)
    text = first.read_text(encoding="utf-8")
    assert text == second.read_text(encoding="utf-8")
    # matplotlib leaves every drawn text in a comment
    for panel in trousers.panels.values():
        assert f"<!-- {panel.name}" in text
        assert all(f"<!-- {edge.name} -->" in text for edge in panel.edges)
    darts = {10, 11, 17, 18}
    for number in range(1, len(trousers.seams) + 1):
        assert text.count(f"<!-- {number} -->") == (1 if number in darts else 2)


def test_png_has_coloured_seams_on_white(trousers, tmp_path):
    draw(trousers, tmp_path / "trousers.PNG")
    pixels = np.asarray(Image.open(tmp_path / "trousers.PNG").convert("RGB")).astype(int)
    assert (pixels[0] == 255).all() and (pixels[:, 0] == 255).all()
    colourful = np.ptp(pixels, axis=2) > 120
    assert 0.001 < colourful.mean() < 0.05


def test_another_format_is_refused(trousers, tmp_path):
    with pytest.raises(InputError, match=r"\.svg or \.png"):
        draw(trousers, tmp_path / "trousers.pdf")


def test_panels_are_laid_out_apart_and_within_the_sheet(trousers):
    offsets = layout(trousers)
    boxes = []
    for name, panel in trousers.panels.items():
        outline = panel.outline() + offsets[name]
        boxes.append((outline.min(axis=0), outline.max(axis=0)))
    assert max(high[0] for _, high in boxes) <= SHEET_WIDTH
    for i, (low, high) in enumerate(boxes):
        for other_low, other_high in boxes[:i]:
            assert (np.maximum(low - other_high, other_low - high) >= GAP - 1e-9).any()
    assert offsets["front_r"][0] < offsets["front_l"][0]


def test_rows_give_the_figures_of_the_pattern(trousers):
    seams = {row.name: row for row in seam_rows(trousers)}
    assert seams["inseam_thigh_l"].length_a == pytest.approx(0.26036, abs=5e-5)
    assert abs(seams["inseam_thigh_l"].difference) < 1e-5
    assert seams["dart_back_l"].side_a == "back_l.dart_side"
    panels = {row.name: row for row in panel_rows(trousers)}
    for name in ("front_l", "back_r"):
        assert panels[name].area == pytest.approx(Polygon(trousers.panels[name].outline(400)).area, abs=1e-6)
