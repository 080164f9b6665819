import numpy as np
import pytest

from taichi_tryon.mesh.garment import build
from taichi_tryon.pattern.panel import Pattern
from taichi_tryon.pattern.spec import PatternSpec

SQUARE = {
    "points_cm": {"A": [0, 0], "B": [20, 0], "C": [20, 30], "D": [0, 30]},
    "edges": [
        {"name": "bottom", "line": ["A", "B"]},
        {"name": "right", "line": ["B", "C"]},
        {"name": "top", "line": ["C", "D"]},
        {"name": "left", "line": ["D", "A"]},
    ],
}


def mesh(**band):
    edges = {"edges": [["front", "top"], ["front", "left"]]}
    spec = {"pattern": "square", "panels": {"front": SQUARE}, "bands": [{"name": "tape", **edges, **band}]}
    return build(Pattern.from_spec(PatternSpec.model_validate(spec)), 0.02, "square")


def test_a_tape_follows_its_edges_and_is_as_long():
    garment = mesh(stiffness_N=100)
    points = garment.pattern_points[np.argsort(garment.point_vertex)]
    ends = points[garment.tapes.vertices]
    np.testing.assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), garment.tapes.lengths)
    assert garment.tapes.lengths.sum() == pytest.approx(0.5)
    assert set(garment.tapes.stiffness) == {100.0}
    np.testing.assert_array_equal(garment.tapes.vertices[1:, 0], garment.tapes.vertices[:-1, 1])


def test_a_shorter_tape_is_spread_evenly():
    plain, short = mesh(stiffness_N=100), mesh(stiffness_N=100, length_cm=45)
    np.testing.assert_allclose(short.tapes.lengths, 0.9 * plain.tapes.lengths)


def test_no_band_no_tape(load):
    top = build(load("top_9AR"), 0.03, "top")
    assert len(top.tapes.vertices) == len(top.tapes.lengths) == len(top.tapes.stiffness) == 0
