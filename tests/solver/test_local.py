"""The local blocks: inverses of what the matrix has there, identity where a vertex is held."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.solver.local import LocalBlocks
from taichi_tryon.solver.partition import blocks


@ti.data_oriented
class Solved:
    def __init__(self, local):
        self.local = local
        self.r, self.z = (ti.Vector.field(4, ti.f32, shape=local.nv + 1) for _ in range(2))

    @ti.kernel
    def solve(self):
        for c in range(self.local.count):
            self.local.solve(c, self.r, self.z)


@pytest.fixture(scope="module", params=[1, 8])
def solved(request, _stepper):
    matrix = _stepper.potential.matrix
    points = np.random.default_rng(0).normal(size=(matrix.nv, 3))
    owner = blocks(points, np.zeros(matrix.nv, int), request.param)
    return Solved(LocalBlocks(matrix, owner, request.param)), owner


@pytest.mark.parametrize("held", [0, 5])
def test_they_solve_their_part_of_the_matrix(solved, held, stepper, on_the_floor, as_sparse):
    solver, owner = solved
    matrix = stepper.potential.matrix
    free = np.ones((matrix.nv, 3))
    free[:held, :2] = 0
    fields.upload(matrix.free, free)
    matrix.assemble(60.0)
    solver.local.update()
    r = np.random.default_rng(1).normal(size=(matrix.nv + 1, 4)).astype(np.float32)
    r[-1] = 0
    solver.r.from_numpy(r)
    solver.solve()
    mask = free.ravel()
    whole = as_sparse(matrix).toarray() * np.outer(mask, mask) + np.diag(1 - mask)
    together = np.repeat(owner, 3)[:, None] == np.repeat(owner, 3)
    expected = np.linalg.solve(np.where(together, whole, 0.0), r[:-1, :3].ravel()).reshape(-1, 3)
    assert solver.z.to_numpy()[:-1, :3] == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())
