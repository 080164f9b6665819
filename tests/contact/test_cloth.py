"""Contact of cloth with cloth: value, force and Hessian belong together; the way ahead is kept free."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.cloth.model import Cloth
from taichi_tryon.contact.cloth import SHARE, ClothContact
from taichi_tryon.contact.proximity import Pairs
from taichi_tryon.dressing.check import crossings

STIFFNESS, THICKNESS = 1e8, 1e-3


@ti.data_oriented
class Layers:
    """Pieces of 4 by 3 cm, two if not said, what they feel of each other, and the Hessian's product with a vector."""

    def __init__(self, sheet, moduli, pieces=2):
        self.cloth = Cloth.join([(sheet, moduli)] * pieces)
        self.nv = self.cloth.vertex_count
        self.x, self.path, self.f, self.u, self.y = (ti.Vector.field(3, float, shape=self.nv) for _ in range(5))
        self.diagonal = ti.Matrix.field(3, 3, float, shape=self.nv)
        self.law = ClothContact(self.cloth, self.x, self.path, STIFFNESS, THICKNESS)
        self.flat = np.column_stack([sheet.points, np.zeros(len(sheet.points))])

    def lying(self, distance, shift=(0.014, 0.006)):
        """One piece level over the other, turned and shifted so that no corners lie over each other."""
        upper = self.flat @ np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]]) + [*shift, distance]
        return np.concatenate([self.flat, upper])

    def look(self, at, way=0.0):
        self.x.from_numpy(at)
        self.path.from_numpy(np.broadcast_to(way, at.shape).astype(float))
        self.law.look_ahead()

    def energy(self, at) -> float:
        self.x.from_numpy(at)
        self.law.evaluate()
        return self.law.stored

    def force(self, at) -> np.ndarray:
        """Forces (nv, 3) by the pairs last looked for."""
        self.energy(at)
        self.law.bind()
        self._gather()
        return self.f.to_numpy()

    def product(self, vector) -> np.ndarray:
        self.u.from_numpy(vector)
        self._multiply()
        return self.y.to_numpy()

    @ti.kernel
    def _gather(self):
        for i in self.f:
            self.f[i], self.diagonal[i] = self.law.force(i), self.law.own(i)

    @ti.kernel
    def _multiply(self):
        for i in self.y:
            self.y[i] = self.law.product(i, self.u)

    def moved(self) -> np.ndarray:
        return self.x.to_numpy() + self.path.to_numpy()


@pytest.fixture(scope="module")
def layers(make_sheet, moduli):
    return Layers(make_sheet(0.04, 0.03, 0.01), moduli)


def rough(layers, seed=0, distance=0.7 * THICKNESS, size=1e-4):
    """Lying on each other, shaken in all directions."""
    at = layers.lying(distance)
    return at + np.random.default_rng(seed).normal(size=at.shape) * size


def random(at, seed):
    return np.random.default_rng(seed).normal(size=at.shape)


WIDE = 1e-3  # looked along paths that long every pair within some thicknesses is found


@pytest.mark.parametrize("seed", range(3))
def test_force_is_minus_the_gradient_of_the_energy(layers, seed):
    at, eps = rough(layers, seed), 1e-9
    layers.look(at, WIDE * random(at, 9))
    force = layers.force(at)
    assert layers.law.touching.sum() > 20
    direction = random(at, seed + 20)
    slope = (layers.energy(at + eps * direction) - layers.energy(at - eps * direction)) / (2 * eps)
    assert -(force * direction).sum() == pytest.approx(slope, rel=1e-5)


@pytest.mark.parametrize("seed", range(2))
def test_hessian_is_minus_the_derivative_of_the_force_along_the_lines(layers, seed):
    """Where everything is magnified no line between two pieces turns: all that the Hessian leaves out."""
    at, eps = rough(layers, seed), 1e-8
    layers.look(at, WIDE * random(at, 9))
    layers.force(at)
    product = layers.product(at)
    slope = (layers.force((1 + eps) * at) - layers.force((1 - eps) * at)) / (2 * eps)
    assert product == pytest.approx(-slope, abs=1e-5 * np.abs(product).max())
    assert np.abs(product).max() > 0


def test_hessian_of_the_whole_is_symmetric_and_positive_semidefinite(layers):
    at = rough(layers)
    layers.look(at)
    layers.force(at)
    dense = np.array([layers.product(row.reshape(-1, 3)).ravel() for row in np.eye(3 * layers.nv)])
    size = np.abs(dense).max()
    assert dense == pytest.approx(dense.T, abs=1e-12 * size)
    values = np.linalg.eigvalsh(dense)
    assert values[0] > -1e-12 * values[-1] and values[-1] > 0
    blocks = np.einsum("iaib->iab", dense.reshape(layers.nv, 3, layers.nv, 3))
    assert layers.diagonal.to_numpy() == pytest.approx(blocks, abs=1e-12 * size)
    # shifting everything costs nothing
    assert dense.reshape(-1, layers.nv, 3).sum(axis=1) == pytest.approx(np.zeros((3 * layers.nv, 3)), abs=1e-12 * size)


@pytest.mark.parametrize("seed", range(2))
def test_forces_cancel_and_turn_nothing(layers, seed):
    at = rough(layers, seed)
    layers.look(at)
    force = layers.force(at)
    size = np.abs(force).sum()
    assert size > 0
    assert force.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-14 * size)
    assert np.cross(at, force).sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-14 * size)


def test_pieces_push_each_other_apart(layers):
    at = layers.lying(0.6 * THICKNESS)
    layers.look(at)
    force = layers.force(at)
    upper = slice(len(layers.flat), None)
    assert force[upper, 2].min() >= 0 and force[: len(layers.flat), 2].max() <= 0
    assert force[upper, 2].sum() > 0


@pytest.mark.parametrize("closeness", [0.05, 0.3, 0.8])
def test_pressure_is_about_that_of_the_barrier(layers, closeness):
    """A half by vertices over faces, and by edges over edges, which cross by chance 2 / pi times the product of their
    lengths on an area, 0.55 in triangles of equal sides. What is near but not right over each other comes on top."""
    at = layers.lying((1 - closeness) * THICKNESS, shift=(0.0, 0.0))
    layers.look(at)
    load = layers.force(at)[len(layers.flat) :, 2].sum()
    slope = closeness * (closeness / (1 - closeness) - 2 * np.log(1 - closeness))
    pressure = STIFFNESS * THICKNESS * slope
    under = _overlap(at[: len(layers.flat)], at[len(layers.flat) :], layers.cloth.triangles)
    print(f"load {load / (pressure * under):.3f} of pressure times area")
    assert 0.9 < load / (pressure * under) < 1.5


def _overlap(lower, upper, triangles) -> float:
    """Area [m^2] that the two have in common, seen from above."""
    from shapely import MultiPoint

    return MultiPoint(lower[:, :2]).convex_hull.intersection(MultiPoint(upper[:, :2]).convex_hull).area


def test_beyond_the_thickness_nothing_is_felt(layers):
    for distance in (1.0001 * THICKNESS, 2 * THICKNESS, 1.0):
        at = layers.lying(distance)
        layers.look(at, WIDE)
        assert np.abs(layers.force(at)).max() == 0 and layers.law.stored == 0
        assert np.abs(layers.product(random(at, 0))).max() == 0
        assert len(layers.law.bound) == 0


def test_the_same_bits_whatever_else_was_looked_at(layers):
    at = rough(layers)
    vector, results = random(at, 1), []
    for way in (0.0, WIDE * random(at, 3), 5 * WIDE * random(at, 4)):
        layers.look(at, way)
        force = layers.force(at)
        results.append((len(layers.law.pairs), layers.law.stored, force, layers.product(vector)))
    counts = [result[0] for result in results]
    assert counts[0] < counts[1] < counts[2]
    for other in results[1:]:
        assert other[1] == results[0][1]
        assert np.array_equal(other[2], results[0][2]) and np.array_equal(other[3], results[0][3])


def test_areas_of_all_pairs_that_cover_a_layer_sum_to_it(layers):
    """Vertices on both sides, and edges: each with its part."""
    vertices, edges = np.split(layers.law.areas, [layers.nv])
    assert vertices.sum() == pytest.approx(SHARE * layers.cloth.areas.sum(), rel=1e-12)
    assert edges.sum() == pytest.approx(SHARE * layers.cloth.areas.sum(), rel=1e-12)


# -- the way ahead ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_no_way_leads_through_cloth(layers, seed):
    """Pieces thrown through each other, vertex by vertex another way."""
    at = rough(layers, seed, distance=3e-3, size=3e-4)
    way = np.zeros_like(at)
    way[len(layers.flat) :, 2] = -0.01
    way += 5e-3 * random(at, seed + 7)
    assert len(crossings(at, layers.cloth.triangles)) == 0
    assert len(crossings(at + way, layers.cloth.triangles)) > 0
    layers.look(at, way)
    left = layers.law.keep_apart()
    gone = layers.path.to_numpy()
    assert 0 < left < 1
    for part in np.linspace(0, 1, 11):
        assert len(crossings(at + part * gone, layers.cloth.triangles)) == 0
    # each goes along its own path, the least part of which is what was said
    parts = (gone * way).sum(axis=1) / (way**2).sum(axis=1)
    assert gone == pytest.approx(parts[:, None] * way, abs=1e-15)
    assert parts.min() == pytest.approx(left, rel=1e-9) and parts.max() <= 1 + 1e-12


def test_what_falls_together_is_looked_at_again_where_one_is_stopped(make_sheet, moduli):
    """The middle one of three pieces comes down on the lowest with one end; above the other end is the highest, at a
    distance that would stay the same."""
    three = Layers(make_sheet(0.04, 0.03, 0.01), moduli, pieces=3)
    start = np.concatenate([three.flat + shift for shift in ([-0.025, 0.001, 0], [0, 0, 0.003], [0.016, 0.002, 0.005])])
    falling = np.array([0, 0, -0.05])
    three.look(start, np.repeat([0 * falling, falling, falling], len(three.flat), axis=0))
    three.law.keep_apart()
    assert not len(crossings(three.moved(), three.cloth.triangles))


def test_only_what_would_meet_is_shortened(layers):
    """One vertex of the lower piece rushes up; the others go their ways side by side."""
    at = layers.lying(3e-3)
    middle = int(np.argmin(np.linalg.norm(layers.flat - layers.flat.mean(axis=0), axis=1)))
    way = np.tile([2e-3, 0, 0], (layers.nv, 1))
    way[middle, 2] = 0.02
    layers.look(at, way)
    left = layers.law.keep_apart()
    gone = layers.path.to_numpy()
    assert gone[middle, 2] < 3e-3 and left == pytest.approx(gone[middle, 2] / 0.02, rel=1e-9)
    whole = (gone == way).all(axis=1)
    assert 0.5 < whole.mean() < 1
    # what is shortened are the corners of pairs with that vertex and with its edges
    assert (np.linalg.norm(at[~whole] - at[middle], axis=1) < 0.025).all()


def test_a_free_way_is_left_as_it_is(layers):
    for at, way in (
        (layers.lying(3e-3), [0.0, 0.0, -0.05]),
        (layers.lying(0.5), WIDE * random(layers.lying(0.5), 0)),
    ):
        layers.look(at, way)
        whole = layers.path.to_numpy()
        assert layers.law.keep_apart() == 1.0
        assert np.array_equal(layers.path.to_numpy(), whole)


def test_without_friction_nothing_rubs(layers):
    assert layers.law.rubbing is None


def test_with_no_pairs_at_all_everything_works(layers):
    at = layers.lying(1.0)
    layers.look(at)
    assert len(layers.law.pairs) == 0 and isinstance(layers.law.pairs, Pairs)
    assert np.abs(layers.force(at)).max() == 0
    assert not layers.law.guard(1.0)
    assert layers.law.keep_apart() == 1.0


def test_guards_stand_between_what_would_meet(layers):
    """Springs along the line on which they would, at rest at half the thickness."""
    at = layers.lying(3e-3)
    way = np.zeros_like(at)
    way[len(layers.flat) :, 2] = -0.01
    layers.look(at, way)
    layers.force(at)
    before = layers.law.count
    assert layers.law.guard(100.0)
    assert layers.law.count > before == 0
    count, law = layers.law.count, layers.law
    corner, weight = law.corner.to_numpy()[:count], law.weight.to_numpy()[:count]
    load, hold = law.load.to_numpy()[:count], law.hold.to_numpy()[:count]
    between = np.einsum("pk,pki->pi", weight, at[corner])
    along = np.einsum("pij,pj->pi", hold, between) / 100.0
    gap = np.linalg.norm(along, axis=1)
    assert np.einsum("pii->p", hold) == pytest.approx(100.0, rel=1e-6)
    assert load == pytest.approx(-100.0 * along * (1 - 0.5 * THICKNESS / gap)[:, None], abs=1e-6)
    # at the start all are apart
    assert 0.5 * THICKNESS < gap.min() and gap.max() <= 3e-3 * (1 + 1e-9)
    # they last until the forces are looked at anew
    layers.law.bind()
    assert layers.law.count == 0
