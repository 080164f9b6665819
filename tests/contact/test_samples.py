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
