"""A tape along one side of the sheet: force, Hessian and energy against finite differences and Hooke's law."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth.tape import Tapes

POINTS = np.array([[0.0, 0.0, 0.0], [0.012, 0.0, 0.001], [0.025, 0.002, 0.0]])
VERTICES = np.array([[0, 1], [1, 2]])
LENGTHS, STIFFNESS = np.array([0.011, 0.014]), np.array([100.0, 60.0])


@ti.data_oriented
class Probe:
    def __init__(self):
        self.x = ti.Vector.field(3, float, shape=3)
        tables = fields.Tables()
        self.tapes = Tapes(tables, VERTICES, LENGTHS, STIFFNESS, self.x)
        tables.fill()
        self.force = ti.Vector.field(3, float, shape=3)
        self.energy, self.block = ti.field(float, shape=2), ti.Matrix.field(3, 3, float, shape=2)

    @ti.kernel
    def fill(self):
        for i in self.force:
            self.force[i] = self.tapes.force(i)
        for k in self.energy:
            self.energy[k] = self.tapes.energy(k)
            self.block[k] = self.tapes.block(k)

    def at(self, points):
        self.x.from_numpy(points)
        self.fill()
        return self.energy.to_numpy(), self.force.to_numpy(), self.block.to_numpy()


@pytest.fixture(scope="module")
def probe(_taichi):
    return Probe()


def test_force_is_minus_the_gradient_and_balances(probe):
    direction = np.random.default_rng(0).normal(size=POINTS.shape)
    eps = 1e-7
    slope = (probe.at(POINTS + eps * direction)[0].sum() - probe.at(POINTS - eps * direction)[0].sum()) / (2 * eps)
    _, force, _ = probe.at(POINTS)
    assert -(force * direction).sum() == pytest.approx(slope, rel=1e-6)
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()


def test_block_is_the_hessian_where_the_tape_is_taut(probe):
    direction, eps = np.array([0.3, -0.5, 0.8]), 1e-7
    moved = np.zeros_like(POINTS)
    moved[0] = direction
    _, plus, _ = probe.at(POINTS + eps * moved)
    _, minus, _ = probe.at(POINTS - eps * moved)
    _, _, block = probe.at(POINTS)
    np.testing.assert_allclose(block[0] @ direction, -(plus - minus)[1] / (2 * eps), rtol=1e-6)


def test_block_stays_semi_definite_where_the_tape_is_slack(probe):
    _, _, block = probe.at(0.5 * POINTS)
    for b in block:
        values = np.linalg.eigvalsh(-b)
        assert values.min() > -1e-9 * values.max()


def test_stiffness_is_tension_over_strain(probe):
    stretch = 1.4
    line = np.cumsum(np.concatenate([[0.0], LENGTHS])) * stretch
    _, force, _ = probe.at(np.column_stack([line, np.zeros(3), np.zeros(3)]))
    assert force[0, 0] == pytest.approx(STIFFNESS[0] * (stretch - 1))
    assert force[2, 0] == pytest.approx(-STIFFNESS[1] * (stretch - 1))


def test_a_segment_shrunk_to_a_point_stays_finite(probe):
    for found in probe.at(np.zeros((3, 3))):
        assert np.isfinite(found).all()
