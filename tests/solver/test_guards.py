"""Directions that bring no cloth to cloth."""

import numpy as np

from taichi_tryon.solver import guards

DT = 1 / 60


def thrown(two, start, height):
    """A Newton direction by which the upper sheet would go through the lower one, and the path along it."""
    positions = np.concatenate([two.flat, two.flat @ np.diag([0.9, 1, 0.9]) + [1e-3, height, 1e-3]])
    step = start(positions, gravity=(0, 0, 0))
    step._begin()
    step.elastic.begin_step()
    hat = positions.copy()
    hat[len(two.flat) :, 1] -= 0.01
    step.x_hat.from_numpy(hat)
    step.way.start()
    step.way.arrive()
    step._evaluate(1 / DT)
    step._bind(1, DT)
    step._gather(1 / DT)
    step.matrix.assemble(1 / DT)
    step.linear.solve(1e-6, 500, step.reach)
    step.way.aim(step.linear.d, 0.1)
    return step


def test_springs_keep_the_way_free_where_newtons_own_direction_is_not(two_sheets, start):
    two = two_sheets
    step = thrown(two, start, 4e-3)
    assert step.layers.keep_apart() < 0.5
    step = thrown(two, start, 4e-3)
    assert guards.stay_apart(step.layers, step.linear, step.way, step.settings, step.reach) > 0
    # shortened but little, what is left being as near as the springs let it
    part = step.layers.keep_apart()
    gone = step.path.to_numpy()
    approach = gone[: len(two.flat), 1].mean() - gone[len(two.flat) :, 1].mean()
    assert part > 0.5
    assert 1e-3 < approach < 4e-3


def test_a_way_that_is_free_takes_no_springs(two_sheets, start):
    step = thrown(two_sheets, start, 0.05)
    path = step.path.to_numpy()
    assert guards.stay_apart(step.layers, step.linear, step.way, step.settings, step.reach) == 0
    assert np.array_equal(step.path.to_numpy(), path) and step.layers.count == 0
