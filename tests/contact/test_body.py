"""Contact and friction: value, force and Hessian belong together, Coulomb's limit holds, springs are cut to it."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.body.absent import AbsentField
from taichi_tryon.body.field import BodyField
from taichi_tryon.contact.body import BodyContact
from taichi_tryon.contact.offset import FIRM, YIELDING
from taichi_tryon.contact.raising import CLEAR, FURTHER, SPARE
from taichi_tryon.contact.samples import Samples

DEPTH = 1e-4


def rough(flat, law, size=3e-5, seed=0):
    """The piece about DEPTH below the contact offset, shaken in all directions: some samples come out of contact."""
    positions = flat(law.thickness - DEPTH)
    return positions + np.random.default_rng(seed).normal(size=positions.shape) * size


def test_all_feel_the_pressure_at_their_depth(felt, flat, law, cloth, pushes):
    for depth in (1e-5, 1e-4, 4e-4, law.thickness, 3 * law.thickness):
        force = felt.at(flat(law.thickness - depth))
        stored, pressure, _ = pushes(depth)[:, 0]
        assert felt.law.pressures() == pytest.approx(pressure, rel=1e-5)
        assert force[:, 1] == pytest.approx(pressure * cloth.vertex_areas, rel=1e-5)
        assert felt.law.energy() == pytest.approx(stored * cloth.areas.sum(), rel=1e-5)


def test_what_is_forced_on_is_given_way_to(felt, flat, law, pushes):
    felt.law.firm(False)
    try:
        felt.at(flat(0.0))
        assert felt.law.pressures() == pytest.approx(pushes(law.thickness, YIELDING)[1].item(), rel=1e-5)
    finally:
        felt.law.firm()
    felt.at(flat(0.0))
    assert felt.law.pressures() == pytest.approx(pushes(law.thickness, FIRM)[1].item(), rel=1e-5)


def test_where_the_skin_bulges_samples_are_held_further_off(felt, flat, law, samples):
    """On the top of the ball, of radius 0.1 m, against the floor."""
    felt.start(flat(1.1 + 0.5 * law.thickness))
    bulge, gap = felt.law.bulge.to_numpy(), felt.law.gap.to_numpy()
    near = gap <= 2 * law.thickness
    assert near.sum() > 5
    assert bulge[near] == pytest.approx(samples.spans[near] / 0.1, rel=1e-3)
    assert felt.law.depth.to_numpy() == pytest.approx(np.maximum(law.thickness + bulge - gap, 0), abs=1e-15)
    felt.start(flat(law.thickness - DEPTH))
    assert felt.law.bulge.to_numpy() == pytest.approx(0, abs=1e-11)


@pytest.fixture
def held(felt, flat):
    """Ends a step where the piece lies level above, or below, the top of the ball; how much further off than by the
    skin's curvature each sample is held from then on. ``felt.law.found`` tells whether it was in the body."""

    def at(height, most=np.inf) -> np.ndarray:
        felt.start(flat(1.1 + height))
        at.inside = felt.law.lift(most)
        felt.law.bind(1, 0.0)
        felt.law.end_step()
        return felt.law.further.to_numpy()

    yield at
    for field in (felt.law.kept, felt.law.further, felt.law.bulge):
        field.fill(0.0)


def test_what_is_found_in_the_body_is_held_further_off(held, felt, law, samples):
    middle = int(np.argmin(felt.law.gap.to_numpy())) if held(-3e-4).any() else -1
    assert felt.law.further.to_numpy()[middle] == pytest.approx(3e-4 + SPARE, abs=1e-6)
    bulge = samples.spans[middle] / 0.1
    assert felt.law.bulge.to_numpy()[middle] == pytest.approx(bulge, rel=1e-2)
    assert felt.law.depth.to_numpy()[middle] == pytest.approx(law.thickness + bulge + 6e-4 + SPARE, rel=1e-2)
    assert held(-3e-4)[middle] == pytest.approx(6e-4 + 2 * SPARE, abs=2e-6)
    assert held(-9e-4)[middle] == FURTHER
    # neither in nor clear of it
    assert held(0.5 * CLEAR)[middle] == FURTHER
    # let down by what it is clear of it, and forgotten off the body
    assert held(3 * CLEAR)[middle] == pytest.approx(FURTHER - 2 * CLEAR, abs=5e-6)
    assert held(0.01).max() == 0


def test_clear_of_the_body_nothing_is_held_further_off(held, felt, law):
    assert held(0.2 * law.thickness).max() == 0 and not held.inside
    assert (felt.law.depth.to_numpy() > 0).any()


@pytest.mark.parametrize(("most", "further"), [(2.9e-4, 0.0), (3.1e-4, 3e-4 + SPARE)])
def test_what_is_deeper_than_is_looked_for_is_not_held_further_off(held, felt, most, further):
    held_off = held(-3e-4, most)
    assert held_off[np.argmin(felt.law.gap.to_numpy())] == pytest.approx(further, abs=1e-6)


@pytest.mark.parametrize(("depth", "said"), [(-1e-5, False), (1e-3, True), (2e-3, False)])
def test_whether_cloth_is_in_the_body_is_told(held, depth, said):
    held(-depth, FURTHER)
    assert (held.inside > 0) == said


def test_what_comes_near_within_a_step_is_raised_as_it_comes(felt, flat, law, samples):
    """And stays so, for the step, where it is raised less or has left the skin in between."""
    felt.start(flat(1.2))
    assert felt.law.bulge.to_numpy().max() == 0.0
    felt.at(flat(1.1 + law.thickness))
    bulge = felt.law.bulge.to_numpy()
    nearest = np.argmin(felt.law.gap.to_numpy())
    assert bulge[nearest] == pytest.approx(samples.spans[nearest] / 0.1, rel=1e-2)
    felt.at(flat(1.2))
    felt.law.bind(1, 0.0)
    assert np.array_equal(felt.law.bulge.to_numpy(), bulge)
    felt.start(flat(1.2))
    assert felt.law.bulge.to_numpy().max() == 0.0


def test_off_the_body_nothing_is_felt(felt, flat, law):
    for height in (1.0001 * law.thickness, 0.01, 0.5):
        assert np.abs(felt.at(flat(height))).max() == 0
        assert felt.law.energy() == 0 and felt.law.pressures().max() == 0
    felt._gather()
    assert np.abs(felt.total.to_numpy()).max() == 0 and np.abs(felt.part.to_numpy()).max() == 0


def test_what_sleeps_feels_what_it_would_feel_awake(felt, flat, law):
    """The piece comes down from 5 cm by fractions of a millimetre, and lifts off again."""
    down = np.arange(0.05, 0.0, -5e-4)
    field, heights = felt.law.body, np.r_[down, law.thickness - DEPTH, down[::-1]]
    felt.start(flat(heights[0]))
    asleep = 0
    for height in heights:
        before = felt.law.seen.to_numpy()
        felt.at(flat(height))
        asleep += (felt.law.seen.to_numpy() == before).all()
        depth, load = felt.law.depth.to_numpy(), felt.law.load.to_numpy()
        felt.law.seen.fill(9.0)
        felt.at(flat(height))
        assert np.array_equal(depth, felt.law.depth.to_numpy()) and np.array_equal(load, felt.law.load.to_numpy())
    assert field.travelled == 0.0
    assert asleep > 0.5 * len(heights)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_force_is_minus_the_gradient_of_the_energy(felt, flat, law, friction):
    """With friction's stiffness and limit held, as within a Newton iteration."""
    start = rough(flat, law)
    felt.start(start)
    felt.law.friction[None] = friction
    felt.at(start + [2e-6, 0, 1e-6])
    felt.law.bind(0, 0.0)
    by_force, by_energy = felt.slopes(start + [3e-6, -1e-6, 0], 1e-8)
    assert by_force == pytest.approx(by_energy, rel=1e-5)


def test_force_on_a_ball_is_minus_the_gradient_of_the_energy(felt, flat, law):
    positions = flat(1.1 + law.thickness - 2e-4)  # its middle touches the top of the ball
    positions += np.random.default_rng(2).normal(size=positions.shape) * 2e-5
    felt.start(positions)
    felt.law.friction[None] = 0.0
    felt.law.bind(0, 0.0)
    felt.at(positions)
    assert 0 < (felt.law.pressures() > 0).mean() < 1
    by_force, by_energy = felt.slopes(positions, 1e-7, seed=3)
    # the gap is found by Newton's method to 3 um at worst, here far better
    assert by_force == pytest.approx(by_energy, rel=1e-3)


def test_hessian_is_minus_the_derivative_of_the_force(felt, flat, law, samples, cloth):
    start = rough(flat, law)
    felt.start(start)
    felt.at(start + [2e-6, 0, 1e-6])
    felt.law.bind(0, 0.0)
    felt.at(start)
    parts, total, own = felt.part.to_numpy(), felt.total.to_numpy(), felt.own.to_numpy()
    dense = np.zeros((cloth.vertex_count, 3, cloth.vertex_count, 3))
    for s, ids in enumerate(samples.vertices):
        for a in range(3):
            for b in range(3):
                dense[ids[a], :, ids[b], :] += parts[s, a, b]
    size = np.abs(dense).max()
    assert dense.sum(axis=2) == pytest.approx(total, abs=1e-12 * size)
    assert np.einsum("iaib->iab", dense) == pytest.approx(own, abs=1e-12 * size)
    for seed in range(4):
        direction, eps = np.random.default_rng(seed).normal(size=start.shape), 1e-8
        slope = (felt.at(start + eps * direction) - felt.at(start - eps * direction)) / (2 * eps)
        assert np.einsum("iajb,jb->ia", dense, direction) == pytest.approx(-slope, abs=1e-5 * size)


def tangential(felt, positions):
    """Tangential force on the whole piece, and the normal one, after the secant is set there."""
    felt.at(positions)
    felt.law.bind(0, 0.0)
    total = felt.at(positions).sum(axis=0)
    return np.hypot(total[0], total[2]), total[1]


def farthest(law, pushes) -> float:
    """Where the spring, as stiff as the contact, reaches mu times the pressure [m]."""
    _, pressure, steepness = pushes(DEPTH)[:, 0]
    return law.friction * pressure / steepness


def test_friction_sticks_up_to_mu_and_no_further(felt, flat, law, pushes):
    level, most = flat(law.thickness - DEPTH), farthest(law, pushes)
    for share in (0.25, 0.5, 0.99):
        felt.start(level)
        force, load = tangential(felt, level + [share * most, 0, 0])
        assert force == pytest.approx(share * law.friction * load, rel=1e-5)
    for share in (1.01, 3.0, 1000.0):
        felt.start(level)
        force, load = tangential(felt, level + [0, 0, share * most])
        assert force == pytest.approx(law.friction * load, rel=1e-6)


def test_without_friction_nothing_holds(felt, flat, law):
    level = flat(law.thickness - DEPTH)
    felt.start(level)
    felt.at(level)
    assert felt.total.to_numpy()[:, 0, 0].min() > 0
    felt.law.friction[None] = 0.0
    felt.law.bind(0, 0.0)
    felt.at(level)
    hessian = felt.total.to_numpy()
    assert np.abs(hessian[:, 0, 0]).max() < 1e-9 * hessian[:, 1, 1].min()
    assert tangential(felt, level + [1e-6, 0, 0])[0] == 0


def stiffnesses(felt, positions) -> np.ndarray:
    """Stiffness of the whole piece along x, y and z over that of the normal contact."""
    felt.at(positions)
    hessian = felt.total.to_numpy().sum(axis=0)
    return np.diag(hessian) / hessian[1, 1]


def test_whether_it_slips_is_judged_ahead_along_the_velocity(felt, flat, law):
    """What slips gives way along its path and holds across it."""
    level = flat(law.thickness - DEPTH)
    felt.start(level)
    felt.v.from_numpy(np.tile([0.1, 0, 0], (len(level), 1)))
    felt.law.bind(1, 0.0)
    assert stiffnesses(felt, level + [1e-7, 0, 0]) == pytest.approx(1, rel=1e-3)
    felt.law.bind(1, 0.01)
    assert stiffnesses(felt, level + [1e-7, 0, 0]) == pytest.approx([0.02, 1, 1], rel=1e-3)


def test_what_slipped_is_taken_to_slip_on_in_the_next_step(felt, flat, law):
    level = flat(law.thickness - DEPTH)
    felt.start(level)
    beyond = level + [law.friction * DEPTH, 0, 0]
    tangential(felt, beyond)
    felt.law.end_step()
    felt.x_start.from_numpy(beyond)
    felt.at(beyond)
    felt.law.bind(1, 0.0)
    assert stiffnesses(felt, beyond)[0] == pytest.approx(0.02, rel=1e-3)
    # turning back it sticks from the second look on
    felt.at(beyond - [1e-6, 0, 0])
    felt.law.bind(0, 0.0)
    assert stiffnesses(felt, beyond - [1e-6, 0, 0])[0] == pytest.approx(1, rel=1e-3)


def test_springs_are_cut_at_the_end_of_a_step(felt, flat, law, pushes):
    level, most = flat(law.thickness - DEPTH), farthest(law, pushes)
    for share, kept in ((0.5, 0.5), (7.0, 1.0)):
        felt.start(level)
        moved = level + [0.6 * share * most, 0, 0.8 * share * most]
        felt.at(moved)
        felt.law.end_step()
        slip = felt.law.slip.to_numpy()
        assert slip == pytest.approx(np.tile([0.6 * kept * most, 0, 0.8 * kept * most], (len(slip), 1)), rel=1e-5)
        # the spring pulls on in the next step, which starts here
        felt.x_start.from_numpy(moved)
        force, load = tangential(felt, moved)
        assert force == pytest.approx(kept * law.friction * load, rel=1e-5)


def test_what_leaves_the_body_forgets_its_spring(felt, flat, law):
    level = flat(law.thickness - DEPTH)
    felt.start(level)
    felt.at(level + [1e-6, 0, 0])
    felt.law.end_step()
    assert np.abs(felt.law.slip.to_numpy()).max() > 0
    felt.at(flat(0.01))
    felt.law.end_step()
    assert np.abs(felt.law.slip.to_numpy()).max() == 0


def test_the_bodys_own_motion_is_no_slip(felt, flat, law, floor_and_ball_field):
    """A floor that has moved by 1 mm under cloth that moved with it stretches no spring."""
    level, now = flat(law.thickness - DEPTH), np.eye(4)[None].copy()
    now[0, 0, 3] = 1e-3
    try:
        felt.start(level)
        floor_and_ball_field.set_pose(now, np.eye(4)[None])
        assert tangential(felt, level + [1e-3, 0, 0])[0] < 1e-9
        force, load = tangential(felt, level)
        assert force == pytest.approx(law.friction * load, rel=1e-6)
    finally:
        floor_and_ball_field.set_pose(np.eye(4)[None])


def test_what_stands_still_is_not_looked_at_again(felt, flat, law, pushes, floor_and_ball_field):
    """Until it, or the body, moves: then the body is asked where it is now."""
    low, higher, now = flat(law.thickness - DEPTH), flat(law.thickness - 0.5 * DEPTH), np.eye(4)[None].copy()
    now[0, 1, 3] = -0.5 * DEPTH
    count, looks = felt.law.count, []

    def force(positions):
        looked = felt.law.looked.to_numpy().sum()
        found = felt.at(positions)
        looks.append(felt.law.looked.to_numpy().sum() - looked)
        return found

    felt.start(low)
    once, again, up = force(low), force(low), force(higher)
    try:
        floor_and_ball_field.set_pose(now)
        down = force(higher)
    finally:
        floor_and_ball_field.set_pose(np.eye(4)[None])
    assert looks == [0, 0, count, count]
    deeper, shallower = pushes([DEPTH, 0.5 * DEPTH])[1]
    assert np.array_equal(once, again)
    assert once[:, 1].sum() == pytest.approx(deeper / shallower * up[:, 1].sum(), rel=1e-4)
    # the floor has sunk by as much as the cloth: nothing but the one's rise is left between them
    assert down.shape == up.shape and np.abs(down).max() < 1e-3 * np.abs(up).max()


@pytest.mark.parametrize("friction, sleeps", [(0.3, False), (0.0, True)])
def test_with_and_without_skips_the_force_is_the_same(
    make_felt, floor_and_ball_field, felt, flat, law, friction, sleeps
):
    """Looked at even where it sleeps; and with no friction where a coefficient of 0 holds nothing."""
    other = make_felt(floor_and_ball_field, friction, sleeps)
    for one in (felt, other):
        one.start(flat(0.02))
        one.law.friction[None] = friction
    for height in (0.02, 0.019, 0.01, law.thickness - DEPTH, law.thickness - 2 * DEPTH, 0.02):
        positions = flat(height) + [1e-4, 0, 0]
        assert np.array_equal(felt.at(positions), other.at(positions))
        assert felt.law.energy() == other.law.energy()
        assert np.array_equal(felt.law.until.to_numpy(), other.law.until.to_numpy())
    asleep = other.law.evaluations * other.law.count - other.law.looked.to_numpy().sum()
    assert asleep > 0 if sleeps else asleep == 0


def test_a_body_is_told_where_it_is_asked(make_felt, floor_and_ball, flat, law):
    """The ball a metre up is out of reach until the cloth has come there."""
    field = BodyField(floor_and_ball, everywhere=False)
    felt = make_felt(field)
    low, high = flat(law.thickness - DEPTH), flat(1.1 + law.thickness - 2e-4)
    felt.x.from_numpy(low)
    felt.law.cover()
    field.set_pose(np.eye(4)[None])
    felt.start(low)
    assert field.near.tolist() == [True, False] and felt.law.pressures().min() > 0
    felt.start(high)
    assert field.near.tolist() == [True, True] and felt.law.pressures().max() > 0
    assert field.placed == 1 and field.travelled == 0.0


def test_without_a_body_nothing_is_felt(cloth, flat):
    nv = cloth.vertex_count
    x, x_start, v = (ti.Vector.field(3, float, shape=nv) for _ in range(3))
    law = BodyContact(Samples.none(), AbsentField(), x, x_start, v, stiffness=1e7, thickness=5e-4, friction=0.3)
    x.from_numpy(flat(-0.1))
    felt, room = np.ones((nv, 3)), np.zeros(nv)

    @ti.kernel
    def ask(felt: ti.types.ndarray(), room: ti.types.ndarray()):
        for i in range(nv):
            total, own = law.row_sum(i)
            feels = law.force(i)
            for k in range(3):
                felt[i, k] = feels[k] + total[k, k] + own[k, k]
            room[i] = law.room(i, 0.0)

    law.evaluate()
    law.bind(1, 0.01)
    law.end_step()
    ask(felt, room)
    assert not felt.any() and np.isinf(room).all()
    assert law.energy() == 0.0 and len(law.pressures()) == 0
