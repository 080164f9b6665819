"""A dense look at triangles that pierce a ball of known radius."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.contact.probe import Probe

RADIUS, CENTER = 0.1, np.array([0.0, 1.0, 0.0])


@pytest.fixture(scope="module")
def probe(floor_and_ball_field):
    x = ti.Vector.field(3, float, shape=6)
    return Probe(np.array([[0, 1, 2], [3, 4, 5]]), floor_and_ball_field, x)


def tilted(height: float) -> np.ndarray:
    """Two triangles in parallel planes: the first ``height`` above the ball's centre, the second clear of it."""
    flat = np.array([[-0.09, 0, -0.08], [0.11, 0, -0.07], [0.01, 0, 0.12]])
    c, s = np.cos(0.5), np.sin(0.5)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return CENTER + np.vstack([flat + [0, height, 0], flat + [0, 0.11, 0]]) @ turn.T


@pytest.mark.parametrize("height", [0.099, 0.095, 0.085])
def test_depth_and_share_of_a_triangle_through_a_ball(probe, height):
    probe.x.from_numpy(tilted(height))
    depth, inside, samples = probe.look(1e-3)
    # between points of the lattice, 1 mm apart, lies at most 0.58 mm: on the ball 2 um in depth
    assert depth[0] == pytest.approx(RADIUS - height, abs=5e-6)
    corners = tilted(height)[:3]
    area = np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])) / 2
    disk = np.pi * (RADIUS**2 - height**2)
    assert inside[0] / samples[0] == pytest.approx(disk / area, rel=0.05)
    assert depth[1] == 0 and inside[1] == 0 and samples[1] == samples[0]


def test_a_coarser_look_is_a_cheaper_one(probe):
    probe.x.from_numpy(tilted(0.09))
    fine, coarse = probe.look(2e-3), probe.look(1e-2)
    assert coarse[2].sum() < fine[2].sum() / 20
    assert coarse[0][0] == pytest.approx(fine[0][0], abs=2e-4)


def test_gaps_are_distances_near_the_skin(probe):
    directions = np.random.default_rng(0).normal(size=(6, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    distances = np.array([-0.004, -0.0005, 0.0, 0.0005, 0.003, 0.008])
    probe.x.from_numpy(CENTER + directions * (RADIUS + distances)[:, None])
    assert probe.gaps() == pytest.approx(distances, abs=1e-6)
