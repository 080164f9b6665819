"""The coarse space: rigid motions within its range, its matrix, and what it is worth."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.cloth.elastic import Elastic
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.contact.samples import Samples
from taichi_tryon.solver.coarse import SHIFT, CoarseSpace
from taichi_tryon.solver.conjugate_gradients import ConjugateGradients
from taichi_tryon.solver.local import LocalBlocks
from taichi_tryon.solver.matrix import Matrix
from taichi_tryon.solver.partition import blocks, patches


@ti.data_oriented
class Prolonged:
    def __init__(self, coarse):
        self.coarse, self.result = coarse, ti.Vector.field(3, ti.f32, shape=coarse.nv)

    @ti.kernel
    def fill(self):
        for i in self.result:
            self.result[i] = self.coarse.prolong(i)


@ti.data_oriented
class Air:
    """A contact law that never touches anything."""

    def __init__(self):
        self.samples = Samples(np.zeros((1, 3), int), np.array([[1.0, 0, 0]]), np.zeros(1), np.zeros(1))

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
        self.reach = float(np.sqrt(cloth.areas.sum() / 40))
        self.patch = patches(cloth, 40)
        self.coarse = CoarseSpace(self.matrix, self.x, self.patch, self.reach)
        local = LocalBlocks(self.matrix, blocks(self.positions, self.patch, 8), 8)
        plain = LocalBlocks(self.matrix, np.arange(nv), 1)
        self.two_level = ConjugateGradients(self.matrix, local, self.coarse)
        self.plain = ConjugateGradients(self.matrix, plain)
        self.masses = cloth.masses
        elastic.evaluate(0.0)
        self.matrix.assemble(60.0)
        self.two_level.b.from_numpy(np.zeros((nv, 3)))
        self.two_level.solve(1e-2, 1)

    def prolongation(self) -> np.ndarray:
        """P (3 nv, 6 patches) by its definition: P_i = [I, -(x_i - c)x / reach] for the patch of i."""
        arm = (self.positions - self.coarse.center.to_numpy()[self.patch]) / self.reach
        p = np.zeros((self.nv, 3, self.coarse.patch_count, 6))
        for k, axis in enumerate(np.eye(3)):
            p[np.arange(self.nv), k, self.patch, k] = 1
            p[np.arange(self.nv), :, self.patch, 3 + k] = np.cross(axis, arm)
        return p.reshape(3 * self.nv, -1)


@pytest.fixture(scope="module", params=["mid_edge", "constant"])
def large(make_sheet, moduli, request):
    return Parts(make_sheet(0.48, 0.48, 0.0115), moduli, request.param)


def test_rigid_motions_are_in_its_range(large):
    shift, turn = np.array([0.3, -0.1, 0.2]), np.array([0.5, 0.4, -0.7])
    center = large.coarse.center.to_numpy()
    nodes = np.hstack([shift + np.cross(turn, center), np.tile(turn * large.reach, (len(center), 1))])
    corrected = np.zeros(large.coarse.corrected.shape, np.float32)
    corrected[: nodes.size] = nodes.ravel()
    large.coarse.corrected.from_numpy(corrected)
    prolonged = Prolonged(large.coarse)
    prolonged.fill()
    assert prolonged.result.to_numpy() == pytest.approx(shift + np.cross(turn, large.positions), abs=1e-5)


def test_its_matrix_is_that_of_the_cloth_within_its_range(large, as_sparse):
    p, a = large.prolongation(), as_sparse(large.matrix)
    expected = p.T @ (a @ p)
    gathered = np.zeros_like(large.coarse.entries)
    large.coarse._gather(gathered)
    upper = np.triu(gathered)
    found = upper + np.triu(upper, 1).T
    assert found == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())
    # rows come in blocks, each by columns
    inverse = large.coarse.inverse.to_numpy().astype(float).transpose(0, 2, 1).reshape(-1, large.coarse.size)
    expected[np.diag_indices_from(expected)] *= 1 + SHIFT
    product = inverse[: large.coarse.size] @ expected
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
        counts.append(solver.solve(1e-4, 5000)[0])
        found.append(solver.d.to_numpy())
    assert counts[0] < counts[1] / 4
    assert found[0] == pytest.approx(found[1], abs=2e-2 * float(np.abs(found[1]).max()))
