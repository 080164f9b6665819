"""A box that grows, and a field that leaves out what does not reach into it: no bit of an answer changes."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.body.field import WALK, BodyField
from taichi_tryon.body.reach import SPARE, Reach

COUNT = 1000


def test_the_box_grows_ahead_of_what_it_is_to_hold():
    reach = Reach(0.2)
    low, high = np.array([0.0, 1.0, 0.0]), np.array([1.0, 2.0, 1.0])
    assert reach.hold(low, high)
    assert np.allclose(reach.low, low - 0.2 - SPARE) and np.allclose(reach.high, high + 0.2 + SPARE)
    assert not reach.hold(low - 0.99 * SPARE, high + 0.99 * SPARE)
    assert reach.hold(low, high + [0, 0, 1.01 * SPARE])
    assert reach.high == pytest.approx(high + [0.2 + SPARE, 0.2 + SPARE, 0.2 + 2.01 * SPARE])
    assert not reach.hold(low, high)
    # what is not a number is nowhere
    reach.hold(np.full(3, np.nan), high)
    assert np.isfinite(reach.low).all()


def test_balls_reach_into_the_box_by_their_own_extent(floor_and_ball):
    """The ball's density ends 0.1414 m from (0, 1, 0), the floor's below."""
    reach = Reach(0.0)
    for gap, meets in ((0.01, False), (-0.01, True)):
        low = 1.0 + 0.1 * np.sqrt(2) + SPARE + gap
        reach.low, reach.high = np.full(3, np.inf), np.full(3, -np.inf)
        reach.hold(np.array([-0.1, low, -0.1]), np.array([0.1, low + 1, 0.1]))
        assert reach.meets(floor_and_ball.balls).tolist() == [False, meets]


@ti.data_oriented
class Asked:
    """Answers of a field at points."""

    def __init__(self, field):
        self.field = field
        self.x = ti.Vector.field(3, float, COUNT)
        self.answer = ti.Vector.field(9, float, COUNT)

    @ti.kernel
    def _ask(self):
        for i in self.x:
            gap, normal, winner = self.field.gap(self.x[i])
            shift = self.field.motion(self.x[i], winner)
            room = self.field.clearance(self.field.density(self.x[i]))
            for k in ti.static(range(3)):
                self.answer[i][k], self.answer[i][3 + k] = normal[k], shift[k]
            self.answer[i][6], self.answer[i][7], self.answer[i][8] = gap, room, ti.cast(winner, float)

    def at(self, x):
        self.x.from_numpy(x)
        self._ask()
        return self.answer.to_numpy()


def test_answers_are_the_same_bits(woman, pose):
    """Around a foot, then also around a hand, while the woman moves."""
    whole, part = Asked(BodyField(woman)), Asked(BodyField(woman, everywhere=False))
    before, now = (woman.skeleton.transforms(pose(name)) for name in ("standing", "step_forward_right"))
    for asked in (whole, part):
        asked.field.set_pose(before)
        asked.field.set_pose(now, before)
    balls = woman.posed(now)
    foot, hand = balls.centers[balls.centers[:, 1].argmin()], balls.centers[balls.centers[:, 0].argmax()]
    rng, listed = np.random.default_rng(5), []
    for where in (foot, (foot + hand) / 2, hand):
        points = where + rng.uniform(-0.1, 0.1, (COUNT, 3))
        part.field.cover(points.min(axis=0), points.max(axis=0))
        assert np.array_equal(part.at(points), whole.at(points))
        listed.append(int(part.field.near.sum()))
    assert 0 < listed[0] < listed[1] < listed[2] < len(balls.weights)
    assert np.array_equal(part.field.ever_near, part.field.near)
    # it moves into the box, and out of it
    part.field.set_pose(before, now)
    whole.field.set_pose(before, now)
    assert np.array_equal(part.at(points), whole.at(points))
    assert part.field.ever_near.sum() >= listed[-1] and WALK > 0.1
