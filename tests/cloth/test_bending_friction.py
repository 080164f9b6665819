"""Dry friction in bending, of both laws: the loops of rolled sheets, forces that follow from the potential."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import taichi as ti

from taichi_tryon import units
from taichi_tryon.cloth.elastic import Elastic
from taichi_tryon.cloth.hysteresis import BENDING_REACH
from taichi_tryon.cloth.model import Cloth

EDGE = 0.006
HB = np.array([0.03, 0.02]) * units.GF_CM_PER_CM


@ti.data_oriented
class Law:
    """A sheet of 6 by 5 cm that rubs: potential of each triangle, force on each vertex."""

    def __init__(self, sheet, moduli, bending):
        self.cloth = Cloth.join([(sheet, replace(moduli, bend_friction=tuple(HB)))], bending)
        self.elastic = Elastic(self.cloth, ti.Vector.field(3, float, shape=self.cloth.vertex_count))
        self.law = self.elastic.bending
        self.psi = ti.field(float, shape=len(self.cloth.triangles))
        self.pull = ti.Vector.field(3, float, shape=self.cloth.vertex_count)
        self.free = bending == "mid_edge"

    @ti.kernel
    def _gather(self):
        for t in self.psi:
            if ti.static(self.free):
                self.psi[t] = self.law.friction.potential(t, self.law._leans(t, 0))
            else:
                self.psi[t] = self.law.friction.potential(t, self.law._leans(t))
        for i in self.pull:
            self.pull[i] = self.elastic.force(i)

    def at(self, positions, sweeps=12):
        self.elastic.x.from_numpy(positions)
        for _ in range(sweeps if self.free else 1):  # until the edge rotations have converged
            self.elastic.evaluate(0.0)
        self._gather()
        return SimpleNamespace(
            psi=self.psi.to_numpy(), force=self.pull.to_numpy(), energy=self.elastic.energies()[:3].sum()
        )

    def start(self):
        self.elastic.restore({name: 0.0 * values for name, values in self.elastic.state().items()})


@pytest.fixture(scope="module")
def swatch(make_sheet):
    return make_sheet(0.06, 0.05, EDGE)


@pytest.fixture(scope="module", params=["mid_edge", "constant"])
def law(request, swatch, moduli):
    return Law(swatch, moduli, request.param)


def rolled(points: np.ndarray, degrees: float, curvature: float) -> np.ndarray:
    """The sheet on a cylinder whose curved direction lies at an angle to the warp."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    along, across = points @ [c, s], points @ [-s, c]
    turn = curvature * along
    # sin(t) / t and (1 - cos(t)) / t, at t = 0 too
    shape = np.sinc(turn / np.pi), 0.5 * turn * np.sinc(turn / (2 * np.pi)) ** 2
    return np.column_stack([along * shape[0], along * shape[1], across])


# from flat to the top, down, up: the corners of the loop lie on points of the path
@pytest.mark.parametrize("degrees, top", [(0, 30), (90, 30), (45, 60)])
def test_a_bending_cycle_has_the_width_of_kes(law, swatch, degrees, top):
    """Width 2HB at curvature 0, of a strip along the warp, the weft, and between: HB_warp cos^2 + HB_weft sin^2."""
    middle = swatch.points[swatch.triangles].mean(axis=1)
    inner = (np.abs(middle - [0.03, 0.025]) < np.array([0.03, 0.025]) - 2 * EDGE).all(axis=1)
    share = np.cos(np.radians([degrees, 90 - degrees])) ** 2
    # friction sets in where warp and weft have bent by the reach
    reach = BENDING_REACH / share.max()
    step = reach / 2
    curvatures = np.concatenate([np.arange(0, top, step), np.arange(top, -top, -step), np.arange(-top, top + 1, step)])
    law.start()
    moments, eps = [], 1e-3
    for curvature in curvatures:
        up, down = (law.at(rolled(swatch.points, degrees, curvature + sign * eps)).psi[inner].sum() for sign in (1, -1))
        moments.append((up - down) / (2 * eps * swatch.areas[inner].sum()))
        law.at(rolled(swatch.points, degrees, curvature))
        law.elastic.end_step()
    moments, first = np.array(moments), round(top / step)
    crossings = np.flatnonzero(np.abs(curvatures) < 1e-9)
    width, exact = moments[crossings[2]] - moments[crossings[1]], 2 * share @ HB
    limit = 0.002 if law.free else 0.015
    assert width == pytest.approx(exact, rel=limit)
    loop, along = moments[first:], curvatures[first:]
    area = (0.5 * (loop[1:] + loop[:-1]) * np.diff(along)).sum()
    assert area == pytest.approx(exact * (2 * top - 2 * reach), rel=0.01 + limit)


def test_force_is_minus_the_gradient_where_some_of_it_slips(law, swatch):
    rng = np.random.default_rng(4)
    flat = rolled(swatch.points, 30, 8.0)
    start = flat + rng.normal(size=flat.shape) * 5e-5
    law.start()
    law.at(rolled(swatch.points, 0, 0.0))
    all_stuck = law.law.friction.stuck.to_numpy()
    law.at(start)
    law.elastic.end_step()
    moved, direction = start + rng.normal(size=flat.shape) * 5e-5, rng.normal(size=flat.shape)
    here = law.at(moved, 40)
    inner = all_stuck > 0
    assert 0.1 < (law.law.friction.stuck.to_numpy()[inner] < 0.99 * all_stuck[inner]).mean() < 0.9
    eps = 1e-8
    slope = (law.at(moved + eps * direction, 40).energy - law.at(moved - eps * direction, 40).energy) / (2 * eps)
    assert -(here.force * direction).sum() == pytest.approx(slope, rel=1e-5)


def test_forces_and_moments_of_friction_balance(law, swatch):
    positions = rolled(swatch.points, 30, 20.0) + np.random.default_rng(1).normal(size=(len(swatch.points), 3)) * 1e-4
    law.start()
    force = law.at(positions).force
    scale = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * scale
    assert np.abs(np.cross(positions, force).sum(axis=0)).max() < 1e-9 * scale


def test_a_fabric_without_limits_has_nothing_of_it(cloth, elastic):
    assert not elastic.friction.present and not elastic.bending.friction.present
    assert "anchor" not in vars(elastic.friction) and "stuck" not in vars(elastic.bending.friction)
    assert set(elastic.state()) == {"rotation"}


def test_what_a_clamp_holds_flat_does_not_rub(swatch, moduli):
    cloth = Cloth.join([(swatch, replace(moduli, bend_friction=tuple(HB)))])
    held = swatch.points[:, 0] < 0.02
    clamped = cloth.clamped(held)
    rigid = held[cloth.triangles].all(axis=1)
    assert rigid.any() and not clamped.bend_friction[rigid].any()
    assert clamped.bend_friction[~rigid] == pytest.approx(np.tile(HB, ((~rigid).sum(), 1)))
