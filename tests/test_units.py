"""The fabric of the paper's Table 1 in SI, as worked out by hand to four or five figures."""

import math

import pytest

from taichi_tryon import units


@pytest.mark.parametrize(
    ("value", "unit", "si", "digits"),
    [
        (2440.0, units.GF_PER_CM, 2392.8, 0.05),
        (2420.0, units.GF_PER_CM, 2373.2, 0.05),
        (1.38, units.GF_PER_CM_DEGREE, 77.54, 0.005),
        (0.147, units.GF_CM2_PER_CM, 1.4416e-5, 5e-10),
        (0.108, units.GF_CM2_PER_CM, 1.0591e-5, 5e-10),
        (0.102, units.GF_CM2_PER_CM, 1.0003e-5, 5e-10),
        (0.029, units.GF_PER_CM2_MASS, 0.29, 1e-12),
    ],
)
def test_table_1_in_si(value, unit, si, digits):
    assert value * unit == pytest.approx(si, abs=digits, rel=0)


def test_weight_of_table_1():
    assert 0.029 * units.GF_PER_CM2_MASS * units.STANDARD_GRAVITY == pytest.approx(2.844, abs=5e-4)


def test_lengths_and_angles():
    assert 12 * units.MM == pytest.approx(1.2 * units.CM) == pytest.approx(0.012)
    assert 180 * units.DEGREE == math.pi
