"""What is seen of a run: frames between steps, strain, depth in the ball."""

import numpy as np
import pytest

from taichi_tryon.bench.pareto.problem import FRAME, Problem
from taichi_tryon.bench.pareto.track import Tracker


def tracker(cloth, positions, velocities, moment=FRAME, ball=None, layers=False):
    of = Problem("any", 0.1, 9, "table1", FRAME, ball=ball, moment=moment, layers=layers)
    return Tracker(cloth, positions, velocities, of)


def test_frames_between_steps_are_on_the_cubic_of_both_ends(cloth, sheet):
    flat = np.column_stack([sheet.points, np.zeros(len(sheet.points))])
    drop, speed = (lambda t: -3 * t**2 - 40 * t**3), (lambda t: -6 * t - 120 * t**2)
    at = lambda t: (t, flat + [0, drop(t), 0], np.full_like(flat, 0) + [0, speed(t), 0])  # noqa: E731
    seen = tracker(cloth, *at(0.0)[1:], moment=3 * FRAME)
    for time in (0.4 * FRAME, 2.5 * FRAME, 3.2 * FRAME, 5 * FRAME):
        seen.seen(*at(time))
    track = seen.track(2.0, 1.0, 4 * FRAME)
    assert len(track.lowest) == 5 and track.frames == pytest.approx(4)
    assert track.lowest == pytest.approx([drop(k * FRAME) for k in range(1, 6)], abs=1e-12)
    assert track.positions == pytest.approx(at(3 * FRAME)[1], abs=1e-12)


@pytest.mark.parametrize("axis", (0, 1))
def test_strain_is_that_along_the_yarns(cloth, sheet, axis):
    flat = np.column_stack([sheet.points, np.zeros(len(sheet.points))])
    stretched = flat * np.where(np.arange(3) == axis, 1.01, 1.002)
    seen = tracker(cloth, flat, np.zeros_like(flat))
    seen.seen(FRAME, stretched, np.zeros_like(flat))
    assert seen.track(0, 0, FRAME).strain == pytest.approx([0.01], rel=1e-9)


@pytest.mark.parametrize(
    ("shift", "depth"),
    [
        ((-0.06, -0.05, 0.3), 0.2),  # the middle of a triangle or an edge above the centre
        ((-0.06, 0.3, 0.0), 0.2),  # the lower edge
        ((0.3, 0.4, 0.0), 0.0),  # a corner, on the ball
        ((0.3, 0.3, 0.0), 0.5 - 0.3 * np.sqrt(2)),
        ((0.0, 0.0, 0.6), 0.0),
    ],
)
def test_depth_is_that_of_the_nearest_point_of_any_triangle(cloth, sheet, shift, depth):
    flat = np.column_stack([sheet.points, np.zeros(len(sheet.points))])
    seen = tracker(cloth, flat, np.zeros_like(flat), ball=0.5)
    seen.seen(FRAME, flat + shift, np.zeros_like(flat))
    assert seen.track(0, 0, FRAME).depth == pytest.approx([depth], abs=1e-12)


def test_crossings_are_counted_at_every_frame_where_cloth_meets_cloth(cloth, sheet):
    flat = np.column_stack([sheet.points, np.zeros(len(sheet.points))])
    still = np.zeros_like(flat)
    # wound up: the right half is led through the left one
    wound = flat * [1, 1, 0] + 0.03 * np.column_stack([0 * flat[:, 0], 0 * flat[:, 0], np.sin(150 * flat[:, 0])])
    wound[:, 0] = 0.5 * wound[:, 0] + 0.02 * np.sin(300 * flat[:, 0])
    seen = tracker(cloth, flat, still, layers=True)
    for frame, x in enumerate((flat, wound, flat), 1):
        seen.seen(frame * FRAME, x, still)
    counts = seen.track(0, 0, 3 * FRAME).crossings
    assert counts[0] == counts[2] == 0 and counts[1] > 0
    plain = tracker(cloth, flat, still)
    plain.seen(FRAME, wound, still)
    assert plain.track(0, 0, FRAME).crossings is None
