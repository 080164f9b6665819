"""The way of the cloth: a part of a direction, measured, and shortened where cloth would meet cloth."""

from types import SimpleNamespace

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.dressing.check import crossings
from taichi_tryon.solver.way import Way
from taichi_tryon.timing import Stopwatch

COUNT = 100


@ti.data_oriented
class Nowhere:
    """A contact with a body that may be near everywhere."""

    body = SimpleNamespace(travelled=0.0)

    @ti.func
    def room(self, i: int, travelled: float) -> float:
        return 0.0


@pytest.fixture(scope="module")
def way():
    """Of points without layers, and a direction to go."""
    x, path, direction = (ti.Vector.field(3, float, shape=COUNT) for _ in range(3))
    way = Way(x, path, Nowhere(), None, Stopwatch())
    way.direction = direction
    return way


@pytest.fixture
def somewhere(way):
    rng = np.random.default_rng(0)
    at, direction = rng.normal(size=(2, COUNT, 3))
    way.x.from_numpy(at)
    way.direction.from_numpy(direction)
    return at, direction


def test_short_directions_are_gone_whole(way, somewhere):
    at, direction = somewhere
    assert way.aim(way.direction, 100.0)
    for part in (1.0, 0.25, 0.0):
        way.go(part)
        assert way.x.to_numpy() == pytest.approx(at + part * direction, abs=1e-15)


def test_no_vertex_goes_further_than_the_longest_move(way, somewhere):
    at, direction = somewhere
    assert way.aim(way.direction, 0.01)
    share = 0.01 / np.linalg.norm(direction, axis=1).max()
    way.go(1.0)
    gone = way.x.to_numpy() - at
    assert np.linalg.norm(gone, axis=1).max() == pytest.approx(0.01, rel=1e-9)
    assert gone == pytest.approx(share * direction, abs=1e-15)


def test_nowhere_to_go_is_no_fault(way, somewhere):
    way.direction.fill(0.0)
    assert way.aim(way.direction, 0.01)
    way.go(1.0)
    assert np.array_equal(way.x.to_numpy(), somewhere[0])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [0, COUNT // 2, COUNT - 1])
def test_a_direction_that_is_not_finite_is_not_gone(way, somewhere, value, place):
    at, direction = somewhere
    direction[place, 1] = value
    way.direction.from_numpy(direction)
    assert way.peak(way.direction) == np.inf
    assert not way.aim(way.direction, 0.01)
    assert np.array_equal(way.x.to_numpy(), at)


def test_the_longest_vector_is_found_wherever_it_is(way, somewhere):
    for place in (0, 1, 63, 64, COUNT - 1):
        vectors = somewhere[1].copy()
        vectors[place] = [30.0, -40.0, 0.0]
        way.direction.from_numpy(vectors)
        assert way.peak(way.direction) == pytest.approx(50, rel=1e-12)


def test_how_far_it_has_gone_is_measured(way, somewhere):
    at, direction = somewhere
    way.direction.from_numpy(at + direction)
    far = way.gone_from(way.direction)
    assert far == pytest.approx(np.linalg.norm(direction, axis=1).max(), rel=1e-12)


def test_without_layers_it_arrives_wherever_it_is_moved(way, somewhere):
    way.start()
    way.x.fill(7.0)
    way.arrive()
    assert (way.x.to_numpy() == 7.0).all()


def test_with_layers_it_arrives_as_near_as_they_let_it(two_sheets, start):
    """Led through each other the sheets stop before; led apart they are where they were led, to the last bit."""
    two, flat = two_sheets, two_sheets.flat
    above = np.concatenate([flat, flat @ np.diag([0.9, 1, 0.9]) + [0, 4e-3, 0]])
    c, s = np.cos(0.3), np.sin(0.3)
    turned = above[len(flat) :] @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) + [0, 3e-3, 0]
    for upper, free in ((above[len(flat) :] - [0, 0.01, 0], False), (turned, True)):
        step = start(above)
        end = np.concatenate([flat, upper])
        step.way.start()
        step.x.from_numpy(end)
        step.way.arrive()
        x = step.x.to_numpy()
        assert len(crossings(x, two.cloth.triangles)) == 0
        assert (x[len(flat) :, 1].min() > flat[:, 1].max()) and np.array_equal(x, end) == free
        # four fifths of the distance are gone
        if not free:
            assert x[len(flat) :, 1].min() - x[: len(flat), 1].max() < 0.25 * 4e-3


class Layers:
    """Counts how often it is looked who may meet; nobody does."""

    looks = 0

    def look_ahead(self):
        self.looks += 1

    def keep_apart(self, alike=False):
        return 1.0


def test_what_was_left_where_it_had_looked_does_not_look_again(somewhere):
    x, path, direction = (ti.Vector.field(3, float, shape=COUNT) for _ in range(3))
    way = Way(x, path, Nowhere(), Layers(), Stopwatch())
    x.from_numpy(somewhere[0])
    direction.from_numpy(somewhere[1])
    way.start()
    way.arrive()
    assert way.layers.looks == 1
    way.aim(direction, 100.0)
    way.go(0.5)
    way.start()
    way.arrive()
    assert way.layers.looks == 2


@pytest.mark.parametrize(("early", "late"), [(1e-12, 0.0), (0.0, 1e-12), (np.nan, 0.0)])
def test_what_others_moved_looks_again(somewhere, early, late):
    x, path, direction = (ti.Vector.field(3, float, shape=COUNT) for _ in range(3))
    way = Way(x, path, Nowhere(), Layers(), Stopwatch())
    x.from_numpy(somewhere[0])
    direction.from_numpy(somewhere[1])
    way.aim(direction, 100.0)
    way.go(0.5)
    x[0] += early
    way.start()
    x[1] += late
    way.arrive()
    assert way.layers.looks == 2
