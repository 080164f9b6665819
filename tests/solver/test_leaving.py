"""How long a step goes on for cloth in the body: not for what did not come out in the last steps."""

from dataclasses import replace
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tryon.solver.leaving import PATIENCE, WAIT, Leaving
from taichi_tryon.solver.settings import StepSettings

LIMITS = StepSettings(
    tolerance=0.05,
    max_newton_iterations=2,
    linear_tolerance=0.01,
    max_linear_iterations=500,
    longest_move=0.02,
    max_newton_inside=8,
)


@pytest.fixture
def course():
    """Runs a stage in which cloth is so deep [m] after each iteration; how many iterations it takes."""

    def run(depths, limits=LIMITS) -> int:
        leaving.begin()
        for iterations in count(1):
            depth = depths[min(iterations, len(depths)) - 1]
            leaving.contact = SimpleNamespace(inside=depth)
            if not leaving.goes_on(iterations, limits):
                break
        leaving.end()
        return iterations

    leaving = Leaving(None)
    run.leaving = leaving
    return run


def test_outside_a_step_ends(course):
    assert course([1e-4, 0.0]) == 2


def test_what_comes_out_is_waited_for(course):
    out = [1e-3, 8e-4, 5e-4, 2e-4, 0.0]
    assert [course(out) for _ in range(3)] == [5, 5, 5]
    assert [course([1e-3 * 0.95**i for i in range(8)]) for _ in range(3)] == [8, 8, 8]


def test_what_does_not_come_out_for_long_is_given_up(course):
    many = replace(LIMITS, max_newton_inside=200)
    sinks = [1e-3 * 0.98**i for i in range(300)]
    assert course(sinks, many) == 200
    assert course([1e-3], many) == 2 + PATIENCE
    assert 50 < course([*sinks[:50], *[5e-4] * 200], many) <= 50 + PATIENCE


def test_what_is_stuck_is_tried_again_later(course):
    assert [course([1e-5]) for _ in range(2 * WAIT + 3)] == [8, *[2] * WAIT, 8, *[2] * WAIT, 8]


def test_what_is_much_deeper_is_not_what_is_stuck(course):
    assert course([1e-5]) == 8
    assert course([1e-3, 9e-4, 5e-4, 1.5e-5, 0.0]) == 4
    assert course([1e-5]) == 2


def test_what_is_deep_is_tried_in_every_step(course):
    assert [course([2e-4]) for _ in range(3)] == [8, 8, 8]


def test_what_jumps_back_in_is_not_stuck_there(course):
    """Only what never was less deep is: not that at which the stage ended."""
    assert course([1e-5, 1e-5, 1e-5, 5e-4]) == 8
    assert course([1e-4]) == 8


def test_restored_it_goes_on_alike(course):
    course([1e-5])
    state = course.leaving.state()
    ends = []
    for _ in range(2):
        ends.append([course([depth]) for depth in (1e-5, 3e-5, *[1e-5] * WAIT)])
        course.leaving.restore(state)
    assert ends[0] == ends[1] and {2, 8} == set(ends[0])
    course.leaving.restore({name: np.zeros_like(values) for name, values in state.items()})
    assert course([1e-5]) == 8
