"""Cloth on cloth in the step: it never passes through itself, carries its weight and exchanges momentum."""

import numpy as np
import pytest
from scipy.interpolate import LinearNDInterpolator

from taichi_tryon.dressing.check import crossings

DT = 1 / 60
G = 9.81
# about as scenes are stepped
USUAL = dict(tolerance=1e-3, max_newton_iterations=8, linear_tolerance=1e-2, max_linear_iterations=400,
             longest_move=0.01)  # fmt: skip


def through(two) -> int:
    """Pairs of triangles that are through each other now."""
    return len(crossings(two.step.x.to_numpy(), two.cloth.triangles))


def low(two, values):
    return values[: len(two.flat)]


def high(two, values):
    return values[len(two.flat) :]


def turned(flat, angle=0.1) -> np.ndarray:
    """A sheet whose corners lie over nothing in particular."""
    c, s = np.cos(angle), np.sin(angle)
    return flat @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) + [2e-3, 0, 1e-3]


def rim(two) -> np.ndarray:
    """(nv, 1) False along the outline of the lower sheet."""
    free = np.ones((two.cloth.vertex_count, 1), bool)
    size = np.abs(two.flat[:, [0, 2]]).max(axis=0)
    low(two, free)[(np.abs(two.flat[:, [0, 2]]) > size - 1e-9).any(axis=1)] = False
    return free


def mean_velocity(two, part) -> np.ndarray:
    m = part(two, two.cloth.masses)
    return m @ part(two, two.step.v.to_numpy()) / m.sum()


def laid(two) -> np.ndarray:
    """Force of cloth on cloth on every vertex (nv, 3), as last looked at."""
    law, total = two.step.layers, np.zeros((two.cloth.vertex_count, 3))
    weight, load = law.weight.to_numpy()[: law.count], law.load.to_numpy()[: law.count]
    np.add.at(total, law.corner.to_numpy()[: law.count], weight[:, :, None] * load[:, None])
    return total


def height_over(two) -> np.ndarray:
    """Heights of the upper sheet's vertices over the lower sheet, where they are over it."""
    x = two.step.x.to_numpy()
    ground = LinearNDInterpolator(low(two, x)[:, [0, 2]], low(two, x)[:, 1])(high(two, x)[:, [0, 2]])
    heights = high(two, x)[:, 1] - ground
    return heights[np.isfinite(heights)]


def test_a_sheet_that_falls_onto_another_stays_on_it(two_sheets, start):
    """From 2 cm it arrives at 0.6 m/s, ten times its thickness a step, at one that is held by its rim."""
    two = two_sheets
    step = start(np.concatenate([two.flat, turned(two.flat) + [0, 0.02, 0]]), free=rim(two), **USUAL)
    touched = False
    for _ in range(10):
        # where the guarded direction leads nowhere, Newton's own does
        assert step.step(DT).accepted
        assert through(two) == 0
        touched |= bool(step.flight.touched.all())
    assert touched
    heights = height_over(two)
    assert len(heights) > 0.5 * len(two.flat) and heights.min() > 0
    # it has come to a stop within some thicknesses
    assert np.median(heights) < 3 * two.thickness


def test_at_rest_one_bears_the_weight_of_the_other(two_sheets, start):
    """The upper one may only go up and down, lest it slide."""
    two, free = two_sheets, np.tile(rim(two_sheets), 3)
    high(two, free)[:, [0, 2]] = False
    step = start(np.concatenate([two.flat, turned(two.flat) + [0, 0.9e-3, 0]]), free=free)
    dt = DT
    for _ in range(12):
        assert step.step(dt, inertia=0.0).accepted
        assert through(two) == 0
        if step.balance() < 1e-5:
            break
        dt *= 2
    assert step.balance() < 1e-5
    m, force = two.cloth.masses, laid(two)
    weight = G * high(two, m).sum()
    assert high(two, force)[:, 1].sum() == pytest.approx(weight, rel=1e-3)
    assert force.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12 * weight)
    # the rim holds both
    assert low(two, step.pulls())[~low(two, free)[:, 0], 1].sum() == pytest.approx(-G * m.sum(), rel=1e-3)


@pytest.mark.parametrize("angle", [0.1, 1.2])
def test_thrown_against_each_other_they_do_not_pass(two_sheets, start, angle):
    """Both at 5 m/s, 17 cm nearer a step, from 6 cm: 170 times the thickness."""
    two = two_sheets
    positions = np.concatenate([two.flat, turned(two.flat, angle) + [0, 0.06, 0]])
    velocities = np.repeat([[0, 5.0, 0], [0, -5.0, 0]], len(two.flat), axis=0)
    step = start(positions, velocities, gravity=(0, 0, 0), **USUAL)
    for _ in range(5):
        step.step(DT)
        assert through(two) == 0
    # the shock takes their speed, inelastic as backward Euler has it, and they have not changed sides
    assert abs(mean_velocity(two, low)[1]) < 0.5 and abs(mean_velocity(two, high)[1]) < 0.5
    # all but what has curled around the other's border
    assert np.median(height_over(two)) > 0


def test_momentum_is_kept_when_free_pieces_collide(two_sheets, start):
    two = two_sheets
    positions = np.concatenate([two.flat, turned(two.flat, 1.2) + [0, 3e-3, 0]])
    velocities = np.repeat([[0.3, 0.2, 0], [0, -0.4, 0.1]], len(two.flat), axis=0)
    step = start(positions, velocities, gravity=(0, 0, 0))
    m = two.cloth.masses
    met = False
    for _ in range(8):
        assert step.step(DT / 8).accepted
        assert through(two) == 0
        assert m @ step.v.to_numpy() == pytest.approx(m @ velocities, abs=1e-6 * m.sum())
        met |= bool(step.flight.touched.all())
    assert met
    # they have pushed each other
    assert mean_velocity(two, low)[1] < 0.1 and mean_velocity(two, high)[1] > -0.3


def test_a_strip_folds_onto_itself(two_sheets, start):
    """One end is led over the other until they touch; the other strip is far away and held."""
    two, flat, length = two_sheets, two_sheets.flat, two_sheets.flat[:, 0].max()
    positions = np.concatenate([flat, flat + [0, 1, 0]])
    free = np.zeros((len(positions), 1), bool)
    low(two, free)[np.abs(flat[:, 0]) < length - 1e-9] = True
    step = start(positions, free=free, **USUAL)
    led, targets, count = np.flatnonzero(flat[:, 0] > length - 1e-9), positions.copy(), 24
    for k in range(1, count + 1):
        angle = np.pi * k / count
        targets[led, 0] = length * np.cos(angle)
        targets[led, 1] = 5.0 + 0.5 * length * np.sin(angle) + 0.6 * two.thickness * k / count
        step.place_held(targets)
        assert step.step(DT).accepted
        assert through(two) == 0
    assert step.layers.stored > 0
    # what is held waits where it would meet cloth, and follows in the next step
    assert step.x.to_numpy()[led] == pytest.approx(targets[led], abs=0.5 * two.thickness)


def test_what_is_led_through_cloth_is_stopped(two_sheets, start):
    """A sheet that is held everywhere and led through another: it goes as near as it may and is let no further."""
    two, flat = two_sheets, two_sheets.flat
    positions = np.concatenate([flat, turned(flat) + [0, 5e-3, 0]])
    free = np.zeros((len(positions), 1), bool)
    step = start(positions, free=free, **USUAL)
    targets = positions.copy()
    high(two, targets)[:, 1] -= 0.01
    step.place_held(targets)
    for _ in range(3):
        step.step(DT, inertia=0.0)
        assert through(two) == 0
        assert height_over(two).min() > 0


def test_pieces_that_meet_no_longer_fly_freely(two_sheets, start):
    two = two_sheets
    for gap, touched in ((0.8e-3, True), (5e-3, False)):
        step = start(np.concatenate([two.flat, turned(two.flat) + [0, gap, 0]]), gravity=(0, 0, 0))
        step.balance()
        step.flight.meet(step.contact, step.layers, first=True)
        assert step.flight._now.tolist() == [touched, touched]


def test_a_restored_run_goes_on_with_the_same_bits(two_sheets, start):
    two = two_sheets
    velocities = np.repeat([[0.3, 0.2, 0], [0, -0.4, 0.1]], len(two.flat), axis=0)
    step = start(np.concatenate([two.flat, turned(two.flat, 1.2) + [0, 2e-3, 0]]), velocities, **USUAL)
    for _ in range(3):
        assert step.step(DT / 4).accepted
    kept, ends = step.state(), []
    assert kept["touched"].all()
    for _ in range(2):
        for _ in range(2):
            assert step.step(DT / 4).accepted
        ends.append((step.x.to_numpy(), step.v.to_numpy()))
        # elsewhere in between
        start(np.concatenate([two.flat, two.flat + [0, 1, 0]]), **USUAL).step(DT)
        step.restore(kept)
    for first, again in zip(*ends, strict=True):
        assert np.array_equal(first, again)


def over_each_other(two, gap) -> np.ndarray:
    """Positions of the upper sheet turned over the lower one."""
    return np.concatenate([two.flat, turned(two.flat) + [0, gap, 0]])


def test_a_step_with_more_contact_than_can_be_held_fails(two_sheets, start, monkeypatch):
    """What could be done before is kept, and done again where there is room."""
    two = two_sheets
    positions, velocities = over_each_other(two, 3e-3), np.repeat([[0, 0, 0], [0, -0.3, 0]], len(two.flat), axis=0)
    step = start(positions, velocities, **USUAL)
    monkeypatch.setattr(step.layers, "capacity", 3)
    result = step.step(DT)
    assert not result.accepted
    assert "cloth lies on cloth in" in result.reason and "places at once, 3 can be held" in result.reason
    assert np.array_equal(step.x.to_numpy(), positions) and np.array_equal(step.v.to_numpy(), velocities)
    # a step so short that they do not touch yet
    assert step.step(DT / 10).accepted
    monkeypatch.undo()
    assert step.step(DT).accepted


def test_paths_that_are_not_finite_make_the_step_fail(two_sheets, start):
    positions = over_each_other(two_sheets, 5e-3)
    step = start(positions, free=rim(two_sheets), **USUAL)
    step.place_held(positions * np.nan)
    result = step.step(DT)
    assert not result.accepted and "not finite" in result.reason
    assert np.array_equal(step.x.to_numpy(), positions)


def test_nothing_is_compiled_when_they_meet(two_sheets):
    assert two_sheets.late == []
