"""Time integration: order of convergence, energy, momenta, resuming, internal friction, estimate of the local error."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tryon.bench.energy import mechanical
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.solver import schemes
from taichi_tryon.solver.implicit import ImplicitStep, StepSettings
from taichi_tryon.timing import Stopwatch

GRAVITY = np.array([0.0, -9.81, 0.0])
CONVERGED = StepSettings(
    tolerance=1e-5,
    max_newton_iterations=60,
    linear_tolerance=1e-3,
    max_linear_iterations=2000,
    longest_move=0.1,
    preconditioner="block_jacobi",
)
LENGTH = 0.5


@pytest.fixture(scope="module")
def strip(make_sheet, moduli, floor_and_ball_field, at_rest):
    """A strip of cloth, 0.5 m long and so narrow that it swings like a pendulum of ten stiff links."""
    sheet = make_sheet(LENGTH, 0.05, 0.05)
    # internal friction is switched on and off below
    cloth = Cloth.join([(sheet, replace(moduli, damping_time=5e-3))])
    flat = np.column_stack([sheet.points[:, 0], np.full(len(sheet.points), 5.0), -sheet.points[:, 1]])
    stepper = ImplicitStep(cloth, floor_and_ball_field, flat, (1e7, 5e-4, 0.3), GRAVITY, CONVERGED, Stopwatch())
    return SimpleNamespace(stepper=stepper, cloth=cloth, flat=flat, held=flat[:, 0] < 1e-9, at_rest=at_rest)


def put(strip, scheme, positions, velocities=0.0, held=True, gravity=GRAVITY, **settings):
    """The strip at rest, or with ``velocities`` (nv, 3) [m/s], about to be stepped by a scheme."""
    s, nv = strip.stepper, len(positions)
    s.settings = replace(CONVERGED, scheme=scheme, **settings)
    s.gravity[None] = gravity
    s.free.from_numpy(np.repeat(1.0 - (strip.held & held)[:, None], 3, axis=1))
    s.place_held(positions)
    s.elastic.tau.fill(0.0)
    s.elastic.bending.hinges.tau.fill(0.0)
    s.restore(
        strip.at_rest(
            s, positions, velocities=np.broadcast_to(velocities, (nv, 3)), accelerations=np.full((nv, 3), 1e3)
        )
    )
    return s


def swing(strip, scheme, dt, duration, positions=None):
    """Positions at the end of swinging, released ``positions`` (level by default)."""
    s = put(strip, scheme, strip.flat if positions is None else positions)
    for _ in range(round(duration / dt)):
        result = s.step(dt)
        assert result.accepted and result.residual <= CONVERGED.tolerance
    return s.x.to_numpy()


@pytest.mark.parametrize(("scheme", "least", "most"), [("backward_euler", 0.8, 1.2), ("tr_bdf2", 1.9, 2.3)])
def test_order_of_convergence_on_a_strip_released_level(strip, scheme, least, most):
    ends = [swing(strip, scheme, 1 / n, 0.15) for n in (80, 160, 320)]
    coarse, fine = (np.sqrt(((a - b) ** 2).sum(axis=1).mean()) for a, b in zip(ends, ends[1:], strict=False))
    print(f"{scheme}: order {np.log2(coarse / fine):.3f}, {1e3 * coarse:.3g} and {1e3 * fine:.3g} mm")
    assert least <= np.log2(coarse / fine) <= most


def turned(strip, angle):
    """The strip turned down by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = strip.flat.T
    return np.column_stack([c * x, 5.0 - s * x, z])


def test_energy_drift_in_half_a_second_of_swinging(strip):
    """Relative to what it would lose coming to rest, from 45 degrees, with steps of 1/120 s."""
    start = turned(strip, np.pi / 4)
    put(strip, "tr_bdf2", start)
    first = mechanical(strip.stepper)
    swing(strip, "tr_bdf2", 1 / 120, 0.5, start)
    lost = mechanical(strip.stepper) - first
    put(strip, "tr_bdf2", turned(strip, np.pi / 2))
    found = lost / (first - mechanical(strip.stepper))
    print(f"energy {found:+.3%}")
    assert abs(found) <= 0.01


def test_spinning_in_free_flight_keeps_its_momenta(strip):
    """One turn a second, begun unstretched: the blow of the centrifugal force is too short for the step."""
    m, turn, speed = strip.cloth.masses, 2 * np.pi * np.array([0.2, 0.9, 0.4]), np.array([1.0, 2.0, -0.5])
    arm = strip.flat - m @ strip.flat / m.sum()
    v = speed + np.cross(turn, arm)
    s = put(strip, "tr_bdf2", strip.flat, v, held=False, gravity=[0, 0, 0], tolerance=1e-9, linear_tolerance=1e-6)
    for _ in range(20):
        assert s.step(1 / 240).accepted
    x, after = s.x.to_numpy(), s.v.to_numpy()
    moment = m @ np.cross(arm, v)
    kept = m @ np.cross(x - m @ x / m.sum(), after)
    linear = np.linalg.norm(m @ (after - v)) / np.linalg.norm(m @ v)
    angular = np.linalg.norm(kept - moment) / np.linalg.norm(moment)
    print(f"linear {linear:.1e}, angular {angular:.1e}")
    assert linear < 1e-12 and angular < 1e-12


def test_free_fall_is_exact_from_the_first_step_on_with_steps_of_any_length(strip):
    s = put(strip, "tr_bdf2", strip.flat, held=False, tolerance=1e-10, linear_tolerance=1e-7)
    time = 0.0
    for dt in (1 / 60, 1 / 200, 1 / 30, 1 / 90):
        assert s.step(dt).accepted
        time += dt
    assert s.x.to_numpy() == pytest.approx(strip.flat + GRAVITY * time**2 / 2, abs=1e-9)
    assert s.v.to_numpy() == pytest.approx(np.tile(GRAVITY * time, (s.nv, 1)), abs=1e-7)


@pytest.mark.parametrize("before", [0.0, 1.0])
def test_restored_it_goes_on_with_the_same_bits(strip, before):
    """After a step without inertia, which leaves no acceleration, and after one with it."""
    s = put(strip, "tr_bdf2", strip.flat)
    for inertia in (1.0, before):
        assert s.step(1 / 120, inertia).accepted
    middle, ends = s.state(), []
    for _ in range(2):
        for dt in (1 / 120, 1 / 200):
            s.step(dt)
        ends.append(s.state())
        swing(strip, "backward_euler", 1 / 60, 1 / 60)
        s.settings = replace(CONVERGED, scheme="tr_bdf2")
        s.restore(middle)
    assert not np.array_equal(ends[0]["positions"], middle["positions"])
    for name, values in ends[0].items():
        assert np.array_equal(values, ends[1][name]), name


def test_a_step_with_too_great_an_error_leaves_no_trace(strip):
    s = put(strip, "tr_bdf2", strip.flat)
    assert s.step(1 / 60).accepted
    before = s.state()
    result = s.step(1 / 30, error_limit=1e-9)
    assert not result.accepted and result.error > 1e-9 and result.change == schemes.LEAST
    after = s.state()
    for name in before:
        if name not in ("rotation", "along"):  # where Newton's method begins
            assert np.array_equal(before[name], after[name]), name


@pytest.mark.parametrize("scheme", ["backward_euler", "tr_bdf2"])
def test_the_error_is_estimated(strip, scheme):
    """Against the step done in 16, after as many small ones as the start takes to be forgotten."""
    dt, errors = 1 / 60, []
    s = put(strip, scheme, strip.flat)
    for _ in range(30):
        s.step(dt / 8)
    state, m = s.state(), strip.cloth.masses
    for parts in (1, 16):
        s.restore(state)
        for _ in range(parts):
            result = s.step(dt / parts, error_limit=1.0)
        errors.append((result.error, s.x.to_numpy()))
    (estimate, once), (_, often) = errors
    true = np.sqrt(m @ ((once - often) ** 2).sum(axis=1) / m.sum())
    print(f"{scheme}: estimated {1e3 * estimate:.3g} mm, true {1e3 * true:.3g} mm")
    assert true / 3 < estimate < 3 * true


def test_internal_friction_is_of_second_order_too(strip):
    """A strip pulled out and let go shrinks back; its damping time is a fraction of its period."""
    ends = []
    for n in (400, 800, 1600):
        s = put(strip, "tr_bdf2", strip.flat * [1.01, 1, 1], gravity=[0, 0, 0], tolerance=1e-9, linear_tolerance=1e-6)
        s.elastic.tau.fill(5e-3)
        s.elastic.bending.hinges.tau.fill(5e-3)
        for _ in range(n // 40):
            assert s.step(1 / n).accepted
        ends.append(s.x.to_numpy())
    coarse, fine = (np.abs(a - b).max() for a, b in zip(ends, ends[1:], strict=False))
    print(f"order {np.log2(coarse / fine):.2f}, left {np.ptp(ends[-1][:, 0]) / LENGTH - 1:.2e}")
    assert np.log2(coarse / fine) > 1.8


def test_a_step_of_the_schemes_is_consistent():
    """Stages of one length; constant velocity and constant acceleration are followed exactly."""
    for scheme in (*schemes.SCHEMES.values(), schemes.STARTING):
        x, v, a, g = 0.0, 3.0, 2.0, 2.0
        last = (x, v)
        for stage in scheme.stages:
            x_ref = x + stage.ahead * v + stage.beyond * (last[0] - x)
            v_ref = v + stage.ahead * a + stage.beyond * (last[1] - v)
            after = v_ref + stage.h * g
            last = (x_ref + stage.h * after, after)
        assert last[1] == pytest.approx(v + g)
        assert last[0] == pytest.approx(v + g / 2 if scheme.order == 2 else v + g)
        assert sum(scheme.error) == pytest.approx(0.0, abs=1e-12)
        assert len({stage.h for stage in scheme.stages}) == 1
