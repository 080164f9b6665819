"""Arcs over the sides of triangles: strain of rolled sheets, forces, and the matrix, against exact values."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.cloth import arcs
from taichi_tryon.cloth.elastic import Elastic
from taichi_tryon.cloth.model import Cloth


@ti.data_oriented
class Forces:
    def __init__(self, elastic):
        self.elastic, self.f = elastic, ti.Vector.field(3, float, shape=elastic.nv)

    @ti.kernel
    def gather(self):
        for i in self.f:
            self.f[i] = self.elastic.force(i)


@pytest.fixture(scope="module")
def corrected(sheet, moduli):
    """The sheet without bending, its strain corrected, with internal friction."""
    from dataclasses import replace

    soft = replace(moduli, bend=moduli.bend * 1e-9, damping_time=0.01)
    cloth = Cloth.join([(sheet, soft)], membrane="corrected")
    return Elastic(cloth, ti.Vector.field(3, float, shape=cloth.vertex_count))


@pytest.fixture(scope="module")
def forces(corrected):
    return Forces(corrected)


def rolled(points: np.ndarray, degrees: float, radius: float) -> np.ndarray:
    along = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    across = np.array([-along[1], along[0]])
    s = points @ along / radius
    return np.column_stack([radius * np.sin(s), radius * np.cos(s), points @ across])


def rough(sheet, seed: int) -> np.ndarray:
    flat = np.column_stack([sheet.points, np.zeros(len(sheet.points))])
    return flat + np.random.default_rng(seed).normal(size=flat.shape) * 2e-3


@pytest.mark.parametrize("degrees", [0, 30, 90])
def test_a_sheet_rolled_up_is_not_strained(sheet, cloth, corrected, degrees):
    x = rolled(sheet.points, degrees, 0.024)  # half an edge length of turn a triangle
    corrected.x.from_numpy(x)
    corrected.evaluate(0.0)
    found = np.abs(corrected.strain.to_numpy()).max(axis=1)
    f = np.einsum("tik,tia->tak", x[cloth.triangles], cloth.gradients)
    plain = np.stack([(f[:, 0] ** 2).sum(1) - 1, (f[:, 1] ** 2).sum(1) - 1, 2 * (f[:, 0] * f[:, 1]).sum(1)], 1) / 2
    inner = (arcs.flaps(cloth) >= 0).all(axis=1)
    assert found[inner].max() < 0.15 * np.abs(plain[inner]).max()
    # where a border leaves one curvature unknown, it is no worse
    assert found.max() < 1.01 * np.abs(plain).max()


def test_bows_of_a_quadratic_are_its_second_derivatives(sheet, cloth):
    """Exact where there are three flaps, whatever the shape of the triangles."""
    b = np.array([[3.0, 1.0], [1.0, -2.0]])
    z = 0.5 * np.einsum("va,ab,vb->v", sheet.points, b, sheet.points) + sheet.points @ [0.3, -0.2] + 0.1
    across = arcs.flaps(cloth)
    z = np.where((patch := np.hstack([cloth.triangles, across])) >= 0, z[patch], 0.0)
    q = np.einsum("tki,ti->tk", arcs.bow_weights(cloth), z)
    sides = np.roll(sheet.rest, -2, axis=1) - np.roll(sheet.rest, -1, axis=1)
    exact = np.einsum("tka,ab,tkb->tk", sides, b, sides)
    inner = (across >= 0).all(axis=1)
    assert 20 < inner.sum() < len(inner)
    assert q[inner] == pytest.approx(exact[inner], rel=1e-9, abs=1e-12)
    assert (q[(across < 0).sum(axis=1) == 2] == 0).all()


@pytest.mark.parametrize("inverse_dt", [0.0, 60.0])
def test_force_is_minus_the_gradient(corrected, forces, sheet, inverse_dt):
    def energy(positions):
        corrected.x.from_numpy(positions)
        corrected.evaluate(inverse_dt)
        return corrected.energies(inverse_dt).sum()

    corrected.x.from_numpy(rough(sheet, 3))
    corrected.begin_step()
    x, eps = rough(sheet, 0), 1e-7
    energy(x)
    forces.gather()
    f = forces.f.to_numpy()
    assert np.abs(f.sum(axis=0)).max() < 1e-12 * np.abs(f).sum()
    assert np.abs(np.cross(x, f).sum(axis=0)).max() < 1e-12 * np.abs(f).sum()
    for seed in range(3):
        direction = np.random.default_rng(seed).normal(size=x.shape)
        slope = (energy(x + eps * direction) - energy(x - eps * direction)) / (2 * eps)
        assert -(f * direction).sum() == pytest.approx(slope, rel=1e-6)


def test_strain_rate_is_the_derivative_of_the_strain(corrected, sheet):
    x, eps = rough(sheet, 0), 1e-6
    v = ti.Vector.field(3, float, shape=len(x))
    velocity = np.random.default_rng(1).normal(size=x.shape)
    v.from_numpy(velocity)

    def strain(positions):
        corrected.x.from_numpy(positions)
        corrected.evaluate(0.0)
        return corrected.strain.to_numpy()

    exact = (strain(x + eps * velocity) - strain(x - eps * velocity)) / (2 * eps)
    start = strain(x)
    corrected.begin_step()
    corrected.begin_stage(v, 1.0, 0.0)
    assert corrected.strain_ref.to_numpy() - start == pytest.approx(exact, rel=1e-6, abs=1e-6)
