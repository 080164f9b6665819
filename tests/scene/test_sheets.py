"""Scenes of plain sheets: without a body, and what such a scene cannot have."""

import pytest

from taichi_tryon.errors import InputError
from taichi_tryon.scene.load import load_scene
from taichi_tryon.scene.resolved import to_yaml

SCENE = """\
scene: strip
garments:
  - name: strip
    sheet: {size_cm: [10, 5]}
    fabric: parts/fabric.yaml
    holds:
      left: {edge: left}
"""


@pytest.fixture
def strip(small):
    small.scene.write_text(SCENE)
    return small


def test_a_sheet_needs_no_body(strip):
    scene = load_scene(strip.scene)
    assert scene.body is None and scene.pose is None and scene.garments[0].dressing is None
    strip.scene.write_text(to_yaml(scene))
    assert load_scene(strip.scene) == scene


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        (
            "size_cm: [10, 5]",
            "size_cm: [10, 5], diameter_cm: 3",
            "scene.yaml:4:12: garments.0.sheet: give one of size_cm, diameter_cm, outline_cm (got size_cm, ",
        ),
        (
            "size_cm: [10, 5]",
            "diameter_cm: 30, mesh: regular",
            "scene.yaml:4:36: garments.0.sheet.mesh: needs a rectangle, size_cm (got diameter_cm)",
        ),
        (
            "size_cm: [10, 5]",
            "diameter_cm: 18, inner_diameter_cm: 30",
            "scene.yaml:4:49: garments.0.sheet.inner_diameter_cm: must lie within a disk, diameter_cm",
        ),
        (
            "size_cm: [10, 5]",
            "size_cm: [10, 5], tube_radius_cm: 3, waves: {height_mm: 1, length_cm: 3}",
            "scene.yaml:4:57: garments.0.sheet.waves: a tube is no plane to start off from",
        ),
        (
            "size_cm: [10, 5]",
            "size_cm: [10, 5], waves: {height_mm: 1, folds: 3}",
            "scene.yaml:4:38: garments.0.sheet.waves: folds need a disk, diameter_cm",
        ),
        (
            "garments:",
            "mesh: {edge_length_mm: 4}\ncontact: {layers: {thickness_mm: 3}}\ngarments:",
            "contact.layers: thickness_mm must not exceed half of mesh.edge_length_mm, 2 (got 3)",
        ),
        (
            "[10, 5]",
            "[10, -5]",
            "scene.yaml:4:27: garments.0.sheet.size_cm.1: must be greater than or equal to 0.01 (got -5)",
        ),
        (
            "{edge: left}",
            "{}",
            "scene.yaml:7:13: garments.0.holds.left: give one of points_cm, edge, area_cm, disk_cm (got none)",
        ),
        (
            "{edge: left}",
            "{edge: left, axes: [up]}",
            "scene.yaml:7:33: garments.0.holds.left.axes.0: must be 'x', 'y' or 'z' (got \"up\")",
        ),
        (
            "    sheet:",
            "    dressing: parts/dressing.yaml\n    sheet:",
            "scene.yaml:5:12: garments.0.sheet: a plain sheet has no dressing",
        ),
        (
            "    sheet: {size_cm: [10, 5]}\n",
            "    pattern: parts/pattern.yaml\n",
            "scene.yaml:3:5: garments.0.dressing: this key is required (how the panels are laid around the body)",
        ),
        (
            "    sheet: {size_cm: [10, 5]}\n",
            "    pattern: parts/pattern.yaml\n    dressing: parts/dressing.yaml\n",
            "scene.yaml:1:1: body: this key is required (who is dressed in strip)",
        ),
        ("garments:", "pose: parts/pose.yaml\ngarments:", ": a scene without a body has no pose"),
        (
            "garments:",
            "output: {body_pressure: true}\ngarments:",
            "output.body_pressure: a scene without a body has no pressure on it",
        ),
        (
            "fabric: parts",
            "bands: [{name: b, edges: [[sheet, to]], stiffness_N: 1}]\n    fabric: parts",
            "garments.0.bands.0.edges.0: to is not an edge of this sheet; allowed: bottom, right, top, left",
        ),
        ("fabric: parts", "open: [{seam: side}]\n    fabric: parts", "garments.0.open: a plain sheet has no closures"),
        ("garments:", "output: {maps: [shear, gap]}\ngarments:", "maps.1: a scene without a body has no gap"),
    ],
)
def test_faults(strip, old, new, line):
    strip.change("scene", old, new)
    with pytest.raises(InputError) as caught:
        load_scene(strip.scene)
    found = [fault.replace(f"{strip.folder}/", "") for fault in caught.value.faults]
    assert len(found) == 1 and line in found[0], found


def test_names_of_holds_are_the_scenes_own(strip):
    second = SCENE.split("garments:\n")[1].replace("name: strip", "name: other")
    strip.scene.write_text(SCENE + second)
    with pytest.raises(InputError, match="garments.1.holds.left: left: a hold of an earlier garment has this name"):
        load_scene(strip.scene)
