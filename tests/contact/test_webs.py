"""Cloth in a web between two thicker parts: its depth goes on evenly, and the force belongs to the energy there."""

import numpy as np
import pytest

from taichi_tryon.body.field import BodyField
from taichi_tryon.body.model import Body
from taichi_tryon.body.spec import BodySpec
from taichi_tryon.contact import webs

APART = 5.8


@pytest.fixture(scope="module")
def web(make_felt):
    """What the piece feels of two balls of one group that have fused: half-way between them W is 1.017, and least
    across."""
    ball = {"radii_cm": [10, 10, 10], "weight": 1.75, "bones": {"root": 1}, "groups": ["one"]}
    data = {
        "name": "web",
        "bones": {"root": {"parent": None, "head_cm": [0, 0, 0]}},
        "groups": ["one"],
        "balls": {"left": {"center_cm": [-APART, 0, 0], **ball}, "right": {"center_cm": [APART, 0, 0], **ball}},
    }
    field = BodyField(Body.from_spec(BodySpec.model_validate(data)))
    field.set_pose(np.eye(4)[None])
    return make_felt(field, 0.0)


@pytest.fixture
def begun(web, flat):
    """Begins a step with the piece, a tenth of its size, upright over the web's middle and shifted by (3,) [m]."""

    def at(shift):
        positions = 0.1 * flat(0.0)[:, [0, 2, 1]] + shift
        web.law._begins = True
        web.start(positions)
        web.law.bind(1, 0.0)
        return positions

    return at


def test_in_a_web_the_slope_of_the_beginning_counts(web, begun):
    begun([1e-3, 0, 3e-3])
    assert (web.law.web.to_numpy() >= webs.LEAST).all() and (web.law.web.to_numpy() < webs.GENTLE).all()
    # and off the body, or deep in one of the parts, no other than the skin's
    begun([0, 0, 0.2])
    assert web.law.web.to_numpy().max() == 0
    begun([0.01 * APART, 0, 0])
    assert web.law.web.to_numpy().max() == 0


def test_the_force_is_minus_the_gradient_of_the_energy(web, begun):
    """Also where it has gone from where the step began, and over the web's least W."""
    start = begun([1e-3, 0, 3e-3])
    for shift in ([0, 0, 0], [-5e-4, 0, 2e-4], [-2e-3, 0, 1e-3]):
        by_force, by_energy = web.slopes(start + shift, 1e-7)
        assert by_force == pytest.approx(by_energy, rel=1e-5)


def test_along_the_force_the_energy_falls_evenly(web, begun):
    start = begun([2e-3, 0, 1e-3])
    way = web.at(start).sum(axis=0)
    way /= np.linalg.norm(way)
    energies, gaps = [], []
    for gone in np.linspace(0, 3e-3, 61):
        web.at(start + gone * way)
        energies.append(web.law.energy())
        gaps.append(web.law.gap.to_numpy()[0])
    assert (np.diff(energies)[:20] < 0).all()
    assert np.abs(np.diff(gaps)).max() < 5e-5
