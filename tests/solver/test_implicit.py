"""The implicit step: free flight as backward Euler has it, equilibria, Coulomb's law on a slope, steps that fail."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from taichi_tryon import fields
from taichi_tryon.bench.energy import strain_and_height

DT = 1 / 60
G = 9.81


def put(stepper, positions, velocity=(0.0, 0.0, 0.0)):
    stepper.x.from_numpy(positions)
    stepper.v.from_numpy(np.broadcast_to(np.asarray(velocity, float), positions.shape).copy())
    stepper.contact.slip.fill(0.0)
    stepper.contact.along.fill(1.0)
    stepper.contact.seen.fill(0.0)
    stepper.contact.until.fill(-1.0)
    stepper.elastic.begin_step()
    stepper.newton.restore({name: np.zeros_like(values) for name, values in stepper.newton.state().items()})
    stepper.flight.touched = np.zeros_like(stepper.flight.touched)


def settle(stepper, target, steps=80, longest=1.0):
    """Steps without inertia, of growing length, until the net force is below ``target``; the energies on the way."""

    def energy() -> float:
        return strain_and_height(stepper) + stepper.contact.energy()

    dt, energies = DT, [energy()]
    for _ in range(steps):
        assert stepper.step(dt, inertia=0.0).accepted
        energies.append(energy())
        if stepper.balance() < target:
            break
        dt = min(1.5 * dt, longest)
    return np.array(energies)


def test_free_flight_is_backward_eulers(stepper, level):
    """x_n = x_0 + n dt v + n (n + 1) / 2 dt^2 g."""
    start, v = level(5.0), np.array([1.0, 2.0, -0.5])
    put(stepper, start, v)
    for _ in range(20):
        result = stepper.step(DT)
        assert result.accepted and result.residual <= stepper.settings.tolerance
    expected = start + 20 * DT * v + 210 * DT**2 * np.array([0, -G, 0])
    assert stepper.x.to_numpy() == pytest.approx(expected, abs=1e-8)
    assert stepper.v.to_numpy() == pytest.approx(np.tile(v + 20 * DT * np.array([0, -G, 0]), (len(start), 1)), abs=1e-6)
    assert stepper.fastest() == pytest.approx(np.linalg.norm(v + 20 * DT * np.array([0, -G, 0])), abs=1e-6)


def test_linear_momentum_is_kept(stepper, level, cloth):
    stepper.gravity[None] = [0, 0, 0]
    velocity = np.random.default_rng(0).normal(size=(stepper.nv, 3))
    put(stepper, level(5.0))
    stepper.v.from_numpy(velocity)
    before = cloth.masses @ velocity
    for _ in range(5):
        assert stepper.step(DT / 4).accepted
    size = (cloth.masses @ abs(velocity)).max()
    assert cloth.masses @ stepper.v.to_numpy() == pytest.approx(before, abs=1e-5 * size)
    kinetic = (cloth.masses * (stepper.v.to_numpy() ** 2).sum(axis=1)).sum()
    assert kinetic < 0.9 * (cloth.masses * (velocity**2).sum(axis=1)).sum()


def test_a_sheet_held_at_two_corners_comes_to_rest(stepper, sheet, level, cloth):
    positions = level(5.0)
    corners = [int(np.argmin(np.linalg.norm(sheet.points - at, axis=1))) for at in ((0, 0.1), (0.12, 0.1))]
    free = np.ones((stepper.nv, 3))
    free[corners] = 0
    fields.upload(stepper.free, free)
    put(stepper, positions)
    energies = settle(stepper, 1e-6)
    assert stepper.balance() < 1e-6
    assert np.array_equal(stepper.x.to_numpy()[corners], positions[corners])
    # looking at the energy sweeps the edge rotations once more, which can only lower it
    assert (np.diff(energies) <= 1e-9 * np.ptp(energies)).all()
    assert energies[0] - energies[-1] > 0.5 * cloth.masses.sum() * G * 0.04  # it hangs
    # global equilibrium: the elastic forces on the two corners carry the weight of the rest
    weight = G * (cloth.masses.sum() - cloth.masses[corners].sum())
    assert _pull(stepper, corners).sum(axis=0) == pytest.approx([0, -weight, 0], abs=5e-3 * weight)


def _pull(stepper, vertices) -> np.ndarray:
    """Force of the cloth on vertices that are held, weights left out: that which they would feel were they free."""
    held = stepper.free.to_numpy()
    fields.upload(stepper.free, np.ones((stepper.nv, 3)))
    net = stepper.net_forces()[vertices]
    fields.upload(stepper.free, held)
    return net - stepper.mass.to_numpy()[vertices, None] * stepper.gravity[None].to_numpy()


def contact_force(stepper) -> np.ndarray:
    """Sum of all contact and friction forces [N] at rest."""
    stepper.balance()
    touching = stepper.contact.depth.to_numpy() > 0
    return stepper.contact.load.to_numpy()[touching].sum(axis=0)


def test_a_sheet_on_a_ball_rests_with_its_whole_weight(stepper, level, cloth):
    put(stepper, level(1.1 + 1e-3))
    settle(stepper, 1e-6)
    assert stepper.balance() < 1e-6
    weight = G * cloth.masses.sum()
    assert contact_force(stepper) == pytest.approx([0, weight, 0], abs=5e-3 * weight)
    away = np.linalg.norm(stepper.x.to_numpy() - [0, 1, 0], axis=1)
    assert away.min() > 0.1  # outside the skin, and draped over the ball
    assert stepper.x.to_numpy()[:, 1].min() < 1.1 - 0.01


def lying(stepper, level, contact, slope, mass=0.29):
    """The sheet on a slope, gravity turned instead of the floor, as deep in the contact as its weight presses it."""
    stepper.gravity[None] = [G * np.sin(slope), -G * np.cos(slope), 0]
    load = mass * G * np.cos(slope) / (contact.stiffness * contact.thickness)
    depth = brentq(lambda u: u * u * (3 - 2 * u) - 3 * load * (1 - u) ** 2, 0.0, 0.5) * contact.thickness
    put(stepper, level(contact.thickness - depth))


def test_a_flat_sheet_lies_as_deep_as_its_weight(stepper, level, contact, cloth):
    lying(stepper, level, contact, 0.0)
    assert stepper.balance() < 1e-3
    assert contact_force(stepper) == pytest.approx([0, G * cloth.masses.sum(), 0], rel=5e-3, abs=1e-6)


def test_below_the_angle_of_friction_it_sticks(stepper, level, contact):
    lying(stepper, level, contact, np.arctan(0.98 * contact.friction))
    start = stepper.x.to_numpy()
    for _ in range(60):
        assert stepper.step(DT).accepted
    moved = np.linalg.norm(stepper.x.to_numpy() - start, axis=1).max()
    print(f"creep {1e6 * moved:.3g} um")
    assert moved < 1e-4
    assert stepper.fastest() < 1e-5


def test_above_the_angle_of_friction_it_slides(stepper, level, contact):
    slope = np.arctan(1.2 * contact.friction)
    lying(stepper, level, contact, slope)
    start, steps = stepper.x.to_numpy(), 30
    for _ in range(steps):
        assert stepper.step(DT).accepted
    expected = G * (np.sin(slope) - contact.friction * np.cos(slope))
    found = stepper.v.to_numpy()[:, 0].mean() / (steps * DT)
    path = (stepper.x.to_numpy() - start)[:, 0].mean() / (steps * (steps + 1) / 2 * DT**2)
    print(f"acceleration {found / expected - 1:+.2%}, from the path {path / expected - 1:+.2%}")
    assert found == pytest.approx(expected, rel=0.03)
    assert path == pytest.approx(expected, rel=0.03)


def test_what_slides_comes_to_a_stop_after_its_stopping_distance(stepper, level, contact):
    """v^2 / (2 mu g), as backward Euler has it: v (v - mu g dt) / (2 mu g)."""
    lying(stepper, level, contact, 0.0)
    v = 0.5
    stepper.v.from_numpy(np.tile([v, 0, 0], (stepper.nv, 1)))
    start = stepper.x.to_numpy()
    for _ in range(20):
        assert stepper.step(DT).accepted
    stopping = contact.friction * G
    assert stepper.fastest() < 1e-3
    found = (stepper.x.to_numpy() - start)[:, 0].mean()
    assert found == pytest.approx(v * (v - stopping * DT) / (2 * stopping), rel=0.03)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_step_that_cannot_be_done_is_rejected_and_the_state_kept(stepper, level, bad):
    put(stepper, level(5.0) * [1.05, 1, 1])
    assert stepper.step(DT).accepted
    good = stepper.state()
    velocities = good["velocities"].copy()
    velocities[3, 1] = bad
    stepper.v.from_numpy(velocities)
    assert not stepper.step(DT).accepted
    assert np.array_equal(stepper.x.to_numpy(), good["positions"])
    assert np.array_equal(stepper.v.to_numpy(), velocities, equal_nan=True)
    assert np.array_equal(stepper.contact.slip.to_numpy(), good["slip"])
    stepper.v.from_numpy(good["velocities"])
    assert stepper.step(DT).accepted
    assert np.isfinite(stepper.x.to_numpy()).all()


def test_no_vertex_goes_further_than_the_longest_move(stepper, level):
    stepper.settings = replace(stepper.settings, longest_move=1e-3, max_newton_iterations=1)
    # drawn up from just above the floor
    put(stepper, level(1.2 * stepper.contact.thickness[None]))
    stepper.gravity[None] = [0, 9.81, 0]
    result = stepper.step(DT)
    assert result.accepted
    assert result.moved == pytest.approx(1e-3, rel=1e-6)


@pytest.mark.parametrize(("given", "gone"), [(0.1, 0.9), (0.4, 1.0), (0.8, 0.8)])
def test_at_rest_what_falls_short_goes_further(stepper, level, monkeypatch, given, gone):
    """Where each direction is but a part of the one that ends at g dt^2: as far as eight times further."""
    solve, d = stepper.newton._solve, stepper.newton.linear.d

    def short(refresh):
        solve(refresh)
        fields.upload(d, given * d.to_numpy())

    monkeypatch.setattr(stepper.newton, "_solve", short)
    stepper.settings = replace(stepper.settings, max_newton_iterations=1)
    put(stepper, level(5.0))
    assert stepper.step(DT, inertia=0.0).moved == pytest.approx(gone * G * DT**2, rel=1e-4)


def test_at_rest_what_nothing_pulls_at_stays(stepper, level):
    stepper.gravity[None] = [0, 0, 0]
    put(stepper, level(5.0))
    result = stepper.step(DT, inertia=0.0)
    assert result.accepted and result.moved <= 1e-12


def test_a_step_goes_on_while_cloth_is_in_the_body(stepper, level, contact):
    """On a ball that has come up into it by 3 mm, and 1 mm an iteration."""
    few = replace(stepper.settings, tolerance=0.05, max_newton_iterations=1, longest_move=1e-3)
    went = {}
    for most in (0, 20):
        stepper.settings = replace(few, max_newton_inside=most)
        put(stepper, level(1.1 - 3e-3))
        result = stepper.step(DT)
        assert result.accepted
        went[most] = (result.newton_iterations, stepper.contact.inside)
    assert went[0][0] == 1 < went[20][0] < 20
    assert went[20][1] == 0.0 < went[0][1]


def test_what_is_to_take_no_iteration_more_puts_nothing_out(stepper, level, contact, monkeypatch):
    """Cloth that comes down on a ball within a step, which one iteration leaves in it."""
    few, looked = replace(stepper.settings, max_newton_iterations=1), []
    monkeypatch.setattr(stepper.contact, "lift", lambda *most, **lets: looked.append(most) or 0.0)
    for most, looks in ((1, 0), (2, 1)):
        stepper.settings = replace(few, max_newton_inside=most)
        put(stepper, level(1.1 + 1e-3), [0, -1.0, 0])
        assert stepper.step(DT).accepted
        assert len(looked) == looks


def test_two_runs_give_the_same_bits(stepper, level):
    """Falling on the ball at the speeds and tolerances of a real run."""
    stepper.settings = replace(stepper.settings, tolerance=0.05, max_newton_iterations=2, linear_tolerance=1e-2)
    ends = []
    for _ in range(2):
        put(stepper, level(1.102) * [1.01, 1, 1], [0.1, -0.5, 0])
        stepper.elastic.bending.rotation.fill(0.0)
        for _ in range(15):
            assert stepper.step(DT).accepted
        ends.append(stepper.state())
    assert (ends[0]["slip"] != 0).any()
    for name, values in ends[0].items():
        assert np.array_equal(values, ends[1][name]), name


@pytest.mark.parametrize("inertia", [0.0, 1.0])
def test_restored_it_goes_on_with_the_same_bits(stepper, level, contact, inertia):
    """Sliding down a slope, stretched; something else happens between."""
    stepper.settings = replace(stepper.settings, tolerance=0.05, max_newton_iterations=2, linear_tolerance=1e-2)
    lying(stepper, level, contact, np.arctan(1.2 * contact.friction))
    stepper.x.from_numpy(stepper.x.to_numpy() * [1.01, 1, 1])
    for _ in range(8):
        assert stepper.step(DT, inertia).accepted
    ends, middle = goes_on_twice(stepper, level, inertia)
    assert not np.array_equal(ends[0]["positions"], middle["positions"])
    for name, values in ends[0].items():
        assert np.array_equal(values, ends[1][name]), name


def test_restored_it_goes_as_far_at_a_time_with_the_same_bits(stepper, level):
    """Falling to the ball, where how far the cloth may go depends on when it was last looked at."""
    stepper.settings = replace(stepper.settings, tolerance=0.05, max_newton_iterations=2, longest_move=1e-3)
    put(stepper, level(1.2), [0, -1, 0])
    for _ in range(2):
        assert stepper.step(DT).accepted
    ends, _ = goes_on_twice(stepper, level)
    for name, values in ends[0].items():
        assert np.array_equal(values, ends[1][name]), name


def goes_on_twice(stepper, level, inertia: float = 1.0) -> tuple[list[dict], dict]:
    """States after four more steps, and again after something else happened, and the state before."""
    middle, ends = stepper.state(), []
    for _ in range(2):
        for _ in range(4):
            stepper.step(DT, inertia)
        ends.append(stepper.state())
        put(stepper, level(5.0))
        stepper.step(DT)
        stepper.restore(middle)
    return ends, middle
