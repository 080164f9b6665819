from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from taichi_tryon.body.density import density, gap
from taichi_tryon.body.measure import girth
from taichi_tryon.body.skeleton import Pose
from taichi_tryon.dressing.disks import disk_frame, make_disk
from taichi_tryon.dressing.surface import RuledSurface
from taichi_tryon.errors import DressingError


@pytest.fixture
def disk(garment, body):
    def make(name, transforms, dressing="top_9AR", extra=0.0):
        return make_disk(garment(dressing)[2], name, body, transforms, body.posed(transforms), extra)

    return make


def bent_elbow(body):
    turn = Rotation.from_euler("xyz", [0, -60, 0], degrees=True).as_matrix()
    return body.skeleton.transforms(Pose("bent", {"lowerarm_l": turn}))


def test_wrist_disk_turns_rigidly_with_the_forearm(disk, body, transforms):
    rest, bent = transforms("arms_raised_45"), bent_elbow(body)
    a, b = disk("wrist_l", rest), disk("wrist_l", bent)
    motion = bent[body.skeleton.index("lowerarm_l")]
    assert np.allclose(b.normal, motion[:3, :3] @ a.normal, atol=1e-9)
    assert np.allclose(b.start, motion[:3, :3] @ a.start, atol=1e-9)
    assert np.allclose(b.rim, a.rim @ motion[:3, :3].T + motion[:3, 3], atol=3e-3)


def test_elbow_disk_turns_by_half_the_bend(disk, body, transforms):
    a, b = disk("elbow_l", transforms("arms_raised_45")), disk("elbow_l", bent_elbow(body))
    half = Rotation.from_euler("y", -30, degrees=True).as_matrix()
    assert np.allclose(b.normal, half @ a.normal, atol=1e-9)


def test_disks_of_other_bones_stay(disk, body, transforms):
    a, b = disk("bust", transforms("arms_raised_45")), disk("bust", bent_elbow(body))
    assert np.allclose(a.rim, b.rim, atol=1e-6)


def test_rim_is_the_tape_widened_by_the_ease(disk, garment, body, transforms):
    rest = transforms("arms_raised_45")
    spec = garment("top_9AR")[2].disks["waist"]
    made = disk("waist", rest)
    tape = girth(body.posed(rest), made.center, made.normal, body.groups(*spec.groups))
    length = np.linalg.norm(np.diff(made.rim, axis=0), axis=1).sum()
    assert np.isclose(length, tape + 2 * np.pi * spec.ease_cm / 100, atol=3e-3)
    wider = disk("waist", rest, extra=0.003)
    assert np.isclose(np.linalg.norm(np.diff(wider.rim, axis=0), axis=1).sum() - length, 2 * np.pi * 0.003, atol=1e-4)


def test_bodice_starts_at_the_front_and_goes_left(disk, transforms):
    rim = disk("waist", transforms("standing")).rim
    assert np.allclose(rim[[0, -1], 0], 0, atol=2e-3) and np.allclose(rim[0], rim[-1])
    assert rim[0, 2] == rim[:, 2].max() or rim[0, 2] > rim[:, 2].max() - 5e-3
    assert rim[90, 0] > 0.1 and rim[270, 0] < -0.1


def test_sleeves_start_towards_the_body_on_both_sides(disk, transforms):
    for side, sign in (("l", 1), ("r", -1)):
        made = disk(f"elbow_{side}", transforms("standing"))
        assert sign * (made.rim[0, 0] - made.center[0]) < -0.02
        assert sign * (made.rim[180, 0] - made.center[0]) > 0.02


def test_half_disks_share_the_median_plane(disk, transforms):
    left, right = (disk(f"sacrum_{s}", transforms("step_forward_right"), "trousers_9AR") for s in "lr")
    assert np.allclose(left.rim[0], right.rim[-1], atol=1e-9)
    assert np.allclose(left.rim[-1], right.rim[0], atol=1e-9)
    assert left.rim[180, 0] > 0.1 and right.rim[180, 0] < -0.1


def test_rims_keep_off_other_limbs(disk, body, transforms):
    standing = transforms("standing")
    balls = body.posed(standing)
    for name in ("bust", "waist", "elbow_l", "wrist_r"):
        assert gap(balls, disk(name, standing).rim).min() > -2e-3, name


def test_centre_is_in_the_middle_of_the_section_not_on_the_bone(disk, body, transforms):
    made = disk("calf_l", transforms("standing"), "trousers_9AR")
    directions = np.array([made.start, made.left, -made.start, -made.left])
    reach = [next(s for s in np.arange(0, 0.2, 5e-4) if density(body.balls, (made.center + s * d)[None])[0] < 1)
             for d in directions]  # fmt: skip
    assert np.allclose(reach[:2], reach[2:], atol=5e-3)


def test_frame_lies_in_the_disk_plane(disk, garment, body, transforms):
    for pose in ("standing", "arms_raised_45"):
        made = disk("neck_out", transforms(pose))
        point, normal = disk_frame(garment("top_9AR")[2], "neck_out", body, transforms(pose))
        assert np.allclose(normal, made.normal)
        assert np.allclose((made.rim - point) @ normal, 0, atol=1e-9)


def test_unknown_place_names_the_disk(garment, body, transforms):
    spec = garment("top_9AR")[2]
    bad = spec.model_copy(update={"disks": spec.disks | {"bust": spec.disks["bust"].model_copy(update={"at": "gill"})}})
    with pytest.raises(DressingError, match="disk 'bust'.*'gill'"):
        disk_frame(bad, "bust", body, transforms("standing"))


def test_no_section_names_the_disk(garment, body, transforms):
    spec = garment("top_9AR")[2]
    high = spec.disks["bust"].model_copy(update={"offset_cm": [0.0, 90.0, 0.0]})
    bad = spec.model_copy(update={"disks": spec.disks | {"bust": high}})
    rest = transforms("standing")
    with pytest.raises(DressingError, match="disk 'bust'.*section"):
        make_disk(bad, "bust", body, rest, body.posed(rest), 0.0)


def test_ruled_surface_is_equation_6(disk, transforms):
    disks = tuple(disk(name, transforms("arms_raised_45")) for name in ("armhole_l", "elbow_l", "wrist_l"))
    surface = RuledSurface(disks)
    t = np.linspace(0, 1, 7)
    for k in range(3):
        assert np.allclose(surface.point(np.full(7, float(k)), t), disks[k].point(t), atol=1e-12)
    u = 0.3
    expected = (1 - u) * disks[1].point(t) + u * disks[2].point(t)
    assert np.allclose(surface.point(np.full(7, 1 + u), t), expected, atol=1e-12)
