"""The pressure off the skin: its integral and its derivative belong together, before and after it turns linear."""

import numpy as np
import pytest

from taichi_tryon.contact.offset import FIRM, YIELDING


@pytest.mark.parametrize("last", [FIRM, YIELDING])
@pytest.mark.parametrize("order", [0, 1])
def test_pressure_and_steepness_are_the_derivatives(pushes, law, last, order):
    # but not where the law changes
    part = np.concatenate([np.linspace(0.01, 0.99 * last, 100), np.linspace(1.01 * last, 30.0, 50)])
    depth, eps = part * law.thickness, 1e-6 * law.thickness
    slope = (pushes(depth + eps, last)[order] - pushes(depth - eps, last)[order]) / (2 * eps)
    assert pushes(depth, last)[order + 1] == pytest.approx(slope, rel=1e-6)


def test_all_are_continuous_where_the_pressure_turns_linear(pushes, law):
    depth = FIRM * law.thickness
    assert pushes(depth * (1 + 1e-9)) == pytest.approx(pushes(depth * (1 - 1e-9)), rel=1e-6)


def test_where_cloth_begins_to_touch_the_pressure_is_that_of_a_square(pushes, law):
    k, t = law.stiffness, law.thickness
    depth = t * np.array([1e-6, 1e-4, 1e-2])
    stored, pressure, steepness = pushes(depth)
    assert pressure == pytest.approx(k * depth**2 / t, rel=0.02)
    assert steepness == pytest.approx(2 * k * depth / t, rel=0.03)
    assert stored == pytest.approx(k * depth**3 / (3 * t), rel=0.02)
    assert not np.any(pushes(0.0))


@pytest.mark.parametrize(("last", "at_the_skin"), [(FIRM, 7.163265), (YIELDING, 3.0)])
def test_the_pressure_at_the_skin_and_below(pushes, law, last, at_the_skin):
    (skin, deep), steepness = pushes([law.thickness, 0.01], last)[1:]
    assert skin == pytest.approx(at_the_skin * law.stiffness * law.thickness, rel=1e-6)
    assert deep - skin == pytest.approx(steepness[0] * (0.01 - law.thickness), rel=1e-9)
