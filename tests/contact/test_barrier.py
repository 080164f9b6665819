"""The barrier: its derivatives belong together, it is soft where cloth begins to touch and has no end."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.contact import barrier


@ti.kernel
def _evaluate(s: ti.types.ndarray(), out: ti.types.ndarray()):
    for k in range(s.shape[0]):
        out[k, 0], out[k, 1], out[k, 2] = barrier.energy(s[k]), barrier.slope(s[k]), barrier.curvature(s[k])


def at(s):
    """Energy, slope and curvature, each (n,), at closenesses (n,)."""
    s = np.atleast_1d(np.asarray(s, float))
    out = np.empty((len(s), 3))
    _evaluate(s, out)
    return out.T


INSIDE = np.linspace(0.01, 0.999, 200)


@pytest.mark.parametrize("order", [0, 1])
def test_slope_and_curvature_are_the_derivatives(order):
    eps = 1e-6 * (1 - INSIDE)
    slope = (at(INSIDE + eps)[order] - at(INSIDE - eps)[order]) / (2 * eps)
    assert at(INSIDE)[order + 1] == pytest.approx(slope, rel=1e-6, abs=1e-9)


def test_energy_slope_and_curvature_are_positive_and_grow():
    s = np.concatenate([np.geomspace(1e-9, 0.01, 50), INSIDE, 1 - np.geomspace(1e-3, 1e-12, 50)])
    for values in at(np.unique(s)):
        assert values.min() > 0 and (np.diff(values) > 0).all()


def test_where_cloth_begins_to_touch_the_slope_is_3_s2():
    s = np.array([1e-2, 1e-3, 1e-4])
    energy, slope, curvature = at(s)
    # f = s^3 + s^4 / 2 + s^5 / 3 + ...
    assert energy == pytest.approx(s**3 * (1 + s / 2), rel=1e-4)
    assert slope == pytest.approx(3 * s**2 * (1 + 2 * s / 3), rel=1e-4)
    assert curvature == pytest.approx(6 * s * (1 + s), rel=1e-3)


def test_it_is_joined_to_nothing_without_a_kink():
    assert at(0.0) == pytest.approx(np.zeros((3, 1)), abs=1e-15)


def test_it_has_no_end():
    rest = np.array([1e-3, 1e-6, 1e-9, 1e-12])
    energy, slope, curvature = at(1 - rest)
    assert energy == pytest.approx(-np.log(rest), rel=3e-3)
    assert slope * rest == pytest.approx(1, abs=0.02)
    assert curvature * rest**2 == pytest.approx(1, abs=0.01)
