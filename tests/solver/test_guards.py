"""Directions that bring no cloth to cloth, what they cost, and what is done where they fail."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from taichi_tryon.dressing.check import crossings
from taichi_tryon.solver import guards
from taichi_tryon.timing import Stopwatch

DT, LONGEST = 1 / 60, 0.1


def thrown(two, start, height):
    """A Newton direction by which the upper sheet would go through the lower one, and the path along it."""
    positions = np.concatenate([two.flat, two.flat @ np.diag([0.9, 1, 0.9]) + [1e-3, height, 1e-3]])
    step = start(positions, gravity=(0, 0, 0))
    step._begin()
    step.elastic.begin_step()
    hat = positions.copy()
    hat[len(two.flat) :, 1] -= 0.01
    step.potential.x_hat.from_numpy(hat)
    step.way.start()
    step.way.arrive()
    step.potential.begin(1 / DT, DT)
    step.newton.settings = step.settings
    step.newton.slope()
    step.newton._assemble(exact=False)
    step.newton._solve(refresh=True)
    assert step.newton._aim(LONGEST)
    return step


def stay_apart(step) -> bool:
    return guards.stay_apart(step.layers, step.newton.linear, step.way.clock, LONGEST, step.newton._aim)


def test_springs_keep_the_way_free_where_newtons_own_direction_is_not(two_sheets, start):
    two = two_sheets
    step = thrown(two, start, 4e-3)
    assert step.layers.keep_apart() < 0.5
    step = thrown(two, start, 4e-3)
    assert stay_apart(step) and step.layers.count > 0
    # shortened but little, what is left being as near as the springs let it
    part = step.layers.keep_apart()
    gone = step.path.to_numpy()
    approach = gone[: len(two.flat), 1].mean() - gone[len(two.flat) :, 1].mean()
    assert part > 0.5
    assert 1e-3 < approach < 4e-3


def test_a_way_that_is_free_takes_no_springs(two_sheets, start):
    step = thrown(two_sheets, start, 0.05)
    path = step.path.to_numpy()
    assert stay_apart(step)
    assert np.array_equal(step.path.to_numpy(), path) and step.layers.count == 0


def test_springs_in_a_matrix_that_is_not_positive_definite_get_one_that_is(two_sheets, start):
    """The upper sheet is pressed together by a tenth: its exact Hessian is not."""
    step = thrown(two_sheets, start, 4e-3)
    step.newton._assemble(exact=True)
    # stiff springs leave single precision about two digits
    step.newton.settings = replace(step.settings, linear_tolerance=1e-2)
    assert stay_apart(step) and step.layers.count > 0
    assert not step.newton._exact and step.newton.linear.indefinite[None] == 0
    assert step.layers.keep_apart() > 0.5


def test_a_direction_that_is_not_finite_ends_the_search_for_springs(two_sheets, start):
    step, asked = thrown(two_sheets, start, 4e-3), []

    def aim(longest, anew):
        asked.append(anew)
        return not anew

    assert not guards.stay_apart(step.layers, step.newton.linear, step.way.clock, LONGEST, aim)
    assert asked == [False, True]


def test_where_springs_fail_newtons_own_direction_is_gone(two_sheets, start, monkeypatch):
    two = two_sheets
    monkeypatch.setattr(guards, "stay_apart", lambda *_: False)
    positions = np.concatenate([two.flat, two.flat @ np.diag([0.9, 1, 0.9]) + [1e-3, 4e-3, 1e-3]])
    step = start(positions, gravity=(0, 0, 0), max_newton_iterations=2)
    assert step.step(DT).accepted
    assert not np.array_equal(step.x.to_numpy(), positions)
    assert len(crossings(step.x.to_numpy(), two.cloth.triangles)) == 0


def test_what_layers_take_counts_as_contact_and_solving_does_not(two_sheets, start, monkeypatch):
    two, running, seen = two_sheets, [], []

    @contextmanager
    def clock(_, stage):
        running.append(stage)
        yield
        running.pop()

    def spied(owner, name):
        real = getattr(owner, name)

        def spy(*arguments, **named):
            seen.append((name, "contact" in running))
            return real(*arguments, **named)

        monkeypatch.setattr(owner, name, spy)

    positions = np.concatenate([two.flat, two.flat @ np.diag([0.9, 1, 0.9]) + [1e-3, 3e-3, 1e-3]])
    step = start(positions, np.repeat([[0, 1.0, 0], [0, -1.0, 0]], len(two.flat), axis=0), max_newton_iterations=4)
    parts = ("look_ahead", "would_meet", "guard", "push", "keep_apart", "evaluate", "bind")
    for name in parts:
        spied(step.layers, name)
    spied(step.newton.linear, "solve")
    monkeypatch.setattr(Stopwatch, "__call__", clock)
    step.step(DT)
    assert {name for name, _ in seen} == {*parts, "solve"}
    assert all(timed == (name != "solve") for name, timed in seen)
