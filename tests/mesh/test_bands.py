import numpy as np
import pytest

from taichi_tryon.mesh.garment import build
from taichi_tryon.pattern.panel import Band, Pattern


@pytest.fixture
def mesh(polygon_panel):
    """Makes a rectangle with a tape along its upper and left sides."""

    def make(length=None):
        panel = polygon_panel("front", [[0, 0], [0.2, 0], [0.2, 0.3], [0, 0.3]])
        band = Band("tape", (("front", "e2"), ("front", "e3")), length, 100.0)
        return build(Pattern("square", {"front": panel}, (), (band,)), 0.02, "square")

    return make


def test_a_tape_follows_its_edges_and_is_as_long(mesh):
    garment = mesh()
    points = garment.pattern_points[np.argsort(garment.point_vertex)]
    ends = points[garment.tapes.vertices]
    np.testing.assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), garment.tapes.lengths)
    assert garment.tapes.lengths.sum() == pytest.approx(0.5)
    assert set(garment.tapes.stiffness) == {100.0}
    np.testing.assert_array_equal(garment.tapes.vertices[1:, 0], garment.tapes.vertices[:-1, 1])


def test_a_shorter_tape_is_spread_evenly(mesh):
    plain, short = mesh(), mesh(length=0.45)
    np.testing.assert_allclose(short.tapes.lengths, 0.9 * plain.tapes.lengths)


def test_no_band_no_tape(load):
    top = build(load("top_9AR"), 0.03, "top")
    assert len(top.tapes.vertices) == len(top.tapes.lengths) == len(top.tapes.stiffness) == 0
