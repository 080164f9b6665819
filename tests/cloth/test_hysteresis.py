"""Dry friction in the fabric: the element, and the loops that KES would record of a sheet.

Shirting has 2HG of 0.5 to 2 gf/cm and 2HB of 0.03 to 0.1 gf cm/cm.
"""

from dataclasses import replace

import numpy as np
import pytest
import taichi as ti

from taichi_tryon import fields, units
from taichi_tryon.cloth.elastic import Elastic
from taichi_tryon.cloth.hysteresis import SHEAR_REACH, Sliders
from taichi_tryon.cloth.model import Cloth

HG = 0.5 * units.GF_PER_CM
REACH = 0.01


@ti.data_oriented
class One:
    """A single element of two measures."""

    def __init__(self, limits):
        tables = fields.Tables()
        self.sliders = Sliders(np.array([limits]), REACH, tables)
        tables.fill()

    @ti.kernel
    def _evaluate(self, a: float, b: float, drag: int) -> ti.types.vector(5, ti.f64):
        measure = ti.Vector([a, b])
        q, k = self.sliders.friction(0, measure), self.sliders.stiffness(0, measure)
        result = ti.Vector([self.sliders.potential(0, measure), q[0], q[1], k[0], k[1]])
        if drag == 1:
            self.sliders.drag(0, measure)
        return result

    def at(self, measure, drag=False):
        """psi, q (2,), dq (2,)."""
        values = np.array(self._evaluate(*measure, int(drag)))
        return values[0], values[1:3], values[3:]

    @property
    def anchor(self):
        return self.sliders.anchor.to_numpy()[0]


@pytest.fixture(scope="module")
def _one():
    return One([3.0, 2.0])


@pytest.fixture
def one(_one):
    _one.sliders.anchor.fill(0.0)
    _one.sliders.switch(True)
    return _one


@pytest.mark.parametrize("a", [-0.05, -0.011, -0.004, 0.0, 0.009, 0.02])
def test_friction_is_the_gradient_and_stiffness_the_hessian(one, a):
    one.sliders.anchor[0] = [0.001, -0.002]
    measure, eps = np.array([a, 0.003]), 1e-7
    _, q, k = one.at(measure)
    for c in range(2):
        step = np.eye(2)[c] * eps
        up, down = one.at(measure + step), one.at(measure - step)
        assert q[c] == pytest.approx((up[0] - down[0]) / (2 * eps), rel=1e-6, abs=1e-8)
        assert k[c] == pytest.approx((up[1][c] - down[1][c]) / (2 * eps), rel=1e-6, abs=1e-6)


def test_a_closed_cycle_dissipates_the_area_of_the_loop(one):
    """2 Q wide, its corners cut where friction turns round within twice the reach."""
    top, step = 0.07, REACH
    path = np.concatenate([np.arange(0, top, step), np.arange(top, -top, -step), np.arange(-top, top + step / 2, step)])
    q = np.array([one.at([g, 0.0], drag=True)[1][0] for g in path])[7:]
    work = (0.5 * (q[1:] + q[:-1]) * np.diff(path[7:])).sum()
    assert work == pytest.approx(2 * 3.0 * (2 * top - 2 * REACH))


def test_no_step_gains_energy(one):
    rng = np.random.default_rng(0)
    stored, before = 0.0, np.zeros(2)
    for measure in np.cumsum(rng.normal(size=(300, 2)) * 0.008, axis=0):
        _, q, _ = one.at(measure, drag=True)
        left, after, _ = one.at(measure)
        assert after == pytest.approx(q)  # slipping changes no force
        assert q @ (measure - before) - (left - stored) >= -1e-14
        stored, before = left, measure


def test_switched_off_the_anchor_waits(one):
    one.sliders.switch(False)
    psi, q, k = one.at([0.5, 0.5], drag=True)
    assert psi == 0.0 and not q.any() and not k.any() and not one.anchor.any()
    one.sliders.switch(True)
    assert one.at([0.5, 0.5])[1] == pytest.approx([3.0, 2.0])


@pytest.fixture(scope="module")
def rubbing(sheet, moduli):
    """The laws of a sheet that rubs in shear."""
    cloth = Cloth.join([(sheet, replace(moduli, shear_friction=HG))])
    return Elastic(cloth, ti.Vector.field(3, float, shape=cloth.vertex_count))


@pytest.fixture
def virgin(rubbing):
    zero = {name: 0.0 * values for name, values in rubbing.state().items()}
    rubbing.restore(zero)
    return rubbing


def energy(elastic, positions, sweeps=1):
    elastic.x.from_numpy(positions)
    for _ in range(sweeps):
        elastic.evaluate(0.0)
    return elastic.energies()


def sheared(sheet, angle):
    """Fibres keep their length: 2 E12 = sin(angle)."""
    x, y = sheet.points.T
    return np.column_stack([x + y * np.sin(angle), y * np.cos(angle), 0 * x])


def test_a_shear_cycle_has_the_width_of_kes(virgin, sheet):
    """KES shears to 8 degrees, back and forth; the width is that at 0 degrees, where the fabric pulls with +-HG."""
    degrees = np.concatenate([np.arange(0, 8, 0.5), np.arange(8, -8, -0.5), np.arange(-8, 8.5, 0.5)])
    stress, measure = [], np.sin(np.radians(degrees))
    for angle in np.radians(degrees):
        energy(virgin, sheared(sheet, angle))
        virgin.end_step()
        stress.append(virgin.stress.to_numpy()[:, 2])
    stress = np.array(stress)
    assert np.ptp(stress, axis=1).max() < 1e-9
    stress = stress.mean(axis=1)
    middle = np.flatnonzero(degrees == 0)
    assert stress[middle[2]] - stress[middle[1]] == pytest.approx(2 * HG, rel=1e-9)
    # the corners lie beside the points of the path: sin(g) is no straight line
    loop, angle = stress[16:], measure[16:]
    area = (0.5 * (loop[1:] + loop[:-1]) * np.diff(angle)).sum()
    assert area == pytest.approx(2 * HG * (2 * angle[0] - 2 * SHEAR_REACH), rel=2e-3)


def test_forces_follow_from_the_potential_where_some_of_it_slips(virgin, sheet):
    rng = np.random.default_rng(2)
    flat = np.column_stack([sheet.points, 0 * sheet.points[:, 0]])
    moved, direction = flat + rng.normal(size=flat.shape) * 6e-5, rng.normal(size=flat.shape)
    energy(virgin, moved, sweeps=30)
    stuck = np.abs(virgin.strain.to_numpy()[:, 2]) < SHEAR_REACH
    assert 0.1 < stuck.mean() < 0.9
    force, gather = _gather(virgin, len(flat))
    gather()
    eps = 1e-8
    up, down = (energy(virgin, moved + sign * eps * direction, sweeps=30)[:3].sum() for sign in (1, -1))
    assert -(force.to_numpy() * direction).sum() == pytest.approx((up - down) / (2 * eps), rel=1e-5)


def _gather(elastic, count):
    force = ti.Vector.field(3, float, shape=count)

    @ti.kernel
    def gather():
        for i in force:
            force[i] = elastic.force(i)

    return force, gather
