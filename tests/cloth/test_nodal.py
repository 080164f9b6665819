"""Strain averaged around vertices: even strain is kept, forces are the energy's gradient, panels do not mix."""

from dataclasses import replace

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.cloth import nodal
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
def averaged(sheet, moduli):
    """The sheet with internal friction and hardly any bending, its strain averaged."""
    fabric = replace(moduli, bend=moduli.bend * 1e-9, damping_time=0.01)
    cloth = Cloth.join([(sheet, fabric)], membrane="nodal")
    return Elastic(cloth, ti.Vector.field(3, float, shape=cloth.vertex_count))


@pytest.fixture(scope="module")
def forces(averaged):
    return Forces(averaged)


def rough(sheet, seed: int) -> np.ndarray:
    flat = np.column_stack([sheet.points, np.zeros(len(sheet.points))])
    return flat + np.random.default_rng(seed).normal(size=flat.shape) * 5e-4


def test_even_strain_stores_what_flat_triangles_store(sheet, averaged, moduli):
    stretched = np.column_stack([sheet.points, np.zeros(len(sheet.points))]) @ [[1.02, 0, 0], [0.01, 0.99, 0], [0] * 3]
    averaged.x.from_numpy(stretched)
    averaged.begin_step()
    averaged.evaluate(0.0)
    f = np.array([[1.02, 0.01], [0, 0.99]]).T
    e = (f @ f.T - np.eye(2)) / 2
    c = moduli.stretch
    exact = sheet.areas.sum() / 2 * np.array([c[0] * e[0, 0] ** 2 + c[1] * e[1, 1] ** 2, c[3] * 4 * e[0, 1] ** 2])
    assert averaged.energies()[:2] == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize("inverse_dt", [0.0, 60.0])
def test_force_is_minus_the_gradient(averaged, forces, sheet, inverse_dt):
    def energy(positions):
        averaged.x.from_numpy(positions)
        averaged.evaluate(inverse_dt)
        return averaged.energies(inverse_dt).sum()

    averaged.x.from_numpy(rough(sheet, 3))
    averaged.begin_step()
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


def test_reported_strains_are_those_of_the_stress(averaged, sheet, cloth):
    x = rough(sheet, 4)
    averaged.x.from_numpy(x)
    averaged.evaluate(0.0)
    c = cloth.modulus("stretch")[cloth.fabric]
    for law, own in ((averaged.cloth, False), (cloth, True)):
        e = nodal.strains(law, x)
        stress = np.stack([c[:, 0] * e[:, 0], c[:, 1] * e[:, 1], c[:, 3] * e[:, 2]], axis=1)
        assert (stress == pytest.approx(averaged.stress.to_numpy(), rel=1e-9)) != own


def test_what_averages_out_is_a_tenth_as_stiff(averaged, cloth, sheet):
    """A saw-tooth shift of the rows strains triangles by turns to either side."""
    averaged.x.from_numpy(rough(sheet, 5) * [1, 1, 0])
    averaged.evaluate(0.0)
    found = averaged.energies()[:2].sum()
    e = averaged.strain.to_numpy()
    c = cloth.modulus("stretch")[cloth.fabric].T
    plain = 0.5 * cloth.areas @ (c[0] * e[:, 0] ** 2 + c[1] * e[:, 1] ** 2 + c[3] * e[:, 2] ** 2)
    assert nodal.OWN * plain < found < 0.5 * plain


def test_one_node_a_vertex_within_a_panel_and_one_on_each_side_of_a_seam(cloth, sheet, moduli):
    assert nodal.nodes(cloth).max() + 1 == cloth.vertex_count
    # the right half is cut with its grain turned by 90 degrees
    right = sheet.points[sheet.triangles].mean(axis=1)[:, 0] > 0.06
    turned = np.where(right[:, None, None], sheet.rest @ [[0, 1], [-1, 0]], sheet.rest)
    sewn = Cloth.join([(type(sheet)(**{**vars(sheet), "rest": turned}), moduli)])
    node = nodal.nodes(sewn)
    sides = [np.unique(node[side]) for side in (right, ~right)]
    assert len(np.intersect1d(*sides)) == 0
    shared = np.intersect1d(sheet.triangles[right], sheet.triangles[~right])
    assert len(shared) > 5
    assert node.max() + 1 == cloth.vertex_count + len(shared)
    table = nodal.members(sewn, node)
    for t in (0, len(node) - 1):
        for n in node[t]:
            assert set(sheet.triangles[t]) <= set(table[n])
