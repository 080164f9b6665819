"""Weights and areas of the points at which the cloth feels the body."""

import numpy as np
import pytest


def test_weights_sum_to_one(samples):
    assert samples.weights.sum(axis=1) == pytest.approx(1)
    assert samples.weights.min() >= 0


def test_areas_sum_to_that_of_the_cloth(samples, cloth):
    assert samples.areas.sum() == pytest.approx(0.02 * 0.02, rel=1e-12)
    assert samples.areas.min() > 0
    assert len(samples.areas) == cloth.vertex_count + len(cloth.hinges) + len(cloth.triangles)


def test_each_vertex_carries_a_third_of_its_triangles(samples, cloth):
    shares = np.bincount(samples.vertices.ravel(), (samples.weights * samples.areas[:, None]).ravel())
    assert shares == pytest.approx(cloth.vertex_areas, rel=1e-12)


def test_held_off_by_span_times_curvature_a_triangle_clears_a_parabola(samples, cloth):
    """The samples at z = y^2 c / 2 + span c, joined by flat pieces, are above z = y^2 c / 2."""
    for triangle, rest in enumerate(cloth.rest):
        edges = ((rest - np.roll(rest, 1, axis=0)) ** 2).sum(axis=1)
        span = samples.spans[-len(cloth.rest) + triangle]
        assert span == pytest.approx(edges.max() / 24)
        centre = rest.mean(axis=0)
        for corner in range(3):
            for other in ((corner + 1) % 3, (corner + 2) % 3):
                piece = np.array([rest[corner], (rest[corner] + rest[other]) / 2, centre])
                weights = np.random.default_rng(0).dirichlet(np.ones(3), 200)
                for turn in np.linspace(0, np.pi, 7):
                    y = piece @ [np.cos(turn), np.sin(turn)]
                    assert (weights @ (y * y) - (weights @ y) ** 2).max() / 2 <= span * (1 + 1e-9)
    first = samples.vertices[: cloth.vertex_count, 0]
    for vertex in first:
        around = (cloth.triangles == vertex).any(axis=1)
        assert samples.spans[vertex] == samples.spans[-len(cloth.rest) :][around].max()


@pytest.mark.parametrize(
    ("function", "exact"),
    [
        (lambda x, y: x**3, 0.02**5 / 4),
        (lambda x, y: x * y**2, 0.02**5 / 6),
        (lambda x, y: y**2, 0.02**4 / 3),
    ],
)
def test_cubics_are_integrated_exactly(samples, make_sheet, function, exact):
    points = make_sheet(0.02, 0.02, 0.01).points
    at = np.einsum("sk,ska->sa", samples.weights, points[samples.vertices])
    assert samples.areas @ function(at[:, 0], at[:, 1]) == pytest.approx(exact, rel=1e-12)


def test_a_triangle_knows_its_samples(samples, cloth):
    points = np.random.default_rng(1).normal(size=(cloth.vertex_count, 3))
    at = np.einsum("sk,ski->si", samples.weights, points[samples.vertices])
    for corners, own in zip(cloth.triangles, samples.of_triangle, strict=True):
        p = points[corners]
        middles = sorted(map(tuple, (p + np.roll(p, 1, axis=0)) / 2))
        assert np.array_equal(at[own[:3]], p) and at[own[6]] == pytest.approx(p.mean(axis=0))
        assert np.array(sorted(map(tuple, at[own[3:6]]))) == pytest.approx(np.array(middles))
