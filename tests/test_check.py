"""``check``: sizes that agree with the fabric and the pattern, and no simulation."""

from __future__ import annotations

import re

import pytest

from taichi_tryon.check import check_scene
from taichi_tryon.errors import DressingError
from taichi_tryon.scene.models import SceneSpec


def test_sizes_frames_and_skips(make_cone_scene):
    cone_scene = make_cone_scene()
    lines = check_scene(SceneSpec.model_validate(cone_scene))
    assert lines[0] == "cone: ball, still"
    mesh = re.fullmatch(
        r"mesh: (\d+) vertices, (\d+) triangles, mean edge (\d+\.\d) mm \(30 asked for\), least angle (\S+) degrees",
        lines[1],
    )
    assert 25 < float(mesh[3]) < 35 and float(mesh[4]) > 20
    garment = re.fullmatch(r"garment cone: 2 panels, (\d+) vertices, (\d+) triangles, (\S+) m2, (\d+) g", lines[2])
    assert garment.groups()[:2] == mesh.groups()[:2]
    # two sectors of 127 degrees of a ring of 13.5 to 25.5 cm, in a fabric of 0.29 kg/m2 (0.029 gf/cm2)
    area = 2 * 127 / 360 * 3.14159 * (0.255**2 - 0.135**2)
    assert float(garment[3]) == pytest.approx(area, rel=0.01)
    assert float(garment[4]) == pytest.approx(290 * area, rel=0.02)
    assert re.fullmatch(r"  hem: \d+ vertices on disk lower, -?\d+\.\d to -?\d+\.\d mm from its plane", lines[3])
    assert "frames: about 5 for 0.1 s of drape and motion, and some while dressing" in lines
    assert "skipped: pictures: output.images asks for none" in lines
    assert "skipped: film: output.video asks for none" in lines
    assert not [line for line in lines if line.startswith("skipped: friction")]
    assert "skipped: motion of the body: the scene has no motion: the body is posed once" in lines
    assert "skipped: far contact samples: samples far off sleep until they, or the body, could have come near" in lines


def test_frames_of_a_motion_and_of_steps_longer_than_frames(make_cone_scene):
    cone_scene = make_cone_scene()
    cone_scene["motion"] = [{"pose": {"name": "still"}, "duration_s": 1.9}]
    cone_scene["output"] |= {"frames_per_s": 1000.0}
    cone_scene["solver"] = {"step_s": 0.01}
    cone_scene["contact"] = {"friction": 0.0}
    lines = check_scene(SceneSpec.model_validate(cone_scene))
    assert lines[0] == "cone: ball, still to still"
    assert "frames: about 202 for 2 s of drape and motion, and some while dressing" in lines
    assert "skipped: friction: contact.friction is 0" in lines
    assert not [line for line in lines if "motion of the body" in line]


def test_what_cannot_be_put_on(make_cone_scene):
    cone_scene = make_cone_scene()
    cone_scene["garments"][0]["dressing"]["disks"]["lower"]["offset_cm"] = [0, 8, 0]
    with pytest.raises(DressingError, match="disk 'lower': groups trunk have no section there"):
        check_scene(SceneSpec.model_validate(cone_scene))


def test_layers_that_cross_at_the_start_are_refused(make_cone_scene):
    fabric = make_cone_scene()["garments"][0]["fabric"]

    def scene(height_cm, layers, x_degree=90, z_cm=0.0):
        sheets = [
            {
                "name": name,
                "sheet": {"size_cm": [10, 10], "rotation_degree": turn, "origin_cm": origin},
                "fabric": fabric,
            }
            for name, turn, origin in (
                ("low", [0, 0, 0], [0, 0, 0]),
                ("cut", [x_degree, 0, 0], [0.7, height_cm, -5 * x_degree / 90 + z_cm]),
            )
        ]
        return SceneSpec.model_validate({"scene": "two", "garments": sheets, "contact": {"layers": layers}})

    with pytest.raises(DressingError, match=r"\d+ pairs of triangles cross at the start.*low.*cut.* cm; move the"):
        check_scene(scene(5.0, {}))
    # in one plane, where nothing says which is the upper one; and half a thickness apart
    with pytest.raises(DressingError, match=r"\d+ vertices touch other cloth at the start.*low.* at \[.*\] cm"):
        check_scene(scene(5.0, {}, x_degree=0))
    assert not [line for line in check_scene(scene(5.0, {}, 0, 0.05)) if "contact of cloth with cloth" in line]
    assert "skipped: contact of cloth with cloth: contact.layers does not ask for it" in check_scene(scene(5.0, None))
    assert not [line for line in check_scene(scene(-5.0, {})) if "contact of cloth with cloth" in line]


def test_poses_beyond_the_joints_ranges_are_told_once_each(make_cone_scene):
    cone_scene = make_cone_scene()
    cone_scene["body"]["bones"]["root"]["range_degree"] = {"y": [-10, 20]}
    turned = {"name": "turned", "rotations_degree": {"root": [0, 25, 0]}}
    cone_scene["motion"] = [{"pose": turned, "duration_s": 1.0}, {"pose": turned, "duration_s": 1.0}]
    lines = check_scene(SceneSpec.model_validate(cone_scene))
    assert [line for line in lines if line.startswith("note")] == [
        "note: pose turned: root is turned by 25 degrees about y, beyond its range of -10 to 20 (range_degree of body "
        "ball)"
    ]
