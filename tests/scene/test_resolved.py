"""The resolved scene repeats a run: reading it gives the same scene, with no other file at hand."""

from pathlib import Path

import pytest

from taichi_tryon.scene.load import load_scene
from taichi_tryon.scene.resolved import to_yaml

CONFIGS = Path(__file__).parents[2] / "configs"


def again(scene, folder):
    path = folder / "resolved.yaml"
    path.write_text(to_yaml(scene), encoding="utf-8")
    return load_scene(path)


def test_round_trip(small, tmp_path):
    alone = tmp_path / "alone"
    alone.mkdir()
    scene = load_scene(small.scene)
    assert again(scene, alone) == scene


def test_defaults_are_written(small):
    assert "damping_time_s: 0.0" in to_yaml(load_scene(small.scene))


@pytest.mark.parametrize(
    "text", ["1e3", "12", "no", "null", "~", ".inf", "é: #x", "- a", "", "1.0", "=", "012", "0x1f"]
)
def test_texts_stay_texts(small, tmp_path, text):
    quoted = text.replace("'", "''")
    scene = load_scene(small.scene, [f"body.provenance='{quoted}'"])
    assert scene.body.provenance == text
    assert again(scene, tmp_path) == scene


def test_infinite_radius(small, tmp_path):
    scene = load_scene(small.scene, ["body.balls.ball.radii_cm=[20, .inf, 20]"])
    assert again(scene, tmp_path) == scene


def test_shipped_scene(tmp_path):
    scene = load_scene(CONFIGS / "scenes" / "shirt_arms_raised.yaml")
    assert again(scene, tmp_path) == scene
