from dataclasses import replace

import numpy as np
import pytest

from taichi_tryon.body.density import FAR, closest, density, gap, gradient, hessian, winner

STEP = 1e-5


def _differences(function, x):
    """Central differences of function (k, ...) along the three axes: (k, ..., 3)."""
    ends = [(function(x + STEP * axis) - function(x - STEP * axis)) / (2 * STEP) for axis in np.eye(3)]
    return np.stack(ends, axis=-1)


@pytest.fixture(scope="module", params=["arms_raised_45", "standing", "step_forward_right"])
def case(request, woman, pose, skin_points):
    """Balls in a pose, and points where the same group wins all around."""
    balls = woman.posed(woman.skeleton.transforms(pose(request.param)))
    x, _ = skin_points(balls, 1500, 0.03)
    around = [winner(balls, x + 2 * STEP * way) for way in np.vstack((np.eye(3), -np.eye(3)))]
    return balls, x[(np.array(around) == winner(balls, x)).all(axis=0)]


def test_one_ball_is_the_polynomial(one_ball):
    balls = one_ball([10, 20, 40]).balls
    inside = balls.centers + np.array([[0.05, 0.0, 0.0], [0.03, 0.1, 0.2], [0.0, 0.0, 0.0]])
    s = (((inside - balls.centers) / balls.radii) ** 2).sum(axis=1)
    np.testing.assert_allclose(density(balls, inside), 8 * (1 - s) ** 3, rtol=1e-12)
    assert density(balls, balls.centers + np.array([[0.1 + 1e-9, 0.0, 0.0]])) == 0


def test_density_is_the_largest_group_sum(woman, skin_points):
    """Eqs. 1 and 2, ball by ball."""
    balls = woman.balls
    x, _ = skin_points(balls, 60, 0.03)
    each = np.zeros((len(x), 100))
    for k in range(100):
        local = (x - balls.centers[k]) @ balls.axes[k] / balls.radii[k]
        each[:, k] = balls.weights[k] * np.maximum(1 - (local**2).sum(axis=1), 0) ** 3
    sums = np.array([each[:, members].sum(axis=1) for members in balls.membership.T]).T
    np.testing.assert_allclose(density(balls, x), sums.max(axis=1), atol=1e-11)
    for group in range(5):
        np.testing.assert_allclose(density(balls, x, (group,)), sums[:, group], atol=1e-11)
    np.testing.assert_allclose(density(balls, x, (1, 3)), sums[:, [1, 3]].max(axis=1), atol=1e-11)
    np.testing.assert_array_equal(winner(balls, x), sums.argmax(axis=1))
    assert set(winner(balls, x, (1, 3))) <= {1, 3}


def test_gradient_by_differences(case):
    """The sum in eq. 3."""
    balls, x = case
    np.testing.assert_allclose(gradient(balls, x), _differences(lambda y: density(balls, y), x), atol=2e-4)


def test_hessian_by_differences(case):
    balls, x = case
    np.testing.assert_allclose(hessian(balls, x), _differences(lambda y: gradient(balls, y), x), rtol=1e-3, atol=1.0)


@pytest.mark.parametrize(
    ("radii", "axes"), [([10, 10, 10], [0, 1, 2]), ([10, np.inf, 10], [0, 2]), ([10, np.inf, np.inf], [0])]
)
def test_gap_of_exact_bodies(one_ball, radii, axes):
    """Sphere, cylinder and slab of half size 0.1 sqrt(1/2) m."""
    balls = one_ball(radii).balls
    random = np.random.default_rng(3)
    directions = np.zeros((500, 3))
    directions[:, axes] = random.normal(size=(500, len(axes)))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    distances = random.uniform(-0.02, 0.02, 500)
    along = random.uniform(-5, 5, (500, 3))
    along[:, axes] = 0
    x = balls.centers + along + (0.1 * np.sqrt(0.5) + distances)[:, None] * directions
    found, feet, normals = closest(balls, x)
    np.testing.assert_allclose(found, distances, atol=1e-8)
    np.testing.assert_allclose(normals, directions, atol=1e-8)
    np.testing.assert_allclose(density(balls, feet), 1, atol=1e-7)


def test_gap_is_the_distance_to_the_skin(case, skin_points):
    balls, _ = case
    x, distances = skin_points(balls, 2000, 0.005)
    error = np.abs(gap(balls, x) - distances)
    assert np.percentile(error, 98) < 2e-5
    # Between two parts of the body the nearest skin may be another one.
    assert error.max() < 3e-3


def test_nothing_reaches_far_points(woman):
    x = np.array([[3.0, 0.0, 0.0]])
    assert density(woman.balls, x) == 0 and gap(woman.balls, x) == FAR
    np.testing.assert_array_equal(gradient(woman.balls, x), 0)


def _moved_by_fusing(balls, points) -> np.ndarray:
    fused = replace(balls, membership=np.ones((100, 1), bool))
    return np.abs(gap(fused, points))


def test_copies_keep_legs_and_arms_apart(woman, turned):
    """Section 2: legs together, arms 4 degrees from the vertical. Fusing all balls changes the body there."""
    from taichi_tryon.body.surface import surface_mesh

    close = turned(thigh_l=[0, 0, -7], thigh_r=[0, 0, 7], upperarm_l=[0, 0, -41], upperarm_r=[0, 0, 41])
    balls = woman.posed(woman.skeleton.transforms(close))
    vertices, _ = surface_mesh(balls)
    moved = _moved_by_fusing(balls, vertices)
    assert 0.08 < (moved > 1e-3).mean() < 0.2
    assert moved.max() > 0.02
    # Between the knees, calves and ankles the thickened sum of fused legs would weld the skin; the groups leave a gap.
    left, right = woman.groups("leg_l", "leg_r")
    shank = vertices[(vertices[:, 1] > 0.1) & (vertices[:, 1] < 0.5)]
    assert np.minimum(density(balls, shank, (left,)), density(balls, shank, (right,))).max() < 0.9
    np.testing.assert_allclose(density(balls, shank, (left, right)), 1, atol=0.02)


def test_groups_join_without_a_crease(woman, pose):
    """Where the winner changes, both sums agree in direction, but for the fold between the thighs, which is real."""
    from taichi_tryon.body.surface import surface_mesh

    for name in ("arms_raised_45", "standing", "step_forward_right"):
        balls = woman.posed(woman.skeleton.transforms(pose(name)))
        vertices, triangles = surface_mesh(balls)
        corners = winner(balls, vertices)[triangles]
        border = vertices[np.unique(triangles[(corners != corners[:, :1]).any(axis=1)])]
        border = border[(border[:, 1] > 0.74) | (np.abs(border[:, 0]) > 0.05)]
        normals = gradient(balls, border)
        best = winner(balls, border)
        for group in range(5):
            near = (best != group) & (np.abs(density(balls, border, (group,)) - 1) < 0.02)
            if near.any():
                other = gradient(balls, border[near], (group,))
                cosine = np.einsum("ki,ki->k", normals[near], other)
                cosine /= np.linalg.norm(normals[near], axis=1) * np.linalg.norm(other, axis=1)
                assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 10
