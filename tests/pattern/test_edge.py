import numpy as np
import pytest
from scipy.integrate import quad

from taichi_tryon.pattern.edge import Edge

LINE = Edge("line", "line", np.array([[0.1, 0.2], [0.4, 0.6]]))
CUBIC = Edge("cubic", "cubic", np.array([[0.068, 0.384], [0.05435, 0.3507], [0.04796, 0.2988], [0.0, 0.2988]]))
THREE_QUARTERS = Edge("arc", "arc", np.array([[0.2, 0.0], [-0.2, 0.0], [0.0, -0.2]]))
CLOCKWISE = Edge("arc", "arc", np.array([[0.0, 0.2], [0.2 * np.sqrt(0.5), 0.2 * np.sqrt(0.5)], [0.2, 0.0]]))
# a cusp-like curve: its speed changes a hundredfold on the way
UNEVEN = Edge("uneven", "cubic", np.array([[0.0, 0.0], [0.3, 0.0], [0.001, 0.1], [0.3, 0.1]]))
RESTING = Edge("resting", "cubic", np.array([[0.0, 0.0], [0.0, 0.0], [0.1, 0.1], [0.2, 0.0]]))


def cubic_speed(edge: Edge, t: float) -> float:
    a, b, c, d = edge.points
    return float(np.linalg.norm(3 * ((1 - t) ** 2 * (b - a) + 2 * (1 - t) * t * (c - b) + t**2 * (d - c))))


@pytest.mark.parametrize(
    ("edge", "length"), [(LINE, 0.5), (THREE_QUARTERS, 0.3 * np.pi), (CLOCKWISE, 0.1 * np.pi)], ids=lambda x: str(x)[:8]
)
def test_lengths_of_lines_and_arcs_are_exact(edge, length):
    assert edge.length == pytest.approx(length, rel=1e-14)


@pytest.mark.parametrize("edge", [CUBIC, UNEVEN, RESTING], ids=lambda edge: edge.name)
def test_length_of_a_cubic_against_adaptive_quadrature(edge):
    exact, _ = quad(lambda t: cubic_speed(edge, t), 0, 1, epsabs=1e-14, epsrel=1e-13, limit=500)
    assert edge.length == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize("edge", [LINE, CUBIC, THREE_QUARTERS, CLOCKWISE, UNEVEN, RESTING], ids=lambda edge: edge.name)
def test_samples_are_equally_far_apart_along_the_edge(edge):
    coarse, fine = edge.sample(8), edge.sample(7 * 400 + 1)
    assert np.array_equal(coarse[[0, -1]], edge.points[[0, -1]])
    steps = np.linalg.norm(np.diff(fine, axis=0), axis=1).reshape(7, 400).sum(axis=1)
    assert steps == pytest.approx(np.full(7, edge.length / 7), rel=2e-5)
    assert coarse == pytest.approx(fine[::400], abs=1e-12)


def test_an_arc_passes_through_its_middle_point_and_keeps_its_radius():
    points = THREE_QUARTERS.sample(91)
    assert np.linalg.norm(points, axis=1) == pytest.approx(np.full(91, 0.2), rel=1e-13)
    assert np.linalg.norm(points - [-0.2, 0.0], axis=1).min() < 1e-12


def test_a_circle_of_two_arcs_has_the_area_of_a_circle():
    halves = [np.array([[r, 0.0], [0.0, r], [-r, 0.0]]) for r in (0.3, -0.3)]
    area = sum(Edge("half", "arc", points).swept_area() for points in halves)
    assert area == pytest.approx(np.pi * 0.09, rel=1e-12)


def test_turned_and_mirrored_edges():
    assert CUBIC.turned_round().sample(9) == pytest.approx(CUBIC.sample(9)[::-1], abs=1e-12)
    assert CUBIC.mirrored().sample(9) == pytest.approx(CUBIC.sample(9)[::-1] * [-1, 1], abs=1e-12)


def test_tangents_at_the_ends_follow_the_handles():
    handle = CUBIC.points[1] - CUBIC.points[0]
    assert CUBIC.tangent(0.0) == pytest.approx(handle / np.linalg.norm(handle), abs=1e-3)
