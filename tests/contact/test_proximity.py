"""Which pairs are found: all that may come near, none that share a corner, each once, in the same order."""

from types import SimpleNamespace

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.cloth.model import Cloth
from taichi_tryon.contact.distance import EDGES, FACE
from taichi_tryon.contact.proximity import Proximity
from taichi_tryon.errors import StepFailure

THICKNESS = 2e-3


@pytest.fixture(scope="module")
def two(make_sheet, moduli):
    """Two pieces of 4 by 3 cm, and what finds their pairs."""
    sheet = make_sheet(0.04, 0.03, 0.01)
    cloth = Cloth.join([(sheet, moduli)] * 2)
    x, path = (ti.Vector.field(3, float, shape=cloth.vertex_count) for _ in range(2))
    flat = np.column_stack([sheet.points, np.zeros(len(sheet.points))])
    search = Proximity(cloth, x, path, THICKNESS, edge_length=0.01)

    def find(at, way):
        x.from_numpy(at)
        path.from_numpy(way)
        return search.find()

    return SimpleNamespace(cloth=cloth, flat=flat, search=search, find=find)


def crumpled(two, seed, size=4e-3, way=6e-3):
    """One piece over the other, both shaken, on their ways somewhere."""
    rng = np.random.default_rng(seed)
    at = np.concatenate([two.flat, two.flat[:, [1, 0, 2]] + [0, 0, 8e-3]])
    return at + rng.normal(size=at.shape) * size, rng.normal(size=at.shape) * way


def all_pairs(cloth):
    """Kinds (k,) and corners (k, 4) of all pairs that share no corner."""
    edges, triangles, nv = cloth.hinges[:, :2], cloth.triangles, cloth.vertex_count
    v, t = np.divmod(np.arange(nv * len(triangles)), len(triangles))
    faces = np.column_stack([v, triangles[t]])
    a, b = np.triu_indices(len(edges), 1)
    crossed = np.hstack([edges[a], edges[b]])
    corners = np.concatenate([faces, crossed])
    kind = np.repeat([FACE, EDGES], [len(faces), len(crossed)])
    alone = (np.diff(np.sort(corners, axis=1), axis=1) > 0).all(axis=1)
    return kind[alone], corners[alone]


def names(kind, corners):
    return {(int(k), *map(int, c)) for k, c in zip(kind, corners, strict=True)}


@pytest.mark.parametrize("seed", range(3))
def test_all_that_come_near_on_the_way_are_found(two, closest, seed):
    at, way = crumpled(two, seed)
    kind, corners = all_pairs(two.cloth)
    least = np.min([closest(kind, (at + part * way)[corners])[1] for part in np.linspace(0, 1, 21)], axis=0)
    near = least < THICKNESS
    assert near.sum() > 100
    pairs = two.find(at, way)
    found = names(pairs.kind, pairs.corners)
    assert names(kind[near], corners[near]) <= found
    # no name twice, nothing but pairs that there are, and not simply all of them
    assert len(found) == len(pairs) and found <= names(kind, corners)
    assert len(pairs) < 0.5 * len(kind)


def test_at_rest_those_nearer_than_the_distance_are_found_and_no_others(two, closest):
    at, _ = crumpled(two, 5)
    kind, corners = all_pairs(two.cloth)
    near = closest(kind, at[corners])[1] < THICKNESS
    pairs = two.find(at, np.zeros_like(at))
    assert names(pairs.kind, pairs.corners) == names(kind[near], corners[near])
    assert 20 < len(pairs) < len(kind)


def test_no_pair_shares_a_corner(two):
    at, way = crumpled(two, 0)
    assert (np.diff(np.sort(two.find(at, way).corners, axis=1), axis=1) > 0).all()


def test_the_same_order_every_run(two):
    at, way = crumpled(two, 1)
    first = two.find(at, way)
    assert (np.diff(first.key) > 0).all()
    for _ in range(5):
        again = two.find(at, way)
        assert np.array_equal(again.key, first.key) and np.array_equal(again.corners, first.corners)


def test_a_key_names_a_pair_for_good(two):
    """Of what else is near it says nothing."""
    at, way = crumpled(two, 1)
    many, few = two.find(at, way), two.find(at, 0.1 * way)
    same = np.isin(many.key, few.key)
    assert same.sum() == len(few) < len(many)
    assert np.array_equal(many[same].corners, few.corners) and np.array_equal(many[same].kind, few.kind)


def test_flat_and_apart_nothing_is_found(two):
    at = np.concatenate([two.flat, two.flat + [0, 0, 1.01 * THICKNESS]])
    pairs = two.find(at, np.zeros_like(at))
    assert len(pairs) == 0 and pairs.corners.shape == (0, 4) and len(pairs[pairs.kind == FACE]) == 0


def test_a_vertex_far_away_hides_nothing(two):
    """Long boxes in many cells, in a grid as coarse as it must be."""
    at, way = crumpled(two, 2)

    def others(pairs):
        return {name for name in names(pairs.kind, pairs.corners) if 3 not in name[1:]}

    whole = others(two.find(at, way))
    assert len(whole) > 100
    for far in ([50.0, 20.0, -30.0], [0.0, 1e6, 0.0]):
        thrown = at.copy()
        thrown[3] = far
        assert others(two.find(thrown, way)) == whole


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_nowhere_is_told(two, value):
    at, way = crumpled(two, 2)
    at[3, 1] = value
    with pytest.raises(StepFailure, match="not finite"):
        two.find(at, way)


def test_crowded_vertices_find_all_their_neighbours(two, closest):
    """All in a heap: many more for each than there are places at first."""
    rng = np.random.default_rng(3)
    at = rng.normal(size=(two.cloth.vertex_count, 3)) * 1e-4
    kind, corners = all_pairs(two.cloth)
    assert len(two.find(at, np.zeros_like(at))) == len(kind)
    assert (closest(kind, at[corners])[1] < THICKNESS).all()


def test_what_leaves_its_margin_finds_its_pairs_anew(two, closest):
    """Cloth that hardly moves but for a vertex or two at a time: the same pairs as if all of them had been looked
    for."""
    rng = np.random.default_rng(4)
    at, _ = crumpled(two, 4)
    kind, corners = all_pairs(two.cloth)
    still = np.zeros_like(at)
    two.find(at, still)
    went = []
    for _ in range(30):
        path = rng.normal(size=at.shape) * 5e-5
        path[rng.integers(len(at), size=2)] *= 40
        least = np.min([closest(kind, (at + part * path)[corners])[1] for part in np.linspace(0, 1, 11)], axis=0)
        pairs = two.find(at, path)
        went.append(two.search.restless.sum())
        assert names(kind[least < THICKNESS], corners[least < THICKNESS]) <= names(pairs.kind, pairs.corners)
        assert (np.diff(pairs.key) > 0).all()
        at = at + path
    assert 10 < np.count_nonzero(went) and max(went) < 0.2 * len(at)
    kept = two.find(at, still)
    two.search.known = None
    assert np.array_equal(two.find(at, still).key, kept.key)


def test_what_moves_as_a_whole_is_not_looked_at_anew(two, closest):
    """Thrown, by many margins at a time, it is as if it lay still; a corner that then lags behind is found out."""
    at, _ = crumpled(two, 6)
    kind, corners = all_pairs(two.cloth)
    still, throw = np.zeros_like(at), np.full_like(at, 0.03)
    rest = two.find(at, still)
    for _ in range(5):
        thrown = two.find(at, throw)
        assert not two.search.restless.any()
        assert np.array_equal(thrown.key, rest.key)
        at = at + throw
    throw[7] = 0
    pairs = two.find(at, throw)
    assert two.search.restless[7] == 1
    least = np.min([closest(kind, (at + part * throw)[corners])[1] for part in np.linspace(0, 1, 101)], axis=0)
    near = (least < THICKNESS) & (corners == 7).any(axis=1)
    assert near.sum() > 5
    assert names(kind[near], corners[near]) <= names(pairs.kind, pairs.corners)
