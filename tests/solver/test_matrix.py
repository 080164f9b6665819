"""The assembled matrix against finite differences of the forces; symmetric and positive definite, crushed too."""

from copy import copy

import numpy as np
import pytest
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.solver.implicit import ImplicitStep
from taichi_tryon.timing import Stopwatch

INVERSE_DT = 60.0


@ti.data_oriented
class Product:
    def __init__(self, matrix):
        self.matrix = matrix
        self.vector, self.result = (ti.Vector.field(4, ti.f32, shape=matrix.nv) for _ in range(2))

    @ti.kernel
    def _multiply(self):
        for i in self.result:
            self.result[i] = self.matrix.row_product(i, self.vector)

    def of(self, values) -> np.ndarray:
        self.vector.from_numpy(np.pad(values, ((0, 0), (0, 1))).astype(np.float32))
        self._multiply()
        return self.result.to_numpy()[:, :3]


@pytest.fixture(scope="module")
def product(_stepper):
    return Product(_stepper.potential.matrix)


@pytest.fixture
def without_bending(stepper):
    """Bending blocks hold the edge rotations, which gives Gauss and Newton's matrix and not the exact Hessian."""
    law = stepper.elastic.bending
    kept = [(field, field.to_numpy()) for field in (law.stiffness, law.hinges.stiffness)]
    for field, _ in kept:
        field.fill(0.0)
    yield
    for field, values in kept:
        field.from_numpy(values)


def test_matrix_is_mass_and_the_derivative_of_the_force(
    without_bending, stepper, on_the_floor, forces, as_sparse, cloth
):
    # what slips keeps a little stiffness along its way, on purpose; the exact Hessian has none
    along = stepper.contact.along.to_numpy()
    assert 0.1 < (along < 1).mean() < 0.9
    stepper.contact.along.from_numpy((along == 1).astype(float))
    stepper.contact.evaluate()
    stepper.potential.matrix.assemble(INVERSE_DT)
    matrix, eps = as_sparse(stepper.potential.matrix), 1e-9
    inertia = cloth.masses[:, None] * INVERSE_DT**2
    for seed in range(6):
        direction = np.random.default_rng(seed).normal(size=on_the_floor.shape)
        slope = (forces.at(on_the_floor + eps * direction) - forces.at(on_the_floor - eps * direction)) / (2 * eps)
        exact = inertia * direction - slope
        found = (matrix @ direction.ravel()).reshape(-1, 3)
        assert found == pytest.approx(exact, abs=1e-5 * np.abs(exact).max())


def test_bending_blocks_are_no_softer_than_the_sheet(stepper, level, forces, as_sparse, assert_no_softer):
    """Out of the plane, where a flat sheet has nothing but bending: held edge rotations can only stiffen."""
    flat, eps = level(5.0), 1e-6
    stepper.x.from_numpy(flat)
    stepper.elastic.begin_step()
    stepper.elastic.evaluate(0.0)
    stepper.contact.evaluate()
    stepper.potential.matrix.assemble(0.0)
    assert_no_softer(as_sparse(stepper.potential.matrix), forces, flat, eps, sweeps=5)


def test_it_is_symmetric(stepper, on_the_floor, as_sparse):
    stepper.potential.matrix.assemble(INVERSE_DT)
    matrix = as_sparse(stepper.potential.matrix)
    assert abs(matrix - matrix.T).max() < 1e-6 * abs(matrix).max()


@pytest.mark.parametrize("scale", [0.3, 0.9, 1.0, 1.5])
def test_it_is_positive_definite_even_crushed(stepper, level, as_sparse, scale):
    crushed = level(5.0) * scale
    crushed += np.random.default_rng(0).normal(size=crushed.shape) * 2e-3
    stepper.x.from_numpy(crushed)
    stepper.elastic.begin_step()
    stepper.elastic.evaluate(0.0)
    stepper.contact.evaluate()
    for inverse_dt, least in ((INVERSE_DT, 0.9), (0.0, None)):
        stepper.potential.matrix.assemble(inverse_dt)
        eigenvalues = np.linalg.eigvalsh(as_sparse(stepper.potential.matrix).toarray())
        mass = stepper.mass.to_numpy().min() * inverse_dt**2
        # rounding of the f32 blocks is all that may be missing
        assert eigenvalues.min() > -1e-6 * eigenvalues.max() + (least or 0.0) * mass


def test_held_vertices_have_rows_of_zeros(stepper, on_the_floor, as_sparse, product):
    stepper.potential.matrix.assemble(INVERSE_DT)
    free = np.ones((stepper.nv, 3))
    free[[0, 5, 17]] = 0
    free[8, 1] = 0  # slides along x and z
    vector = np.random.default_rng(0).normal(size=(stepper.nv, 3)) * free
    expected = (as_sparse(stepper.potential.matrix) @ vector.ravel()).reshape(-1, 3) * free
    fields.upload(stepper.free, free)
    stepper.potential.matrix.assemble(INVERSE_DT)
    assert product.of(vector) == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


def test_a_body_out_of_reach_changes_no_bit_of_the_product(stepper, level, product):
    matrix = stepper.potential.matrix
    stepper.x.from_numpy(level(5.0) * [1.1, 1, 0.9])
    stepper.elastic.evaluate(0.0)
    stepper.contact.evaluate()
    matrix.assemble(INVERSE_DT)
    # as a matrix without contact has it: the same along all axes
    alone = copy(matrix)
    alone.felt, alone.row_sum = False, ti.field(ti.f32, shape=stepper.nv)
    alone.row_sum.from_numpy(matrix.row_sum.to_numpy()[:, 0])
    vector = np.random.default_rng(0).normal(size=(stepper.nv, 3))
    assert np.array_equal(Product(alone).of(vector), product.of(vector))


def test_elastic_rows_sum_to_zero(stepper, level, product):
    """Shifting everything costs no force."""
    stepper.x.from_numpy(level(5.0) * [1.1, 1, 0.9])
    stepper.elastic.evaluate(0.0)
    stepper.contact.evaluate()
    stepper.potential.matrix.assemble(0.0)
    size = np.abs(stepper.potential.matrix.diagonal.to_numpy()).max()
    assert np.abs(product.of(np.ones((stepper.nv, 3)))).max() < 1e-6 * size


@pytest.mark.parametrize("membrane", ["plain", "nodal"])
def test_with_constant_bending_it_is_the_exact_derivative_of_the_force(
    membrane, sheet, moduli, level, floor_and_ball_field, contact, make_forces, settings, as_sparse
):
    """Stretched everywhere and bent: nothing is held, nothing left out, the way to the solution is Newton's own."""
    cloth = Cloth.join([(sheet, moduli)], "constant", membrane)
    laws = (contact.stiffness, contact.thickness, contact.friction)
    step = ImplicitStep(cloth, floor_and_ball_field, level(5.0), laws, np.zeros(3), settings, Stopwatch())
    forces = make_forces(step)
    flat = level(5.0)
    bent = flat * [1.02, 1.0, 1.02] + np.outer(20 * flat[:, 0] ** 2, [0, 1, 0])
    forces.at(bent)
    step.potential.matrix.assemble(0.0)
    matrix, eps = as_sparse(step.potential.matrix), 1e-9
    # up and down the sheet, where bending shows beside the membrane
    direction = np.random.default_rng(0).normal(size=bent.shape) * [0, 1, 0]
    slope = (forces.at(bent + eps * direction) - forces.at(bent - eps * direction)) / (2 * eps)
    found = (matrix @ direction.ravel()).reshape(-1, 3)
    assert found == pytest.approx(-slope, abs=1e-5 * np.abs(slope).max())
    assert Product(step.potential.matrix).of(direction) == pytest.approx(found, abs=1e-6 * np.abs(found).max())
    # crushed, it stays positive where no compression is in it
    forces.at(flat * 0.9 + np.random.default_rng(0).normal(size=flat.shape) * 2e-3)
    step.potential.matrix.assemble(0.0)
    matrix = as_sparse(step.potential.matrix)
    assert abs(matrix - matrix.T).max() < 1e-6 * abs(matrix).max()
    eigenvalues = np.linalg.eigvalsh(matrix.toarray())
    assert eigenvalues.min() > -1e-6 * eigenvalues.max()
