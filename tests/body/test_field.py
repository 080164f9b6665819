"""The Taichi field against its NumPy reference, finite differences and exact bodies."""

import numpy as np
import pytest
import taichi as ti
from scipy.spatial import cKDTree

from taichi_tryon.body import density as reference
from taichi_tryon.body.field import BodyField
from taichi_tryon.body.skeleton import Pose, rotation_matrix
from taichi_tryon.body.surface import surface_mesh

COUNT = 4000
POSES = ["arms_raised_45", "standing", "step_forward_right"]
STEP = 1e-5


@ti.data_oriented
class Probe:
    """Asks a field at many points."""

    def __init__(self, field: BodyField):
        self.field = field
        self.x = ti.Vector.field(3, float, COUNT)
        self.value, self.distance, self.culled = (ti.field(float, COUNT) for _ in range(3))
        self.slope, self.gradient, self.normal, self.shift = (ti.Vector.field(3, float, COUNT) for _ in range(4))
        self.hessian = ti.Matrix.field(3, 3, float, COUNT)
        self.winner = ti.field(ti.i32, COUNT)
        self.only_density, self.clearance, self.bulge = (ti.field(float, COUNT) for _ in range(3))

    def ask(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Answers at x (k, 3), k up to COUNT, as arrays."""
        padded = np.full((COUNT, 3), 9.0)
        padded[: len(x)] = x
        self.x.from_numpy(padded)
        self._ask()
        names = ("value", "distance", "culled", "slope", "gradient", "normal", "shift", "hessian", "winner",
                 "only_density", "clearance", "bulge")  # fmt: skip
        return {name: getattr(self, name).to_numpy()[: len(x)] for name in names}

    def _ask(self):
        # one kernel for all of it takes several times as long to compile
        for ask in (self._ask_sums, self._ask_bend, self._ask_motion, self._ask_distance, self._cull):
            ask()

    @ti.kernel
    def _ask_sums(self):
        for i in self.x:
            x = self.x[i]
            self.value[i], self.slope[i], self.winner[i] = self.field.query(x)
            self.only_density[i] = self.field.density(x)
            self.clearance[i] = self.field.clearance(self.only_density[i])

    @ti.kernel
    def _ask_bend(self):
        for i in self.x:
            self.gradient[i], self.hessian[i] = self.field.derivatives(self.x[i], self.winner[i])
            self.bulge[i] = self.field.curvature(self.x[i], self.winner[i])

    @ti.kernel
    def _ask_motion(self):
        for i in self.x:
            self.shift[i] = self.field.motion(self.x[i], self.winner[i])

    @ti.kernel
    def _ask_distance(self):
        for i in self.x:
            self.distance[i], self.normal[i], _ = self.field.gap(self.x[i])

    @ti.kernel
    def _cull(self):
        for i in self.x:
            self.culled[i], _, _, _ = self.field.gap_within(self.x[i], 0.002, -1)


@pytest.fixture(scope="module")
def probe(woman):
    return Probe(BodyField(woman, margin=0.05))


@pytest.fixture(scope="module", params=POSES)
def posed(request, probe, woman, pose):
    """The probe with the body in a pose, and the balls of that pose."""
    transforms = woman.skeleton.transforms(pose(request.param))
    probe.field.set_pose(transforms)
    return probe, woman.posed(transforms)


def test_balls_are_posed_as_in_numpy(posed):
    probe, balls = posed
    np.testing.assert_allclose(probe.field.center.to_numpy(), balls.centers, atol=1e-13)
    np.testing.assert_allclose(probe.field.quadratic.to_numpy(), balls.quadratics, rtol=1e-11, atol=1e-9)


def test_field_is_the_reference(posed, skin_points):
    """All around and in the body: a cell that missed a ball would show."""
    probe, balls = posed
    near, _ = skin_points(balls, COUNT // 2, 0.03)
    low, high = (balls.centers - balls.extents).min(axis=0), (balls.centers + balls.extents).max(axis=0)
    anywhere = np.random.default_rng(11).uniform(low - 0.05, high + 0.05, (COUNT // 2, 3))
    x = np.vstack((near, anywhere))
    got = probe.ask(x)
    np.testing.assert_allclose(got["value"], reference.density(balls, x), atol=1e-10)
    np.testing.assert_array_equal(got["only_density"], got["value"])
    reached = got["value"] > 0
    np.testing.assert_array_equal(got["winner"][reached], reference.winner(balls, x)[reached])
    np.testing.assert_allclose(got["slope"], reference.gradient(balls, x), atol=1e-8)
    np.testing.assert_allclose(got["gradient"][reached], got["slope"][reached], atol=1e-8)
    np.testing.assert_allclose(got["hessian"][reached], reference.hessian(balls, x)[reached], atol=1e-6)


def test_derivatives_by_differences(posed, skin_points):
    """Eq. 3's gradient, and its own derivative."""
    probe, balls = posed
    x, _ = skin_points(balls, 1000, 0.03)
    here = probe.ask(x)
    ends = [(probe.ask(x + STEP * axis), probe.ask(x - STEP * axis)) for axis in np.eye(3)]
    same = np.all([end["winner"] == here["winner"] for pair in ends for end in pair], axis=0)
    slope = np.stack([(a["value"] - b["value"]) / (2 * STEP) for a, b in ends], axis=-1)
    hessian = np.stack([(a["slope"] - b["slope"]) / (2 * STEP) for a, b in ends], axis=-1)
    assert same.mean() > 0.99
    np.testing.assert_allclose(here["slope"][same], slope[same], atol=2e-4)
    np.testing.assert_allclose(here["hessian"][same], hessian[same], rtol=1e-3, atol=1.0)


def test_gap_near_the_skin(posed, skin_points):
    probe, balls = posed
    x, distances = skin_points(balls, COUNT, 0.005)
    got = probe.ask(x)
    assert np.percentile(np.abs(got["distance"] - distances), 98) < 2e-5
    # Where another part of the body is nearer, its own distance counts: as in the reference.
    assert np.abs(got["distance"] - reference.gap(balls, x)).max() < 5e-4
    assert got["distance"].max() < 0.01 and got["culled"].max() < 0.01
    np.testing.assert_allclose(np.linalg.norm(got["normal"], axis=1), 1, atol=1e-12)
    touching = np.abs(distances) < 1e-3
    np.testing.assert_allclose(got["culled"][touching], got["distance"][touching], atol=1e-12)


def test_gap_is_that_from_the_nearest_limb(probe, woman, turned, skin_points):
    """Not from the one with the greatest density: a hand's falls off faster than that of the thigh it lies on."""
    hand_on_thigh = {"upperarm_r": [27, -25, 28], "lowerarm_r": [0, 95, 0], "thigh_r": [-68, 12, -35]}
    transforms = woman.skeleton.transforms(turned(**hand_on_thigh, calf_r=[44, 0, 0], spine_01=[15, 6, 0]))
    probe.field.set_pose(transforms)
    balls = woman.posed(transforms)
    x, _ = skin_points(balls, COUNT, 0.002)
    x = x[reference.density(balls, x) < 1]
    from_each = np.array([reference.gap(balls, x, (group,)) for group in range(balls.membership.shape[1])])
    nearest = from_each.min(axis=0)
    of_winner = from_each[reference.winner(balls, x), np.arange(len(x))]
    assert (of_winner - nearest).max() > 0.002
    got = probe.ask(x)
    assert np.abs(got["distance"] - nearest).max() < 5e-4 and got["culled"].max() < 0.0025


def test_inside_and_outside_are_told_apart_where_limbs_meet(probe, woman, turned):
    """Between knees that run into each other, the way from the one leads to the other's skin, which faces back."""
    knees = {"thigh_l": [-8.2, -1.13, -8.44], "calf_l": [62.89, 0, 0], "thigh_r": [-1.44, 29.37, 9.67]}
    transforms = woman.skeleton.transforms(turned(**knees, calf_r=[6.06, 0, 0]))
    probe.field.set_pose(transforms)
    x = np.random.default_rng(5).uniform([-0.02, 0.64, 0.05], [0.03, 0.70, 0.09], (COUNT, 3))
    got = probe.ask(x)
    sure = np.abs(got["value"] - 1) > 5e-3
    assert sure.sum() > 500
    np.testing.assert_array_equal(got["distance"][sure] < 0, got["value"][sure] > 1)


def test_no_skin_is_nearer_than_the_clearance(posed, skin_points):
    """Which a gap may overrate, where a group wins whose skin is not the nearest."""
    probe, balls = posed
    for far in (0.002, 0.05):
        x, distances = skin_points(balls, COUNT, far)
        clearance = probe.ask(x)["clearance"]
        assert (clearance <= np.abs(distances) + 1e-9).all()
        # what is deep under one skin may have come out of another
        assert (clearance[distances < -1e-3] == 0).mean() > 0.95 and clearance.max() > 5e-4
    off = probe.ask(np.array([[5.0, 0.0, 0.0]]))["clearance"]
    assert off == pytest.approx(1 / probe.field.steepest)


def test_in_a_web_a_way_that_ends_beside_the_foot_is_no_gap(probe, woman, pose):
    """In the thin skin of an armpit, where the way along the skin runs off and seems to end right above the point."""
    transforms = woman.skeleton.transforms(pose("standing"))
    probe.field.set_pose(transforms)
    skin, _ = surface_mesh(woman.posed(transforms), 0.006)
    at = np.array([-0.13477744, 1.1651963, 0.01918086])
    (depth,), _ = cKDTree(skin).query(at[None])
    got = probe.ask(at + np.random.default_rng(8).uniform(-1e-4, 1e-4, (COUNT, 3)))
    assert depth > 5e-3
    assert (got["distance"] < -2e-3).all()


def test_deep_points_find_the_way_out(posed, skin_points):
    """20 mm inside: a usable depth and a normal that leads out for all points of the trunk and thighs."""
    probe, balls = posed
    x, distances = skin_points(balls, COUNT, 0.001)
    feet, normals = reference.closest(balls, x)[1:]
    thick = (np.abs(feet[:, 0]) < 0.15) & (feet[:, 1] > 0.85) & (feet[:, 1] < 1.25)
    got = probe.ask(feet[thick] - 0.02 * normals[thick])
    assert np.percentile(np.abs(got["distance"] + 0.02), 95) < 2e-3
    assert (np.einsum("ki,ki->k", got["normal"], normals[thick]) > 0.5).mean() > 0.99


def test_deepest_points_are_never_outside(posed):
    """At the balls' centres, up to 9 cm deep, the gradient is small and may lead anywhere; the depth stays usable."""
    probe, balls = posed
    skin, _ = surface_mesh(balls, 0.006)
    depths, _ = cKDTree(skin).query(balls.centers)
    got = probe.ask(balls.centers)
    inside = got["value"] > 1
    assert inside.mean() > 0.9
    assert (got["distance"][inside] < -0.8 * np.minimum(depths[inside], 0.03)).all()
    np.testing.assert_allclose(np.linalg.norm(got["normal"][inside], axis=1), 1, atol=1e-12)


def test_points_off_the_grid_are_far(posed):
    probe, _ = posed
    got = probe.ask(np.array([[5.0, 0.0, 0.0], [0.0, -3.0, 0.0], [0.0, 0.0, 1e6]]))
    np.testing.assert_array_equal(got["value"], 0)
    np.testing.assert_array_equal(got["distance"], probe.field.far)
    np.testing.assert_array_equal(got["slope"], 0)
    assert probe.field.far >= 0.05


def test_motion_of_the_whole_body_is_rigid(probe, woman, turned, skin_points):
    turn, shift = rotation_matrix([0, 3, 0]), np.array([0.01, -0.02, 0.03])
    before = woman.skeleton.transforms(turned())
    after = woman.skeleton.transforms(Pose("moved", {"pelvis": turn}, shift))
    probe.field.set_pose(after, before)
    x, _ = skin_points(woman.posed(after), 500, 0.003)
    root = woman.skeleton.heads[0]
    came_from = (x - root - shift) @ turn + root
    np.testing.assert_allclose(probe.ask(x)["shift"], x - came_from, atol=1e-10)


def test_motion_of_a_limb_moves_only_the_limb(probe, woman, turned, skin_points):
    before, after = (woman.skeleton.transforms(turned(lowerarm_l=[0, angle, 0])) for angle in (0, -2))
    probe.field.set_pose(after, before)
    x, _ = skin_points(woman.posed(after), 3000, 0.003)
    shift = probe.ask(x)["shift"]
    np.testing.assert_array_equal(shift[x[:, 0] < 0], 0)
    bone = woman.skeleton.index("lowerarm_l")
    forearm = (x[:, 0] > 0.42) & (x[:, 0] < 0.46)
    back = before[bone] @ np.linalg.inv(after[bone])
    expected = x[forearm] - (x[forearm] @ back[:3, :3].T + back[:3, 3])
    assert forearm.sum() > 10
    np.testing.assert_allclose(shift[forearm], expected, atol=2e-4)
    assert np.linalg.norm(expected, axis=1).min() > 2e-3


def test_motion_is_zero_when_still(probe, woman, pose, skin_points):
    before, now = (woman.skeleton.transforms(pose(name)) for name in ("standing", "step_forward_right"))
    probe.field.set_pose(now, before)
    x, _ = skin_points(woman.posed(now), 500, 0.003)
    assert np.abs(probe.ask(x)["shift"]).max() > 0.1
    probe.field.set_pose(now, now)
    np.testing.assert_array_equal(probe.ask(x)["shift"], 0)


def test_same_pose_gives_the_same_bits(probe, woman, pose, skin_points):
    first, other = (woman.skeleton.transforms(pose(name)) for name in ("standing", "step_forward_right"))
    x, _ = skin_points(woman.posed(first), COUNT, 0.02)
    probe.field.set_pose(first)
    once = probe.ask(x)
    probe.field.set_pose(other)
    probe.field.set_pose(first)
    again = probe.ask(x)
    for name, values in once.items():
        np.testing.assert_array_equal(values, again[name])


@pytest.mark.parametrize(
    ("radii", "axes"), [([10, 10, 10], [0, 1, 2]), ([10, np.inf, 10], [0, 2]), ([10, np.inf, np.inf], [0])]
)
def test_exact_bodies(one_ball, radii, axes):
    """Sphere, cylinder and slab of half size 0.1 sqrt(1/2) m: +-5 mm to 0.1 mm, anywhere along the infinite axes."""
    body = one_ball(radii)
    probe = Probe(BodyField(body))
    probe.field.set_pose(body.skeleton.transforms(Pose("rest")))
    random = np.random.default_rng(3)
    directions = np.zeros((COUNT, 3))
    directions[:, axes] = random.normal(size=(COUNT, len(axes)))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    distances = random.uniform(-0.005, 0.005, COUNT)
    along = random.uniform(-5, 5, (COUNT, 3))
    along[:, axes] = 0
    got = probe.ask(body.balls.centers + along + (0.1 * np.sqrt(0.5) + distances)[:, None] * directions)
    np.testing.assert_allclose(got["distance"], distances, atol=1e-4)
    np.testing.assert_allclose(got["normal"], directions, atol=1e-6)


def test_turned_cylinder(one_ball):
    """An infinite ball turns with its bone like any other."""
    body = one_ball([10, np.inf, 10])
    probe = Probe(BodyField(body))
    transforms = body.skeleton.transforms(Pose("lying", {"root": rotation_matrix([0, 0, 90])}))
    probe.field.set_pose(transforms)
    center = body.posed(transforms).centers[0]
    got = probe.ask(center + np.array([[4.0, 0.1 * np.sqrt(0.5) + 0.003, 0.0]]))
    np.testing.assert_allclose(got["distance"], 0.003, atol=1e-6)
    np.testing.assert_allclose(got["normal"], [[0, 1, 0]], atol=1e-9)


def test_the_skin_bulges_as_its_hessian_says(posed, skin_points):
    """The greatest curvature is the greater eigenvalue of the Hessian in the tangent plane over the slope."""
    probe, balls = posed
    x, _ = skin_points(balls, COUNT // 4, 0.002)
    found, slope = probe.ask(x)["bulge"], reference.gradient(balls, x)
    steepness = np.linalg.norm(slope, axis=1)
    _, _, axes = np.linalg.svd(slope[:, None, :])
    tangents = axes[:, 1:]
    in_plane = np.einsum("kai,kij,kbj->kab", tangents, reference.hessian(balls, x), tangents)
    exact = np.linalg.eigvalsh(-in_plane)[:, -1] / steepness
    assert np.ptp(exact) > 10
    np.testing.assert_allclose(found, exact, rtol=1e-6, atol=1e-6)
