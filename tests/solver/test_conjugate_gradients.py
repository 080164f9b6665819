"""Conjugate gradients against a direct solver."""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from taichi_tryon import fields
from taichi_tryon.solver.conjugate_gradients import ConjugateGradients
from taichi_tryon.solver.local import LocalBlocks

INVERSE_DT = 60.0


@pytest.fixture(scope="module")
def plain(_stepper):
    """Block-Jacobi alone, on the same matrix."""
    matrix = _stepper.potential.matrix
    return ConjugateGradients(matrix, LocalBlocks(matrix, np.arange(matrix.nv), 1))


@pytest.fixture(params=["coarse", "block_jacobi"])
def solver(request, stepper, plain, on_the_floor):
    stepper.potential.matrix.assemble(INVERSE_DT)
    return stepper.newton.linear if request.param == "coarse" else plain


def load(solver, seed=0) -> np.ndarray:
    b = np.random.default_rng(seed).normal(size=(solver.nv, 3))
    solver.b.from_numpy(b)
    return b


def test_it_finds_what_a_direct_solver_finds(solver, stepper, as_sparse):
    b = load(solver)
    solver.solve(1e-6, 5000)
    exact = spsolve(as_sparse(stepper.potential.matrix).tocsc(), b.ravel()).reshape(-1, 3)
    assert solver.d.to_numpy() == pytest.approx(exact, abs=1e-4 * np.abs(exact).max())


def test_held_vertices_do_not_move(solver, stepper, as_sparse):
    b = load(solver, 1)
    free = np.ones((stepper.nv, 3))
    free[:12] = 0
    fields.upload(stepper.free, free)
    stepper.potential.matrix.assemble(INVERSE_DT)
    solver.solve(1e-6, 5000)
    rows = np.flatnonzero(free.ravel())
    inner = as_sparse(stepper.potential.matrix)[rows][:, rows].tocsc()
    exact = np.zeros(3 * stepper.nv)
    exact[rows] = spsolve(inner, b.ravel()[rows])
    assert np.abs(solver.d.to_numpy()[:12]).max() == 0
    assert solver.d.to_numpy().ravel() == pytest.approx(exact, abs=1e-4 * np.abs(exact).max())


def test_block_jacobi_stops_at_the_tolerance(plain, stepper, on_the_floor, as_sparse, unpacked):
    stepper.potential.matrix.assemble(INVERSE_DT)
    b = load(plain)
    inverse = np.linalg.inv(unpacked(stepper.potential.matrix.diagonal))
    matrix, counts = as_sparse(stepper.potential.matrix), []

    def norm(r):
        return np.sqrt(np.einsum("ia,iab,ib->", r, inverse, r))

    for tolerance in (1e-1, 1e-2, 1e-3):
        count, reached = plain.solve(tolerance, 5000)
        left = b - (matrix @ plain.d.to_numpy().ravel()).reshape(-1, 3)
        assert reached <= tolerance
        assert norm(left) / norm(b) == pytest.approx(reached, rel=1e-2)
        counts.append(count)
    assert counts[0] < counts[1] < counts[2]


def test_it_stops_at_the_greatest_number_of_iterations(solver, stepper):
    load(solver)
    count, reached = solver.solve(1e-12, 10)
    assert count == 10 and reached > 1e-12


def test_no_load_moves_nothing(solver, stepper):
    solver.b.fill(0.0)
    count, reached = solver.solve(1e-6, 100)
    assert (solver.d.to_numpy() == 0).all() and reached == 0 and count <= 5


def test_the_same_load_gives_the_same_bits(solver, stepper):
    load(solver)
    results = []
    for _ in range(2):
        solver.solve(1e-4, 500)
        results.append(solver.d.to_numpy())
    assert np.array_equal(*results)


def test_a_launch_for_each_loop_as_on_a_gpu_gives_the_same_bits(solver):
    load(solver)
    found = []
    for crew in (solver.crew, None):
        own, solver.crew = solver.crew, crew
        count, reached = solver.solve(1e-4, 500)
        solver.crew = own
        found.append((count, reached, solver.d.to_numpy()))
    (count, reached, d), (other_count, other_reached, other_d) = found
    assert (count, reached) == (other_count, other_reached) and np.array_equal(d, other_d)
