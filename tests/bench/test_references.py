"""The references themselves, where there are published figures or a simpler way to them."""

import math

import numpy as np
import pytest
import shapely
from scipy.special import gamma, jv

from taichi_tryon.bench.accuracy.body_field import around
from taichi_tryon.bench.accuracy.capstan import FRICTION, polygon
from taichi_tryon.bench.accuracy.cusick import nodes, outline_radii
from taichi_tryon.bench.accuracy.fold import extents
from taichi_tryon.bench.accuracy.hanging_strip import extension
from taichi_tryon.bench.accuracy.lateral_buckling import left_of
from taichi_tryon.bench.accuracy.lateral_buckling import load_of as buckling_load
from taichi_tryon.bench.accuracy.uniaxial import STRETCH, stress
from taichi_tryon.bench.elastica import bow, load_of, tip


@pytest.mark.parametrize(
    ("load", "drop", "slope"), [(1, 0.12347, 0.12456), (5, 0.49591, 0.58572), (20, 0.82988, 1.8639)]
)
def test_the_heavy_elastica(load, drop, slope):
    y, x = tip(load)
    assert y == pytest.approx(drop, abs=2e-5) and y / x == pytest.approx(slope, rel=1e-4)
    assert load_of(3 * y, 3 * x) == pytest.approx(load, rel=1e-6)


def test_a_light_elastica_is_a_beam():
    assert tip(1e-3)[0] == pytest.approx(1e-3 / 8, rel=1e-5)


def test_uniaxial_stress(moduli):
    strain = (STRETCH**2 - 1) / 2
    assert stress(moduli.stretch, 0.0) == pytest.approx(2392.8 * strain * STRETCH)
    assert stress(moduli.stretch, math.pi / 2) == pytest.approx(2373.2 * strain * STRETCH)
    compliance = (1 / 2392.8 + 1 / 2373.2 + 1 / 77.54) / 4
    assert stress(moduli.stretch, math.pi / 4) == pytest.approx(strain / compliance, rel=0.02)


def test_the_capstan_tends_to_eulers():
    errors = [polygon(math.pi, n) / math.exp(FRICTION * math.pi) - 1 for n in (8, 16, 32)]
    assert errors[2] > 0 and errors[0] / errors[1] == pytest.approx(4, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(4, rel=0.02)


def test_a_strip_hangs_by_its_weight():
    assert extension(1e6, 2.0) == pytest.approx(2.0 / 2e6, rel=1e-4)


def test_points_around_an_ellipsoid_are_as_far_as_they_say():
    half = np.array([0.08, 0.12, 0.05])
    points, distance = around(half)
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, np.pi, 400), np.linspace(0, 2 * np.pi, 800)))
    skin = half * np.column_stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)])
    for point, expected in zip(points[:20], distance[:20], strict=True):
        found = np.linalg.norm(skin - point, axis=1).min()
        assert found == pytest.approx(abs(expected), abs=3e-4)
        assert (((point / half) ** 2).sum() > 1) == (expected > 0)


@pytest.mark.parametrize("count", [8, 11])
def test_folds_of_an_outline(count):
    angle = np.arange(400) * 2 * np.pi / 400
    radius = 0.12 + 0.01 * np.cos(count * (angle - 0.1)) + 2e-4 * np.cos(57 * angle)
    shadow = shapely.Polygon(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]))
    radii = outline_radii(shadow)
    assert radii.max() == pytest.approx(radius.max(), abs=5e-5) and radii[0] == pytest.approx(radius[0])
    assert nodes(radii) == count


def test_a_bow_without_weight_or_squeezing_is_half_a_circle():
    points, force = bow(0.0, -90.0, 2 / math.pi, steps=1)
    assert extents(points, -90.0) == pytest.approx((1e3 / math.pi, 2e3 / math.pi), rel=1e-5)
    assert force == pytest.approx(0, abs=1e-5)


def test_the_force_of_a_heavy_bow_is_the_work_of_widening_it():
    def energy(points: np.ndarray) -> float:
        along = np.diff(points, axis=0)
        ds = np.linalg.norm(along, axis=1)
        bend = np.diff(np.unwrap(np.arctan2(along[:, 1], along[:, 0]))) / ds[1:]
        return (bend**2 * ds[1:]).sum() / 2 + 50 * ((points[1:, 1] + points[:-1, 1]) / 2 * ds).sum()

    low, high = (energy(bow(50.0, -90.0, gap)[0]) for gap in (0.19, 0.21))
    points, force = bow(50.0, -90.0, 0.2)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(1, rel=1e-5)
    assert points[-1] == pytest.approx([0.2, 0], abs=1e-8)
    assert force == pytest.approx((high - low) / 0.02, rel=5e-3)


def test_lateral_buckling_of_a_narrow_strip_and_of_one_that_cannot_warp():
    # Timoshenko's figure and Bessel's functions, but for the first element's slope; with warping, a boundary-value
    # solver's figure
    assert 2 * buckling_load(0.0, 1e-9) == pytest.approx(12.8538, rel=1e-2)
    grown = (5 / 6) ** (-1 / 6) / (gamma(5 / 6) * jv(-1 / 6, 5 / 3))
    assert left_of(5.0, 1e-9) == pytest.approx(1 / grown, rel=4e-2)
    assert 2 * buckling_load(0.0, 0.05 * math.sqrt(0.147 / 0.03825 / 48)) == pytest.approx(13.4286, rel=2e-4)
