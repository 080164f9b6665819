"""Friction between layers: Coulomb's law pair by pair; value, force and Hessian belong together; springs last."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.contact.friction import ALONG
from taichi_tryon.contact.rubbing import Rubbing

MU, PAIRS = 0.3, 6
KEYS = np.array([3, 8, 20, 21, 44, 70])
NONE = np.zeros((4 * PAIRS, 3))


@ti.data_oriented
class Pairs:
    """Pairs of four corners each, pushed apart along random lines; positions are seen from the start of the step."""

    def __init__(self):
        rng = np.random.default_rng(1)
        self.x, self.x_start, self.v = (ti.Vector.field(3, float, shape=4 * PAIRS) for _ in range(3))
        self.corner, self.weight = ti.Vector.field(4, ti.i32, shape=PAIRS), ti.Vector.field(4, float, shape=PAIRS)
        self.load, self.hold = ti.Vector.field(3, float, shape=PAIRS), ti.Matrix.field(3, 3, float, shape=PAIRS)
        near = rng.dirichlet(np.ones(3), PAIRS)
        self.weights = np.column_stack([np.ones(PAIRS), -near])
        self.corner.from_numpy(np.arange(4 * PAIRS, dtype=np.int32).reshape(PAIRS, 4))
        self.weight.from_numpy(self.weights)
        normal = rng.normal(size=(PAIRS, 3))
        self.normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        self.pressed, self.stiffness = rng.uniform(1e-4, 1e-3, PAIRS), rng.uniform(20, 50, PAIRS)
        self.start = rng.normal(size=(4 * PAIRS, 3)) * 1e-3
        self.x_start.from_numpy(self.start)
        self.law = Rubbing(self.x, self.x_start, self.v, self.corner, self.weight, self.load, self.hold, MU)

    def anew(self):
        """No spring is stretched, nothing moves."""
        self.law.restore({"layer_pairs": KEYS[:0], "layer_slips": np.zeros((0, 3)), "layer_slipped": np.zeros(0, int)})
        self.v.fill(0.0)
        self.law.coefficient[None] = MU

    def bind(self, gone, keys=KEYS, first=False, ahead=0.0) -> np.ndarray:
        """Forces (4 PAIRS, 3) of friction where vertices have ``gone`` in this step."""
        self.x.from_numpy(self.start + gone)
        load = self.pressed[:, None] * self.normal
        self.load.from_numpy(load)
        self.hold.from_numpy(self.stiffness[:, None, None] * self.normal[:, :, None] * self.normal[:, None])
        self.law.bind(keys, first, ahead)
        rubbed = self.load.to_numpy() - load
        return (self.weights[:, :, None] * rubbed[:, None]).reshape(-1, 3)

    def energy(self, gone) -> float:
        """Energy where vertices have ``gone``, normal loads as they were bound."""
        self.x.from_numpy(self.start + gone)
        return self.law.energy()

    def product(self, vector) -> np.ndarray:
        """Friction's Hessian times a vector."""
        normal = self.stiffness[:, None, None] * self.normal[:, :, None] * self.normal[:, None]
        between = np.einsum("pk,pki->pi", self.weights, vector.reshape(PAIRS, 4, 3))
        turned = np.einsum("pij,pj->pi", self.hold.to_numpy() - normal, between)
        return (self.weights[:, :, None] * turned[:, None]).reshape(-1, 3)

    def drag(self, gone) -> np.ndarray:
        """Tangential ways (PAIRS, 3) of the two points of each pair past each other."""
        between = np.einsum("pk,pki->pi", self.weights, gone.reshape(PAIRS, 4, 3))
        return between - np.einsum("pi,pi->p", between, self.normal)[:, None] * self.normal

    def of_each(self, force) -> np.ndarray:
        """Friction (PAIRS, 3) on the first corner of each pair."""
        return force.reshape(PAIRS, 4, 3)[:, 0]


@pytest.fixture(scope="module")
def _pairs():
    return Pairs()


@pytest.fixture
def pairs(_pairs):
    _pairs.anew()
    return _pairs


def gone(seed, size):
    return np.random.default_rng(seed).normal(size=NONE.shape) * size


# friction's springs reach 1 to 15 um here
STICKS, SOME, SLIPS = 3e-8, 4e-6, 1e-3


@pytest.mark.parametrize("size", [STICKS, SOME, SLIPS])
def test_coulombs_law(pairs, size):
    way = gone(0, size)
    force, drag = pairs.of_each(pairs.bind(way)), pairs.drag(way)
    length = np.linalg.norm(drag, axis=1)
    expected = np.minimum(pairs.stiffness * length, MU * pairs.pressed)
    assert force == pytest.approx(-expected[:, None] * drag / length[:, None], rel=1e-7, abs=1e-14)
    slips = pairs.stiffness * length > MU * pairs.pressed
    assert slips.mean() == {STICKS: 0, SLIPS: 1}.get(size, pytest.approx(0.5, abs=0.4))


@pytest.mark.parametrize("size", [STICKS, SOME, SLIPS])
def test_force_is_minus_the_gradient_of_the_energy(pairs, size):
    way, direction, eps = gone(2, size), gone(3, 1.0), 1e-4 * size
    force = pairs.bind(way)
    slope = (pairs.energy(way + eps * direction) - pairs.energy(way - eps * direction)) / (2 * eps)
    assert -(force * direction).sum() == pytest.approx(slope, rel=1e-5)


@pytest.mark.parametrize("size", [STICKS, SOME, SLIPS])
def test_hessian_is_minus_the_derivative_of_the_force(pairs, size):
    """Where a pair slips, but for the little that is left along its way."""
    way, direction, eps = gone(4, size), gone(5, 1.0), 1e-4 * size
    slope = (pairs.bind(way + eps * direction) - pairs.bind(way - eps * direction)) / (2 * eps)
    force = pairs.of_each(pairs.bind(way))
    product, drag = pairs.of_each(pairs.product(direction)), pairs.drag(way)
    along = drag / np.linalg.norm(drag, axis=1, keepdims=True)
    slips = np.linalg.norm(force, axis=1) > 0.999999 * MU * pairs.pressed
    bond = np.linalg.norm(force, axis=1) / np.linalg.norm(drag, axis=1)
    left = ALONG * bond * np.einsum("pi,pi->p", along, pairs.drag(direction)) * slips
    assert product - left[:, None] * along == pytest.approx(-pairs.of_each(slope), abs=1e-6 * np.abs(product).max())


def test_hessian_is_symmetric_and_positive_semidefinite(pairs):
    for size in (STICKS, SOME, SLIPS):
        pairs.bind(gone(6, size))
        hold = pairs.hold.to_numpy()
        assert hold == pytest.approx(hold.transpose(0, 2, 1), abs=1e-12 * np.abs(hold).max())
        assert np.linalg.eigvalsh(hold).min() > 0


def test_a_spring_stays_stretched_as_long_as_its_pair_touches(pairs):
    way = gone(7, SOME)
    force = pairs.bind(way)
    pairs.law.end_step()
    pairs.x_start.from_numpy(pairs.start + way)
    try:
        again = pairs.bind(way)
        # in the middle of the row one has parted, and is forgotten
        other = np.where(np.arange(PAIRS) == 2, 30, KEYS)
        parted = pairs.bind(way, keys=np.sort(other))
    finally:
        pairs.x_start.from_numpy(pairs.start)
    assert again == pytest.approx(force, rel=1e-9, abs=1e-14)
    assert np.abs(pairs.of_each(again)).min(axis=1).max() > 0
    same = np.sort(other) == KEYS
    assert np.array_equal(pairs.of_each(parted)[same], pairs.of_each(again)[same])
    assert np.abs(pairs.of_each(parted)[np.sort(other) == 30]).max() == 0


def test_what_slipped_in_the_last_step_or_will_in_this_one_slips_at_first(pairs):
    pairs.bind(gone(8, SLIPS))
    pairs.law.end_step()
    pairs.bind(NONE, first=True)
    assert (pairs.law.along.to_numpy() == ALONG).all()
    pairs.bind(NONE)
    # at its limit a spring is not beyond it
    assert (pairs.law.along.to_numpy() == 1.0).all()
    pairs.anew()
    pairs.v.from_numpy(gone(9, 1.0))
    pairs.bind(NONE, first=True, ahead=0.0)
    assert (pairs.law.along.to_numpy() == 1.0).all()
    pairs.bind(NONE, first=True, ahead=0.01)
    assert (pairs.law.along.to_numpy() == ALONG).all()


def test_without_a_coefficient_nothing_is_held(pairs):
    pairs.law.coefficient[None] = 0.0
    assert np.abs(pairs.bind(gone(10, SOME))).max() == 0
    assert np.abs(pairs.product(gone(11, 1.0))).max() == 0
    assert pairs.energy(gone(10, SOME)) == 0
    pairs.law.end_step()
    assert np.abs(pairs.law.slips).max() == 0


def test_a_restored_state_goes_on_with_the_same_bits(pairs):
    pairs.bind(gone(12, SOME))
    pairs.law.end_step()
    kept = pairs.law.state()
    first = pairs.bind(gone(13, SOME), first=True)
    pairs.law.end_step()
    pairs.bind(gone(14, SLIPS))
    pairs.law.end_step()
    pairs.law.restore(kept)
    assert np.array_equal(pairs.bind(gone(13, SOME), first=True), first)
