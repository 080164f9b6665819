"""Lists of balls by cells against the balls themselves."""

import numpy as np
import pytest

from taichi_tryon.body import cells
from taichi_tryon.body.cells import BallCells
from taichi_tryon.body.reach import Reach
from taichi_tryon.body.skeleton import Pose, rotation_matrix


def place(grid: BallCells, balls) -> None:
    """Place all balls, asked for everywhere."""
    grid.place(balls, np.ones(len(balls.weights), bool), np.full(3, -np.inf), np.full(3, np.inf))


def lists(grid: BallCells, x: np.ndarray, count: int) -> np.ndarray:
    """Which of ``count`` balls (k, count) are listed for points x (k, 3), looked up in NumPy; they rise in a list."""
    shape, first, ball = grid.shape.to_numpy(), grid.first.to_numpy(), grid.ball.to_numpy()
    index = np.floor((x - grid.origin.to_numpy()) / grid.size[None]).astype(int)
    on = ((index >= 0) & (index < shape)).all(axis=1)
    at = np.where(on, (index[:, 0] * shape[2] + index[:, 2]) * shape[1] + index[:, 1], shape.prod())
    found = np.zeros((len(x), count), bool)
    for row, c in zip(found, at, strict=True):
        mine = ball[first[c] : first[c + 1]]
        assert (np.diff(mine) > 0).all()
        row[mine] = True
    return found


@pytest.fixture(scope="module")
def stepping(woman, pose):
    """The woman's balls in a step."""
    return woman.posed(woman.skeleton.transforms(pose("step_forward_right")))


def reach(balls, x: np.ndarray) -> np.ndarray:
    """Which balls (k, count) reach points x (k, 3)."""
    r = x[:, None] - balls.centers
    return np.einsum("kni,nij,knj->kn", r, balls.quadratics, r) < 1


def points(balls, count: int) -> np.ndarray:
    low, high = (balls.centers - balls.extents).min(axis=0), (balls.centers + balls.extents).max(axis=0)
    return np.random.default_rng(5).uniform(low - 0.02, high + 0.02, (count, 3))


def test_every_ball_that_reaches_a_point_is_listed_and_few_more(stepping):
    grid = BallCells(len(stepping.weights))
    place(grid, stepping)
    x = points(stepping, 3000)
    listed, reaching = lists(grid, x, len(stepping.weights)), reach(stepping, x)
    assert reaching.sum() > 1000 and not (reaching & ~listed).any()
    assert listed.sum() < 2.2 * reaching.sum()


@pytest.mark.parametrize(("name", "most"), [("MAX_CELLS", 200), ("MAX_ENTRIES", 1500)])
def test_cells_grow_until_they_fit(stepping, monkeypatch, name, most):
    monkeypatch.setattr(cells, name, most)
    grid = BallCells(len(stepping.weights))
    place(grid, stepping)
    counts = {"MAX_CELLS": grid.shape.to_numpy().prod(), "MAX_ENTRIES": grid.first.to_numpy().max()}
    assert 0.2 * most < counts[name] <= most
    x = points(stepping, 1000)
    assert not (reach(stepping, x) & ~lists(grid, x, len(stepping.weights))).any()


def test_where_points_are_asked_for_within_a_box_grid_and_lists_are_its_own(stepping):
    """Around a foot: every ball that reaches a point there is listed, the others hardly anywhere."""
    foot = stepping.centers[stepping.centers[:, 1].argmin()]
    box = Reach(0.0)
    box.hold(foot - 0.05, foot + 0.05)
    low, high, near = box.low, box.high, box.meets(stepping)
    count, grid, whole = len(near), BallCells(len(near)), BallCells(len(near))
    place(whole, stepping)
    grid.place(stepping, near, low, high)
    assert 0 < near.sum() < 0.3 * count
    corner, width = grid.origin.to_numpy(), grid.shape.to_numpy() * grid.size[None]
    assert (corner >= low - 1e-6).all() and (corner + width <= high + grid.size[None] + 1e-6).all()
    x = np.random.default_rng(5).uniform(low, high, (3000, 3))
    listed, reaching = lists(grid, x, count), reach(stepping, x)
    assert reaching.sum() > 1000 and not (reaching & ~listed).any()
    ends = [cells.first[int(cells.shape.to_numpy().prod()) + 1] for cells in (grid, whole)]
    assert 0 < ends[0] < 0.2 * ends[1]


def test_an_endless_ball_is_listed_everywhere_it_reaches(one_ball):
    """A turned cylinder along x, and nothing that is bounded: one cell, and the list off the grid."""
    body = one_ball([10, np.inf, 10])
    lying = body.posed(body.skeleton.transforms(Pose("lying", {"root": rotation_matrix([0, 0, 90])})))
    grid = BallCells(1)
    place(grid, lying)
    x = lying.centers + np.array([[5.0, 0.0, 0.0], [-0.3, 0.05, 0.05], [0.4, -0.05, 0.0]])
    assert lists(grid, x, 1).all()


def test_the_same_balls_give_the_same_lists(stepping, woman, pose):
    grid = BallCells(len(stepping.weights))
    tables = []
    for name in ("step_forward_right", "standing", "step_forward_right"):
        place(grid, woman.posed(woman.skeleton.transforms(pose(name))))
        end = grid.first.to_numpy()[grid.shape.to_numpy().prod() + 1]
        tables.append(grid.ball.to_numpy()[:end].tobytes())
    assert tables[0] == tables[2] != tables[1]
