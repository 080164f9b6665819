"""What flies freely keeps its momenta; what is touched or held is left to contact and holds; the order stays."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tryon.bench.energy import kinetic

GRAVITY = np.array([0.0, -9.81, 0.0])
# solved far from exactly
ROUGH = dict(tolerance=0.05, max_newton_iterations=2, linear_tolerance=1e-2, max_linear_iterations=200,
             longest_move=0.1)  # fmt: skip
EXACT = {"tolerance": 1e-9, "max_newton_iterations": 30, "linear_tolerance": 1e-6}
SPIN, SPEED = np.array([2.0, 5.0, 3.0]), np.array([1.0, 2.0, -0.5])


@pytest.fixture(scope="module")
def pair(two_sheets):
    """Two sheets that nothing joins: one lies on the floor, just in contact, the other spins high up."""
    flat = two_sheets.flat * [1, 0, 1]
    low, high = (slice(part * len(flat), (part + 1) * len(flat)) for part in (0, 1))
    positions = np.concatenate([flat + [0, 4.9e-4, 0], flat + [0, 5, 0]])
    return SimpleNamespace(step=two_sheets.step, cloth=two_sheets.cloth, positions=positions, low=low, high=high)


def momenta(pair, part):
    """Mean velocity and angular momentum about the centre of mass, of one of the sheets."""
    m, x, v = pair.cloth.masses[part], pair.step.x.to_numpy()[part], pair.step.v.to_numpy()[part]
    arms = x - m @ x / m.sum()
    return m @ v / m.sum(), m @ np.cross(arms, v)


@pytest.fixture
def put(pair, start):
    """Makes both sheets be at the start, the high one spinning."""

    def make(scheme, low_velocity=(0.0, 0.0, 0.0), **settings):
        x, m = pair.positions, pair.cloth.masses[pair.high]
        v = np.zeros_like(x)
        v[pair.low] = low_velocity
        v[pair.high] = SPEED + np.cross(SPIN, x[pair.high] - m @ x[pair.high] / m.sum())
        return start(x, v, **{**ROUGH, **settings}, scheme=scheme)

    return make


@pytest.mark.parametrize("scheme", ["backward_euler", "tr_bdf2"])
def test_in_flight_both_momenta_are_kept_though_roughly_solved(pair, put, scheme):
    s = put(scheme)
    speed, spin = momenta(pair, pair.high)
    for dt in (1 / 60, 1 / 100, 1 / 60, 1 / 200):
        assert s.step(dt).accepted
        speed = speed + dt * GRAVITY
        now = momenta(pair, pair.high)
        assert now[0] == pytest.approx(speed, abs=1e-12)
        assert now[1] == pytest.approx(spin, rel=1e-10)


def test_the_scheme_alone_would_not(pair, put, monkeypatch):
    s = put("backward_euler")
    spin = momenta(pair, pair.high)[1]
    monkeypatch.setattr(s.flight, "keep", lambda step: None)
    assert s.step(1 / 60).accepted
    assert np.linalg.norm(momenta(pair, pair.high)[1] - spin) > 1e-3 * np.linalg.norm(spin)


@pytest.mark.parametrize("scheme", ["backward_euler", "tr_bdf2"])
def test_what_is_touched_is_left_alone(pair, put, scheme, monkeypatch):
    """The lower sheet has the bits that it has without any correction."""
    ends = []
    for keep in (pair.step.flight.keep, lambda step: None):
        s = put(scheme, low_velocity=(0.3, 0.0, 0.0))
        monkeypatch.setattr(s.flight, "keep", keep)
        assert s.step(1 / 200).accepted
        assert s.flight.touched.tolist() == [True, False]
        ends.append(s.v.to_numpy())
    assert np.array_equal(ends[0][pair.low], ends[1][pair.low])
    assert not np.array_equal(ends[0][pair.high], ends[1][pair.high])


def test_a_step_that_begins_in_contact_keeps_its_push(pair, put):
    """Thrown up from the floor it is out of contact at once, pushed in the first half of the step alone."""
    s = put("tr_bdf2", low_velocity=(0.0, 2.0, 0.0))
    s.flight.touched = np.array([True, False])
    s.acceleration_known = True
    a = np.zeros_like(pair.positions)
    a[pair.low] = [0.0, 100.0, 0.0]
    s.a.from_numpy(a)
    assert s.step(1 / 200).accepted
    assert s.flight.touched.tolist() == [False, False]
    assert momenta(pair, pair.low)[0][1] > 2.05


@pytest.mark.parametrize("scheme", ["backward_euler", "tr_bdf2"])
def test_what_newton_leaves_short_of_the_floor_gains_no_energy(pair, start, scheme, monkeypatch):
    """It would fall below the floor in a step, and its one iteration ends above it."""
    m = pair.cloth.masses

    def energy(step):
        return kinetic(step) - m @ (step.x.to_numpy() @ GRAVITY)

    high, ends = pair.positions.copy(), []
    high[pair.high, 1] = 0.012
    for keep in (pair.step.flight.keep, lambda step: None):
        s = start(high, np.array([0.0, -1.0, 0.0]), **{**ROUGH, "max_newton_iterations": 1}, scheme=scheme)
        monkeypatch.setattr(s.flight, "keep", keep)
        before = energy(s)
        assert s.step(1 / 60).accepted
        ends.append(s.v.to_numpy()[pair.high])
        fell = 0.012 - s.x.to_numpy()[pair.high, 1]
        assert not s.flight.touched[1] and fell.max() < 0.011 and energy(s) < before
    assert np.array_equal(*ends)


def test_what_is_held_is_left_alone(pair, put):
    s = put("tr_bdf2", **EXACT)
    free = np.ones_like(pair.positions)
    corner = pair.high.start
    free[corner] = 0.0
    s.free.from_numpy(free)
    start = momenta(pair, pair.high)
    assert s.step(1 / 200).accepted
    assert s.v.to_numpy()[corner] == pytest.approx(np.zeros(3), abs=1e-12)
    assert np.linalg.norm(momenta(pair, pair.high)[1] - start[1]) > 0.01 * np.linalg.norm(start[1])


def test_steps_without_inertia_know_no_momenta(pair, put):
    s = put("tr_bdf2", **EXACT)
    s.gravity[None] = [0.0, 0.0, 0.0]
    assert s.step(1 / 200, inertia=0.0).accepted
    s.gravity[None] = GRAVITY
    assert np.abs(s.v.to_numpy()[pair.high]).max() < 1e-6


def test_the_order_stays(pair, put):
    """Of steps that follow the turning, if not the waves of stretch in which the unstrained start rings by some um."""
    ends = []
    for n in (40, 80, 160):
        s = put("tr_bdf2", **EXACT)
        for _ in range(n // 4):
            assert s.step(1 / n).accepted
        ends.append(s.x.to_numpy()[pair.high])
    coarse, fine = (np.sqrt(((a - b) ** 2).sum(axis=1).mean()) for a, b in zip(ends, ends[1:], strict=False))
    print(f"order {np.log2(coarse / fine):.2f}, {1e6 * coarse:.3g} and {1e6 * fine:.3g} um")
    assert 1.8 < np.log2(coarse / fine) < 2.6
