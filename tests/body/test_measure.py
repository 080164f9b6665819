import numpy as np
import pytest

from taichi_tryon.body.measure import girth, measure, plane_basis, ray_radius, section

RADIUS = 0.1 * np.sqrt(0.5)


def test_ray_radius_of_a_sphere(one_ball):
    balls = one_ball([10, 10, 10]).balls
    directions = np.vstack((np.eye(3), -np.eye(3)))
    np.testing.assert_allclose(ray_radius(balls, balls.centers[0], directions), RADIUS, atol=1e-9)


def test_ray_that_misses_or_never_leaves_is_nan(one_ball):
    balls = one_ball([10, np.inf, 10]).balls
    along = ray_radius(balls, balls.centers[0], np.array([[0.0, 1.0, 0.0]]))
    missed = ray_radius(balls, balls.centers[0] + [0.5, 0, 0], np.array([[1.0, 0.0, 0.0]]))
    assert np.isnan(along[0]) and np.isnan(missed[0])


def test_ray_takes_the_last_crossing(woman):
    """From the waist sideways across the gap between trunk and arm."""
    center = woman.landmarks["bust_line"].position
    out = np.array([[1.0, 0.0, 0.0]])
    trunk, arm = woman.groups("trunk", "arm_l")
    assert ray_radius(woman.balls, center, out, (arm,))[0] > ray_radius(woman.balls, center, out, (trunk,))[0] + 0.05


def test_girth_of_a_cylinder_in_any_plane(one_ball):
    balls = one_ball([10, np.inf, 10]).balls
    point = balls.centers[0] + [0.02, 0.5, 0.01]
    assert girth(balls, point, np.array([0.0, 3.0, 0.0])) == pytest.approx(2 * np.pi * RADIUS, rel=2e-4)
    slanted = girth(balls, point, np.array([0.0, np.cos(0.5), np.sin(0.5)]))
    angles = np.linspace(0, 2 * np.pi, 20001)
    ellipse = np.hypot(np.diff(RADIUS * np.cos(angles)), np.diff(RADIUS / np.cos(0.5) * np.sin(angles))).sum()
    assert slanted == pytest.approx(ellipse, rel=3e-4)


def test_section_finds_its_centroid(one_ball):
    balls = one_ball([10, 10, 10]).balls
    _, center = section(balls, balls.centers[0] + [0.03, 0.0, 0.02], np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(center, balls.centers[0], atol=5e-4)


def test_plane_beside_the_body_has_no_girth(woman):
    with pytest.raises(ValueError, match="no closed section"):
        girth(woman.balls, np.array([0.0, 5.0, 0.0]), np.array([0.0, 1.0, 0.0]))


def test_tape_does_not_follow_hollows(woman):
    """Between the breasts the tape spans: the hull is shorter than the outline."""
    point = woman.landmarks["bust_line"].position
    points, _ = section(woman.balls, point, np.array([0.0, 1.0, 0.0]), woman.groups("trunk"))
    outline = np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1).sum()
    assert girth(woman.balls, point, np.array([0.0, 1.0, 0.0]), woman.groups("trunk")) < outline - 1e-3


@pytest.mark.parametrize("name", ["arms_raised_45", "standing", "step_forward_right"])
def test_girths_are_the_published_ones(woman, pose, name):
    """Within 3 mm at rest; planes far from a turned joint move with their bone."""
    results = measure(woman, woman.skeleton.transforms(pose(name)))
    assert len(results) == 19
    for part, found, published in results:
        if name == "arms_raised_45" or part in ("neck", "waist", "forearm_l", "calf_r"):
            assert found == pytest.approx(published, abs=3e-3), part


@pytest.mark.parametrize("normal", [[1.0, 0.0, 0.0], [0.6, 0.0, 0.8], [-0.48, 0.6, 0.64]])
def test_plane_basis_is_orthonormal(normal):
    basis = np.vstack((*plane_basis(np.array(normal)), normal))
    np.testing.assert_allclose(basis @ basis.T, np.eye(3), atol=1e-15)
