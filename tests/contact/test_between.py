"""Cloth between two skins: what counts of its depths, and that force and Hessian belong to the energy there."""

import math

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.body.field import BodyField
from taichi_tryon.body.model import Body
from taichi_tryon.body.spec import BodySpec
from taichi_tryon.contact import between

APART, TILT = -1e-3, 5.0


@pytest.fixture(scope="module")
def wedge(make_felt):
    """What the piece feels between a floor at y = 0 and a ceiling, two groups, that is APART above the floor at the
    origin and turned by TILT degrees about the z axis: too narrow everywhere for the piece."""
    reach = 10 * math.sqrt(2)
    slab = {"radii_cm": [math.inf, reach, math.inf], "weight": 8, "bones": {"root": 1}}
    turn, up = math.radians(TILT), 10 + 100 * APART
    ceiling = [-up * math.sin(turn), up * math.cos(turn), 0]
    data = {
        "name": "wedge",
        "bones": {"root": {"parent": None, "head_cm": [0, 0, 0]}},
        "groups": ["floor", "ceiling"],
        "balls": {
            "floor": {"center_cm": [0, -10, 0], "groups": ["floor"], **slab},
            "ceiling": {"center_cm": ceiling, "rotation_degree": [0, 0, TILT], "groups": ["ceiling"], **slab},
        },
    }
    field = BodyField(Body.from_spec(BodySpec.model_validate(data)))
    field.set_pose(np.eye(4)[None])
    return make_felt(field, 0.3)


@ti.kernel
def _relieve(depths: ti.types.ndarray(), t: float, out: ti.types.ndarray()):
    for i in range(depths.shape[0]):
        relief = between.relief(depths[i, 0], depths[i, 1], t)
        for k in ti.static(range(3)):
            out[i, k] = relief[k]


def relieved(depths, t: float) -> np.ndarray:
    out = np.empty((len(depths), 3))
    _relieve(np.ascontiguousarray(depths, float), t, out)
    return out.T


def test_what_does_not_count_is_symmetric_and_no_more_than_the_depth(law):
    depths = np.random.default_rng(0).uniform(1e-6, 5e-3, (200, 2))
    common, by_one, by_other = relieved(depths, law.thickness)
    assert np.allclose(relieved(depths[:, ::-1], law.thickness), [common, by_other, by_one], rtol=1e-9)
    assert (common > 0).all() and (common < depths.max(axis=1)).all()
    for axis, slope in enumerate((by_one, by_other)):
        shift = 1e-9 * np.eye(2)[axis]
        ends = [relieved(depths + sign * shift, law.thickness)[0] for sign in (1, -1)]
        assert slope == pytest.approx((ends[0] - ends[1]) / 2e-9, rel=1e-5, abs=1e-6)


def test_of_two_alike_a_bounded_depth_is_left_and_of_one_alone_all(law):
    most = between.COMMON * law.thickness
    depth = np.array([1e-6, 1e-4, 1e-3, 1e-1])
    assert depth - relieved(np.column_stack([depth, depth]), law.thickness)[0] == pytest.approx(
        depth / (1 + depth / most), rel=1e-6
    )
    assert relieved([[1e-3, 1e-9]], law.thickness)[0] == pytest.approx(0, abs=1e-13)


def test_between_two_skins_force_and_hessian_are_those_of_the_energy(wedge, flat, samples):
    """Without friction, in the narrow half and in the wide one, and across the middle."""
    start = flat(0.5 * APART)
    start += np.random.default_rng(4).normal(size=start.shape) * 5e-5
    wedge.start(start)
    wedge.law.friction[None] = 0.0
    wedge.law.bind(0, 0.0)
    force = wedge.at(start)
    beside = wedge.law.gap_beside.to_numpy()
    assert (beside < 0).any() and (beside > 0).any() and (beside < wedge.law.thickness[None]).all()
    parts = wedge.part.to_numpy()
    eps, size = 1e-9, np.abs(parts).max()
    for seed in range(3):
        direction = np.random.default_rng(seed).normal(size=start.shape)
        energies, forces = [], []
        for sign in (1, -1):
            forces.append(wedge.at(start + sign * eps * direction))
            energies.append(wedge.law.energy())
        assert -(force * direction).sum() == pytest.approx((energies[0] - energies[1]) / (2 * eps), rel=1e-3)
        # the Hessian leaves out how the depth that does not count bends
        product = np.zeros_like(start)
        for s, ids in enumerate(samples.vertices):
            for a in range(3):
                for b in range(3):
                    product[ids[a]] += parts[s, a, b] @ direction[ids[b]]
        slope = (forces[1] - forces[0]) / (2 * eps)
        assert np.linalg.norm(product - slope) < 0.35 * np.linalg.norm(product) and np.abs(product).max() < 100 * size


def test_over_the_middle_the_force_is_continuous_and_brings_back(wedge, flat):
    """Friction's, too, which holds to a plane between the skins."""
    middle = flat(0.0)
    middle[:, 1] = 0.5 * APART + middle[:, 0] * math.tan(math.radians(TILT / 2))
    wedge.start(middle - [0, 1e-7, 0])
    wedge.law.bind(1, 0.0)
    moved = [0, 0, 2e-5]
    below, above = (wedge.at(middle + np.array([0, shift, 0]) + moved) for shift in (-1e-10, 1e-10))
    assert np.abs(below).max() > 1e-3
    assert np.abs(below - above).max() < 1e-4 * np.abs(below).max()
    assert wedge.at(middle - [0, 1e-4, 0])[:, 1].sum() > 0 > wedge.at(middle + [0, 1e-4, 0])[:, 1].sum()


def test_while_it_is_forced_on_cloth_goes_out_of_the_nearer_one(wedge, flat):
    wedge.law.firm(False)
    try:
        wedge.start(flat(0.0))
        assert np.all(wedge.law.gap_beside.to_numpy() >= 2 * wedge.law.thickness[None])
    finally:
        wedge.law.firm()
    # what lies still is looked at again
    wedge.law.evaluate()
    assert (wedge.law.gap_beside.to_numpy() < wedge.law.thickness[None]).any()
