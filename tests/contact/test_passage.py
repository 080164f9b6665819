"""How far two pieces may go: never so far that they meet, and far enough to be of use."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.contact.distance import EDGES, FACE
from taichi_tryon.contact.passage import KEPT, free_part, reach


@ti.kernel
def _pass(kind: ti.types.ndarray(), at: ti.types.ndarray(), path: ti.types.ndarray(), out: ti.types.ndarray()):
    for p in range(kind.shape[0]):
        a, b, c, d = _vector(at, p, 0), _vector(at, p, 1), _vector(at, p, 2), _vector(at, p, 3)
        da, db, dc, dd = _vector(path, p, 0), _vector(path, p, 1), _vector(path, p, 2), _vector(path, p, 3)
        out[p, 0] = free_part(kind[p], a, b, c, d, da, db, dc, dd)
        out[p, 1] = reach(kind[p], da, db, dc, dd)


@ti.func
def _vector(rows: ti.template(), p: int, k: int):
    return ti.Vector([rows[p, k, 0], rows[p, k, 1], rows[p, k, 2]])


def passed(kind, at, path):
    """Free parts and reaches, each (n,)."""
    at, path = (np.ascontiguousarray(np.asarray(v, float).reshape(-1, 4, 3)) for v in (at, path))
    out = np.empty((len(at), 2))
    _pass(np.broadcast_to(np.asarray(kind, np.int32), len(at)).copy(), at, path, out)
    return out.T


def along(closest, kind, at, path, until, samples=200):
    """Least distance (n,) of each pair on its way, sampled evenly."""
    kinds = np.full(len(at), kind)
    parts = np.linspace(0, 1, samples)[:, None, None, None] * np.reshape(until, (-1, 1, 1))
    return np.min([closest(kinds, at + part * path)[1] for part in parts], axis=0)


def random_ways(kind: int, count=3000):
    """Pairs and paths of all sizes, many of which would cross."""
    rng = np.random.default_rng(10 + kind)
    at = rng.normal(size=(count, 4, 3)) * rng.choice([0.1, 1.0], size=(count, 1, 1))
    other = slice(1 if kind == FACE else 2, None)
    at[:, other, 2] += rng.choice([0.0, 1.0], size=(count, 1))
    path = rng.normal(size=(count, 4, 3)) * rng.choice([0.01, 0.3, 3.0], size=(count, 1, 1))
    towards = at[:, other].mean(axis=1) - at[:, : other.start].mean(axis=1)
    path[:, : other.start] += (rng.choice([0.0, 1.0, 2.0], size=(count, 1)) * towards)[:, None]
    # a common motion, which must not count
    return at, path + rng.normal(size=(count, 1, 3)) * rng.choice([0.0, 10.0], size=(count, 1, 1))


@pytest.mark.parametrize("kind", [FACE, EDGES])
def test_a_part_of_the_distance_is_kept_all_the_way(closest, kind):
    at, path = random_ways(kind)
    free, _ = passed(kind, at, path)
    assert free.min() >= 0 and free.max() == 1
    limited = free < 1
    assert 0.1 < limited.mean() < 0.9
    start = closest(np.full(len(at), kind), at)[1]
    kept = along(closest, kind, at, path, free) / start
    assert kept.min() >= KEPT * (1 - 1e-9)
    # it is no idle bound: were the whole way gone, many would have come nearer than that
    assert (along(closest, kind, at, path, np.ones(len(at)))[limited] < KEPT * start[limited]).mean() > 0.2


@pytest.mark.parametrize("kind", [FACE, EDGES])
def test_what_stays_apart_on_the_whole_way_by_its_reach_is_free(closest, kind):
    at, path = random_ways(kind)
    free, most = passed(kind, at, path)
    start = closest(np.full(len(at), kind), at)[1]
    assert (free[(1 - KEPT) * start >= most] == 1).all()
    assert ((1 - KEPT) * start >= most).mean() > 0.1


@pytest.mark.parametrize("kind", [FACE, EDGES])
def test_no_path_changes_the_distance_by_more_than_its_reach(closest, kind):
    at, path = random_ways(kind)
    kinds = np.full(len(at), kind)
    change = abs(closest(kinds, at + path)[1] - closest(kinds, at)[1])
    assert (change <= passed(kind, at, path)[1] * (1 + 1e-9) + 1e-12).all()


VERTEX_OVER_FACE = np.array([[0.3, 0.3, 0.01], [0, 0, 0], [1, 0, 0], [0, 1, 0]])
EDGE_OVER_EDGE = np.array([[-1, 0, 0.01], [1, 0, 0.01], [0, -1, 0], [0, 1, 0]])
HEAD_ON = [(FACE, VERTEX_OVER_FACE, 1), (EDGES, EDGE_OVER_EDGE, 2)]


@pytest.mark.parametrize("kind, at, first", HEAD_ON)
@pytest.mark.parametrize("speed", [0.0101, 0.02, 0.5])
def test_head_on_four_fifths_of_the_distance_are_gone(kind, at, first, speed):
    for share in (0.0, 0.5, 1.0):
        path = np.zeros((4, 3))
        path[:first, 2], path[first:, 2] = -share * speed, (1 - share) * speed
        gone = passed(kind, at, path)[0][0] * speed / 0.01
        assert 0.78 < gone <= 1 - KEPT + 1e-12


@pytest.mark.parametrize("kind, at, first", HEAD_ON)
def test_what_moves_apart_or_together_is_not_limited(kind, at, first):
    apart = np.zeros((4, 3))
    apart[:first, 2] = 5.0
    assert passed(kind, at, apart)[0][0] == 1
    assert passed(kind, at, np.ones((4, 3)) * [3.0, -7.0, 2.0])[0][0] == 1
    assert passed(kind, at, np.zeros((4, 3)))[0][0] == 1


@pytest.mark.parametrize("kind, at, first", HEAD_ON)
@pytest.mark.parametrize("times", [2, 10, 30])
def test_sliding_past_is_not_limited(kind, at, first, times):
    """Side by side at a constant distance, some times that far."""
    path = np.zeros((4, 3))
    path[:first, 0] = times * 0.01
    assert passed(kind, at, path)[0][0] == 1
