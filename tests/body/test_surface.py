import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from taichi_tryon.body.density import density, gap
from taichi_tryon.body.skeleton import Motion
from taichi_tryon.body.surface import surface_mesh


def _check_closed(vertices, triangles):
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 2).all()
    graph = coo_matrix((np.ones(len(unique)), unique.T), shape=(len(vertices),) * 2)
    assert connected_components(graph)[0] == 1


def _volume(vertices, triangles):
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


@pytest.mark.parametrize("name", ["arms_raised_45", "standing", "step_forward_right"])
def test_skin_is_closed_in_each_pose(woman, pose, name):
    vertices, triangles = surface_mesh(woman.posed(woman.skeleton.transforms(pose(name))))
    _check_closed(vertices, triangles)
    assert 0.048 < _volume(vertices, triangles) < 0.053


@pytest.mark.parametrize("end", ["arms_raised_45", "step_forward_right"])
def test_skin_stays_closed_on_the_way(woman, pose, end):
    motion = Motion(woman.skeleton, (0.0, 1.0), (pose("standing"), pose(end)))
    for time in np.linspace(0.1, 0.9, 5):
        _check_closed(*surface_mesh(woman.posed(motion.transforms(time)), 0.01))


def test_feet_stand_on_the_floor(woman, pose):
    for name in ("arms_raised_45", "standing", "step_forward_right"):
        vertices, _ = surface_mesh(woman.posed(woman.skeleton.transforms(pose(name))), 0.006)
        assert abs(vertices[:, 1].min()) < 2e-3


def test_vertices_lie_on_the_skin(woman):
    vertices, _ = surface_mesh(woman.balls, 0.008)
    np.testing.assert_allclose(density(woman.balls, vertices), 1, atol=0.02)


def test_sphere_has_its_volume_and_faces_outward(one_ball):
    vertices, triangles = surface_mesh(one_ball([10, 10, 10]).balls, 0.004)
    _check_closed(vertices, triangles)
    assert _volume(vertices, triangles) == pytest.approx(4 / 3 * np.pi * (0.1 * np.sqrt(0.5)) ** 3, rel=5e-3)


def test_infinite_cylinder_is_cut_off_and_closed(one_ball):
    vertices, triangles = surface_mesh(one_ball([10, np.inf, 10]).balls, 0.02)
    _check_closed(vertices, triangles)
    assert np.ptp(vertices[:, 1]) == pytest.approx(2, abs=0.06)


def test_arms_of_the_standing_pose_are_clear_of_the_body(woman, pose):
    balls = woman.posed(woman.skeleton.transforms(pose("standing")))
    vertices, _ = surface_mesh(balls)
    legs_and_trunk = woman.groups("trunk", "leg_l", "leg_r")
    below_elbow = woman.landmark("elbow_l", woman.skeleton.transforms(pose("standing")))[1]
    arm = vertices[(vertices[:, 1] < below_elbow) & (density(balls, vertices, legs_and_trunk) < 0.5)]
    assert len(arm) > 2000 and gap(balls, arm, legs_and_trunk).min() > 0.03
