"""The coarse space: hats that sum to one, rigid motions within its range, its matrix, and what it is worth."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.cloth.elastic import Elastic
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.contact.samples import Samples
from taichi_tryon.solver.coarse import NEAREST, SHIFT, CoarseSpace, spread
from taichi_tryon.solver.conjugate_gradients import ConjugateGradients
from taichi_tryon.solver.matrix import Matrix


def lengths_of(sheet):
    edges = sheet.topology.edges
    return edges, np.linalg.norm(sheet.points[edges[:, 0]] - sheet.points[edges[:, 1]], axis=1)


@pytest.mark.parametrize("count", [1, 3, 4, 5, 20])
def test_weights_sum_to_one(sheet, count):
    edges, lengths = lengths_of(sheet)
    ids, weights = spread(edges, lengths, sheet.vertex_count, count)
    assert ids.shape == weights.shape == (sheet.vertex_count, NEAREST)
    assert weights.sum(axis=1) == pytest.approx(1)
    assert weights.min() >= 0
    assert len(np.unique(ids[weights > 0])) == count
    assert ids.min() >= 0 and ids.max() < count


def test_every_piece_has_a_node_of_its_own(sheet):
    edges, lengths = lengths_of(sheet)
    nv = sheet.vertex_count
    three = np.concatenate([edges, edges + nv, edges + 2 * nv])
    ids, weights = spread(three, np.tile(lengths, 3), 3 * nv, 1)
    used = [set(np.unique(ids[k * nv : (k + 1) * nv][weights[k * nv : (k + 1) * nv] > 0])) for k in range(3)]
    assert all(used) and not used[0] & used[1] and not used[0] & used[2] and not used[1] & used[2]
    assert weights.sum(axis=1) == pytest.approx(1)


def test_neighbours_have_almost_the_same_weights(sheet):
    """Hats are continuous: nothing jumps where the list of nearest nodes changes."""
    edges, lengths = lengths_of(sheet)
    ids, weights = spread(edges, lengths, sheet.vertex_count, 9)
    dense = np.zeros((sheet.vertex_count, 9))
    np.add.at(dense, (np.arange(sheet.vertex_count)[:, None], ids), weights)
    steps = np.abs(dense[edges[:, 0]] - dense[edges[:, 1]]).sum(axis=1)
    assert steps.max() < 0.9 and np.median(steps) < 0.5


@ti.data_oriented
class Prolonged:
    def __init__(self, coarse):
        self.coarse, self.result = coarse, ti.Vector.field(3, float, shape=coarse.nv)

    @ti.kernel
    def fill(self):
        for i in self.result:
            self.result[i] = self.coarse.prolong(i)


@ti.data_oriented
class Air:
    """A contact law that never touches anything."""

    def __init__(self):
        self.samples = Samples(np.zeros((1, 3), int), np.array([[1.0, 0, 0]]), np.zeros(1))

    @ti.func
    def block(self, s: int, a: int, b: int):
        return ti.Matrix.zero(float, 3, 3)

    @ti.func
    def row_sum(self, i: int):
        return ti.Matrix.zero(float, 3, 3), ti.Matrix.zero(float, 3, 3)


class Parts:
    """A sheet of about 2,000 vertices in free air with its matrix, and both solvers of it."""

    def __init__(self, sheet, moduli, bending):
        cloth = Cloth.join([(sheet, moduli)], bending)
        nv = self.nv = cloth.vertex_count
        self.x = ti.Vector.field(3, float, shape=nv)
        points = sheet.points
        noise = np.random.default_rng(0).normal(size=(nv, 3)) * 3e-4
        # stretched, and rolled to a quarter of a tube: polynomials would lock here
        self.positions = noise + np.column_stack(
            [0.3 * np.sin(1.01 * points[:, 0] / 0.3), 5 + 0.3 * np.cos(1.01 * points[:, 0] / 0.3), 1.01 * points[:, 1]]
        )
        self.x.from_numpy(self.positions)
        mass, free = ti.field(float, shape=nv), ti.Vector.field(3, float, shape=nv)
        mass.from_numpy(cloth.masses)
        free.fill(1)
        elastic = Elastic(cloth, self.x)
        self.matrix = Matrix(elastic, Air(), mass, free)
        edges, lengths = lengths_of(sheet)
        self.reach = float(np.sqrt(cloth.areas.sum() / 40))
        self.coarse = CoarseSpace(self.matrix, self.x, *spread(edges, lengths, nv, 40))
        self.two_level, self.plain = ConjugateGradients(self.matrix, self.coarse), ConjugateGradients(self.matrix)
        self.masses = cloth.masses
        elastic.evaluate(0.0)
        self.matrix.assemble(60.0)
        self.two_level.b.from_numpy(np.zeros((nv, 3)))
        self.two_level.solve(1e-2, 1, self.reach)

    def prolongation(self) -> np.ndarray:
        """P (3 nv, 6 nodes) by its definition: P_iJ = w_iJ S_i [I, -(x_i - c_J)x / reach]."""
        c = self.coarse
        node, weight, center = c.node.to_numpy(), c.weight.to_numpy(), c.center.to_numpy()
        kept = c.filter.to_numpy()
        p = np.zeros((self.nv, 3, c.node_count, 6))
        for slot in range(NEAREST):
            arm = (self.positions - center[node[:, slot]]) / self.reach
            turn = np.zeros((self.nv, 3, 3))
            for k, axis in enumerate(np.eye(3)):
                turn[:, :, k] = np.cross(axis, arm)
            motion = np.concatenate([np.tile(np.eye(3), (self.nv, 1, 1)), turn], axis=2)
            p[np.arange(self.nv), :, node[:, slot]] += weight[:, slot, None, None] * (kept @ motion)
        return p.reshape(3 * self.nv, -1)


@pytest.fixture(scope="module", params=["mid_edge", "constant"])
def large(make_sheet, moduli, request):
    return Parts(make_sheet(0.48, 0.48, 0.0115), moduli, request.param)


def test_rigid_motions_are_in_its_range(large):
    shift, turn = np.array([0.3, -0.1, 0.2]), np.array([0.5, 0.4, -0.7])
    center = large.coarse.center.to_numpy()
    nodes = np.hstack([shift + np.cross(turn, center), np.tile(turn * large.reach, (len(center), 1))])
    large.coarse.corrected.from_numpy(nodes.ravel())
    prolonged = Prolonged(large.coarse)
    prolonged.fill()
    assert prolonged.result.to_numpy() == pytest.approx(shift + np.cross(turn, large.positions), rel=1e-9, abs=1e-9)


def test_its_matrix_is_that_of_the_cloth_within_its_range(large, as_sparse):
    p, a = large.prolongation(), as_sparse(large.matrix)
    expected = p.T @ (a @ p)
    found = large.coarse.entries.to_numpy()
    assert found == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())
    expected[np.diag_indices_from(expected)] *= 1 + SHIFT
    product = large.coarse.inverse.to_numpy().astype(float) @ expected
    r = np.random.default_rng(0).normal(size=(len(product), 3))
    # a preconditioner in single precision of nearly dependent motions: right to a tenth is plenty
    assert product @ r == pytest.approx(r, abs=0.1 * np.abs(r).max())


def test_it_saves_iterations(large):
    """A stretched and rolled sheet of 2,000 vertices under its weight and a gust."""
    assert 1800 < large.nv < 2400
    force = large.masses[:, None] * (np.array([0, -9.81, 0]) + 5 * np.sin(9 * large.positions[:, ::-1]))
    counts, found = [], []
    for solver in (large.two_level, large.plain):
        solver.b.from_numpy(force)
        counts.append(solver.solve(1e-4, 5000, large.reach)[0])
        found.append(solver.d.to_numpy())
    assert counts[0] < counts[1] / 4
    assert found[0] == pytest.approx(found[1], abs=2e-2 * np.abs(found[1]).max())
