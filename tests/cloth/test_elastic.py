"""The whole sheet: forces are minus the gradient of the energy, blocks its Hessian, and rigid motions are free."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.cloth.elastic import Elastic


@ti.data_oriented
class Forces:
    def __init__(self, elastic, count):
        self.elastic, self.f = elastic, ti.Vector.field(3, float, shape=count)

    @ti.kernel
    def gather(self):
        for i in self.f:
            self.f[i] = self.elastic.force(i)


@pytest.fixture(scope="module")
def system(elastic, sheet):
    return elastic.x, elastic, Forces(elastic, len(sheet.points))


def rough(sheet, seed=0, size=5e-4):
    flat = np.column_stack([sheet.points, np.zeros(len(sheet.points))])
    return flat + np.random.default_rng(seed).normal(size=flat.shape) * size


def energy(system, positions, sweeps=15, inverse_dt=0.0):
    x, elastic, _ = system
    x.from_numpy(positions)
    for _ in range(sweeps):
        elastic.evaluate(inverse_dt)
    return elastic.energies(inverse_dt).sum()


def test_force_is_minus_the_gradient(system, sheet):
    x, elastic, forces = system
    positions = rough(sheet)
    elastic.begin_step()
    energy(system, positions)
    forces.gather()
    f = forces.f.to_numpy()
    direction = np.random.default_rng(1).normal(size=positions.shape)
    eps = 1e-7
    slope = (energy(system, positions + eps * direction) - energy(system, positions - eps * direction)) / (2 * eps)
    assert -(f * direction).sum() == pytest.approx(slope, rel=1e-6)


def test_forces_and_moments_balance(system, sheet):
    _, _, forces = system
    positions = rough(sheet, 2)
    energy(system, positions)
    forces.gather()
    f = forces.f.to_numpy()
    scale = np.abs(f).sum()
    assert np.abs(f.sum(axis=0)).max() < 1e-12 * scale
    assert np.abs(np.cross(positions, f).sum(axis=0)).max() < 1e-12 * scale


def test_internal_friction_resists_the_change_since_the_start_of_the_step(sheet, moduli):
    from dataclasses import replace

    from taichi_tryon.cloth.model import Cloth

    cloth = Cloth.join([(sheet, replace(moduli, damping_time=0.01))])
    x = ti.Vector.field(3, float, shape=len(sheet.points))
    elastic = Elastic(cloth, x)
    forces = Forces(elastic, len(sheet.points))
    flat = np.column_stack([sheet.points, np.zeros(len(sheet.points))])
    x.from_numpy(flat)
    elastic.begin_step()
    stretched = flat * [1.001, 1, 1]
    x.from_numpy(stretched)
    found = []
    for inverse_dt in (0.0, 100.0):
        elastic.evaluate(inverse_dt)
        forces.gather()
        found.append(forces.f.to_numpy())
    # tau / dt = 1: viscous stress equals the elastic one
    assert found[1] == pytest.approx(2 * found[0], rel=1e-9, abs=1e-12)
    # bent, hinges resist too; parts of the cloth have parts of the energy
    x.from_numpy(flat + np.outer(5 * flat[:, 0] ** 2, [0, 0, 1]))
    elastic.evaluate(100.0)
    count = len(sheet.triangles)
    parts = [elastic.energies(100.0, slice(*ends)) for ends in ((0, count // 3), (count // 3, count))]
    assert min(part[3] for part in parts) > 0
    assert sum(parts) == pytest.approx(elastic.energies(100.0), rel=1e-12)


def test_energies_of_parts_add_up(system, sheet):
    _, elastic, _ = system
    energy(system, rough(sheet, 4))
    half = len(sheet.triangles) // 2
    parts = elastic.energies(triangles=slice(0, half)) + elastic.energies(triangles=slice(half, len(sheet.triangles)))
    assert parts[:3] == pytest.approx(elastic.energies()[:3], rel=1e-12)
