"""A piece of cloth of four triangles and what it feels of the floor."""

from types import SimpleNamespace

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.cloth.model import Cloth
from taichi_tryon.contact import offset
from taichi_tryon.contact.body import BodyContact
from taichi_tryon.contact.distance import distance, weights_of
from taichi_tryon.contact.samples import Samples

STIFFNESS, THICKNESS, FRICTION = 1e7, 5e-4, 0.3


@pytest.fixture(scope="session")
def cloth(make_sheet, moduli):
    return Cloth.join([(make_sheet(0.02, 0.02, 0.01), moduli)])


@pytest.fixture(scope="session")
def samples(cloth):
    return Samples.of(cloth.triangles, cloth.rest, cloth.areas, cloth.hinges[:, :2], cloth.triangle_edges)


@ti.data_oriented
class Felt:
    """Contact of the samples, its forces on the vertices and its Hessian as dense arrays."""

    def __init__(self, samples, field, nv, friction=FRICTION, sleeps=True):
        self.x, self.x_start, self.v, self.f = (ti.Vector.field(3, float, shape=nv) for _ in range(4))
        self.law = BodyContact(samples, field, self.x, self.x_start, self.v, STIFFNESS, THICKNESS, friction, sleeps)
        self.total, self.own = (ti.Matrix.field(3, 3, float, shape=nv) for _ in range(2))
        self.part = ti.Matrix.field(3, 3, float, shape=(len(samples.areas), 3, 3))

    @ti.kernel
    def _gather(self):
        for i in self.f:
            self.f[i] = self.law.force(i)
            total, own = self.law.row_sum(i)
            self.total[i], self.own[i] = total, own
        for s, a, b in self.part:
            self.part[s, a, b] = self.law.block(s, a, b)

    def start(self, positions, slip=None):
        """Lie at ``positions`` at the start of a step, still, with no spring stretched."""
        self.x.from_numpy(positions)
        self.x_start.from_numpy(positions)
        self.v.fill(0.0)
        self.law.end_step()
        self.law.slip.fill(0.0)
        self.law.friction[None] = FRICTION
        self.law.evaluate()
        self.law.bind(1, 0.0)
        self.law.bind(0, 0.0)

    def at(self, positions) -> np.ndarray:
        """Forces (nv, 3) at ``positions``, with friction's stiffness and limit as they are."""
        self.x.from_numpy(positions)
        self.law.evaluate()
        self._gather()
        return self.f.to_numpy()

    def slopes(self, positions, eps: float, seed: int = 1) -> tuple[float, float]:
        """Slope [J/m] of the energy along a random direction: by the forces, and by central differences."""
        force = self.at(positions)
        assert np.abs(force).max() > 0
        direction = np.random.default_rng(seed).normal(size=positions.shape)
        energies = []
        for sign in (1, -1):
            self.at(positions + sign * eps * direction)
            energies.append(self.law.energy())
        return -(force * direction).sum(), (energies[0] - energies[1]) / (2 * eps)


@pytest.fixture(scope="session")
def make_felt(samples, cloth):
    """Makes the contact of the piece with a field; see ``BodyContact`` for the options."""
    return lambda field, *options: Felt(samples, field, cloth.vertex_count, *options)


@pytest.fixture(scope="session")
def felt(make_felt, floor_and_ball_field):
    return make_felt(floor_and_ball_field)


@pytest.fixture(scope="session")
def flat(cloth, make_sheet):
    """Makes positions (nv, 3) of the piece lying level at a height [m]."""
    points = make_sheet(0.02, 0.02, 0.01).points

    def make(height: float) -> np.ndarray:
        return np.column_stack([points[:, 0] - 0.01, np.full(len(points), height), 0.01 - points[:, 1]])

    return make


@pytest.fixture(scope="session")
def law():
    """The figures of the contact under test."""
    return SimpleNamespace(stiffness=STIFFNESS, thickness=THICKNESS, friction=FRICTION)


@ti.kernel
def _evaluate_offset(depth: ti.types.ndarray(), last: float, out: ti.types.ndarray()):
    for i in range(depth.shape[0]):
        out[i, 0] = offset.stored(STIFFNESS, THICKNESS, depth[i], last)
        out[i, 1] = offset.pressure(STIFFNESS, THICKNESS, depth[i], last)
        out[i, 2] = offset.steepness(STIFFNESS, THICKNESS, depth[i], last)


@pytest.fixture(scope="session")
def pushes():
    """Energy [J/m^2], pressure [Pa] and steepness [N/m^3], each (n,), of the contact under test at depths (n,) [m]."""

    def at(depth, last=offset.FIRM):
        depth = np.atleast_1d(np.asarray(depth, float))
        out = np.empty((len(depth), 3))
        _evaluate_offset(depth, last, out)
        return out.T

    return at


@ti.kernel
def _closest(kind: ti.types.ndarray(), at: ti.types.ndarray(), weights: ti.types.ndarray(), length: ti.types.ndarray()):
    for p in range(kind.shape[0]):
        a, b, c, d = _corner(at, p, 0), _corner(at, p, 1), _corner(at, p, 2), _corner(at, p, 3)
        w = weights_of(kind[p], a, b, c, d)
        length[p] = distance(kind[p], a, b, c, d)
        for k in ti.static(range(4)):
            weights[p, k] = w[k]


@ti.func
def _corner(at: ti.template(), p: int, k: int):
    return ti.Vector([at[p, k, 0], at[p, k, 1], at[p, k, 2]])


@pytest.fixture(scope="session")
def closest():
    """Weights (n, 4) and distances (n,) [m] of pairs of a kind (n,) with corners (n, 4, 3)."""

    def of(kind, corners):
        weights, length = np.empty((len(kind), 4)), np.empty(len(kind))
        _closest(np.asarray(kind, np.int32), np.ascontiguousarray(corners), weights, length)
        return weights, length

    return of
