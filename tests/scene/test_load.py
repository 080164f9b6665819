"""Every kind of fault, with its file, line, column and field; references; values set from the command line."""

import re
import time
from pathlib import Path

import pytest

from taichi_tryon.errors import InputError
from taichi_tryon.scene import references
from taichi_tryon.scene.load import load_body_and_pose, load_scene
from taichi_tryon.scene.yaml_source import read_yaml

CONFIGS = Path(__file__).parents[2] / "configs"


def faults(small, *overrides):
    """The fault lines, with the test's folder left out."""
    with pytest.raises(InputError) as caught:
        load_scene(small.scene, overrides)
    return [line.replace(f"{small.folder}/", "") for line in caught.value.faults]


def test_valid_scene(small):
    scene = load_scene(small.scene)
    assert scene.scene == "small"
    assert scene.garments[0].fabric.weight_gf_per_cm2 == 0.029
    assert scene.body.balls["ball"].radii_cm == [20, 20, 20]
    assert scene.solver.step_s == 0.01
    assert scene.solver.precision == "f64"


@pytest.mark.parametrize(
    ("name", "old", "new", "line"),
    [
        (
            "scene",
            "edge_length_mm: 50",
            "edge_length_cm: 5",
            "scene.yaml:9:8: mesh.edge_length_cm: unknown key; did you mean edge_length_mm?",
        ),
        ("scene", "mesh:", "zzz: 1\nmesh:", "scene.yaml:9:1: zzz: unknown key; allowed here: scene, body, pose"),
        ("scene", "50", "0.1", "scene.yaml:9:24: mesh.edge_length_mm: must be greater than or equal to 1 (got 0.1)"),
        (
            "scene",
            "50",
            "5 cm",
            'scene.yaml:9:24: mesh.edge_length_mm: must be a plain number; its unit is in the key\'s name (got "5 cm")',
        ),
        ("scene", "50", ".nan", "scene.yaml:9:24: mesh.edge_length_mm: must be a finite number (got NaN)"),
        ("scene", "50", "1e999", "scene.yaml:9:24: mesh.edge_length_mm: must be a finite number (got Infinity)"),
        ("scene", "50", "true", "scene.yaml:9:24: mesh.edge_length_mm: must be a plain number"),
        (
            "scene",
            "50",
            "'50'",
            'scene.yaml:9:24: mesh.edge_length_mm: must be a plain number; its unit is in the key\'s name (got "50")',
        ),
        (
            "scene",
            "{edge_length_mm: 50}",
            "[50]",
            "scene.yaml:9:7: mesh: must be a mapping of keys to values (got [50])",
        ),
        (
            "scene",
            "1e-2",
            "1e-2\n  precision: f16",
            "scene.yaml:12:14: solver.precision: must be 'f64' or 'f32' (got \"f16\")",
        ),
        (
            "scene",
            "1e-2",
            "1e-2\n  min_step_s: 0.05",
            "scene.yaml:12:15: solver.min_step_s: must not exceed step_s = 0.01 (got 0.05)",
        ),
        ("scene", "1e-2", "1e-2\n  threads: 1.5", "scene.yaml:12:12: solver.threads: must be a whole number (got 1.5)"),
        ("scene", "scene: small", "scene: ../up", "scene.yaml:1:8: scene: "),
        ("scene", "scene: small\n", "", "scene.yaml:1:1: scene: this key is required (name of the scene)"),
        (
            "scene",
            "    pattern: parts/pattern.yaml\n",
            "",
            "scene.yaml:5:5: garments.0.pattern: this key is required (the sewing pattern)",
        ),
        (
            "scene",
            "mesh:",
            "output: {image_size: [100, 101]}\nmesh:",
            "scene.yaml:9:28: output.image_size.1: must be an even number, as films want (got 101)",
        ),
        (
            "scene",
            "mesh:",
            "output: {views: [front, below]}\nmesh:",
            "scene.yaml:9:25: output.views.1: must be 'front'",
        ),
        (
            "scene",
            "mesh:",
            "output: {views: [front, front]}\nmesh:",
            "scene.yaml:9:25: output.views.1: front is named twice",
        ),
        (
            "scene",
            "mesh:",
            "gravity_m_s2: [0, -9.81]\nmesh:",
            "scene.yaml:9:15: gravity_m_s2: List should have at least 3",
        ),
        (
            "scene",
            "parts/pose.yaml",
            "parts/pos.yaml",
            "scene.yaml:3:7: pose: no such file: parts/pos.yaml; did you mean pose.yaml?",
        ),
        ("scene", "parts/pose.yaml", "parts", "scene.yaml:3:7: pose: not a file: parts"),
        ("scene", "parts/pose.yaml", "3", "scene.yaml:3:7: pose: must be a mapping, or the path of a file"),
        (
            "fabric",
            "2440.0",
            "-2440.0",
            "parts/fabric.yaml:2:25: tensile_warp_gf_per_cm: must be greater than or equal to 0.001 (got -2440.0)",
        ),
        ("fabric", "0.102", "0.01", "parts/fabric.yaml:7:29: bending_bias_gf_cm2_per_cm: the fabric would have no"),
        (
            "fabric",
            "weight_gf_per_cm2: 0.029\n",
            "",
            "parts/fabric.yaml:1:1: weight_gf_per_cm2: this key is required (",
        ),
        (
            "fabric",
            "fabric: cloth\n",
            "fabric: cloth\nfabric: silk\n",
            "parts/fabric.yaml:2:1: fabric: this key stood before at parts/fabric.yaml:1:1",
        ),
        (
            "body",
            "radii_cm: [20",
            "radii_cm: [-20",
            "parts/body.yaml:6:45: balls.ball.radii_cm.0: must be greater than or equal to 0.01",
        ),
        ("body", "groups: [trunk], b", "groups: [leg], b", "parts/body.yaml:6:79: balls.ball.groups: no group 'leg'"),
        ("body", "name: sphere", "", "parts/body.yaml:2:1: name: this key is required"),
        ("pose", "root", "elbow", "parts/pose.yaml:3:10: rotations_degree.elbow: elbow is not a bone of body sphere"),
        (
            "dressing",
            "{surface",
            "{ring",
            "parts/dressing.yaml:8:11: panels.sheet.ring: unknown key; allowed here: surface",
        ),
        (
            "dressing",
            "at: middle",
            "at: navel",
            "parts/dressing.yaml:4:10: disks.upper.at: navel is not a landmark or bone",
        ),
        ("dressing", "sheet", "shirt", "parts/dressing.yaml:8:10: panels.shirt: shirt is not a panel of pattern tube"),
        ("pattern", "[80, 0]]}", "[80]]}", "parts/pattern.yaml:5:36: panels.sheet.edges.0.line.1: a point is a name"),
        ("pattern", "[sheet, left]", "[sheet, lft]", "parts/pattern.yaml:10:43: seams.0.b.0: "),
    ],
)
def test_fault(small, name, old, new, line):
    small.change(name, old, new)
    found = faults(small)
    assert any(fault.startswith(line) for fault in found), found


def test_all_faults_of_all_files_at_once(small):
    small.change("scene", "50", "0")
    small.change("scene", "parts/pose.yaml", "absent.yaml")
    small.change("fabric", "2440.0", "-1")
    small.change("fabric", "0.029", "heavy")
    small.change("body", "weight: 2.0", "wieght: 2.0")
    places = [re.match(r"[\w/.]+:\d+", fault).group() for fault in faults(small)]
    assert sorted(places) == [
        "parts/body.yaml:6",
        "parts/body.yaml:6",
        "parts/fabric.yaml:2",
        "parts/fabric.yaml:8",
        "scene.yaml:3",
        "scene.yaml:9",
    ]


def test_a_file_used_twice_has_its_faults_once(small):
    text = small.scene.read_text()
    garment = text[text.index("  - name") : text.index("mesh:")]
    small.change("scene", "mesh:", garment.replace("tube", "second") + "mesh:")
    assert len(load_scene(small.scene).garments) == 2
    small.change("fabric", "2440.0", "-1")
    assert len(faults(small)) == 1


def test_two_garments_of_one_name(small):
    text = small.scene.read_text()
    small.change("scene", "mesh:", text[text.index("  - name") : text.index("mesh:")] + "mesh:")
    assert faults(small) == ["scene.yaml:9:11: garments.1.name: tube: an earlier garment has this name"]


def test_a_part_can_stand_inline(small):
    fabric = "".join(f"      {line}\n" for line in small.path("fabric").read_text().splitlines())
    small.change("scene", "    fabric: parts/fabric.yaml\n", f"    fabric:\n{fabric}")
    assert load_scene(small.scene).garments[0].fabric.fabric == "cloth"
    small.change("scene", "2440.0", "0")
    assert faults(small) == [
        "scene.yaml:10:31: garments.0.fabric.tensile_warp_gf_per_cm: must be greater than or equal to 0.001 (got 0)"
    ]


def test_no_garments(small):
    text = small.scene.read_text()
    small.scene.write_text(text[: text.index("garments:")] + "garments: []\n")
    assert faults(small)[0].startswith("scene.yaml:4:11: garments: List should have at least 1 item")


def test_scene_that_is_no_mapping(small):
    small.scene.write_text("- 1\n")
    assert faults(small) == ["scene.yaml:1:1: must be a mapping of keys to values (got [1])"]


class TestOverrides:
    def test_in_a_referenced_file(self, small):
        scene = load_scene(small.scene, ["garments.0.fabric.weight_gf_per_cm2=0.02", "mesh.edge_length_mm=1e1"])
        assert scene.garments[0].fabric.weight_gf_per_cm2 == 0.02
        assert scene.mesh.edge_length_mm == 10

    def test_in_a_mapping_that_the_scene_leaves_out(self, small):
        assert load_scene(small.scene, ["settle.residual=0.5"]).settle.residual == 0.5

    def test_a_list(self, small):
        assert load_scene(small.scene, ["output.views=[top, back]"]).output.views == ["top", "back"]

    def test_a_reference_starts_at_the_working_directory(self, small, monkeypatch):
        monkeypatch.chdir(small.folder / "parts")
        Path("other.yaml").write_text(Path("fabric.yaml").read_text().replace("cloth", "other"))
        small.change("scene", "parts/fabric.yaml", "absent.yaml")
        overrides = ["garments.0.fabric=other.yaml", "garments.0.fabric.poisson=0.1"]
        fabric = load_scene(small.scene, overrides).garments[0].fabric
        assert (fabric.fabric, fabric.poisson) == ("other", 0.1)

    def test_does_not_reach_what_an_alias_shares(self, small):
        text = small.scene.read_text()
        garment = text[text.index("  - name") : text.index("mesh:")]
        small.change(
            "scene",
            garment,
            garment
            + "    appearance: &look {color: '#000000'}\n"
            + garment.replace("name: tube", "name: second")
            + "    appearance: *look\n",
        )
        first, second = load_scene(small.scene, ["garments.0.appearance.color='#ffffff'"]).garments
        assert (first.appearance.color, second.appearance.color) == ("#ffffff", "#000000")

    @pytest.mark.parametrize(
        ("override", "line"),
        [
            ("mesh.edge_length_mm=small", "mesh.edge_length_mm: must be a plain number"),
            ("mesh.edge_length_mm=", "mesh.edge_length_mm: must be a plain number"),
            ("mesh.edge_mm=3", "mesh.edge_mm: unknown key; did you mean edge_length_mm?"),
            ("meesh.edge=3", "meesh: unknown key; did you mean mesh?"),
            ("garments.1.name=x", "garments: a list of 1, counted from 0, has no entry 1"),
            ("garments.first.name=x", "garments: a list of 1, counted from 0, has no entry first"),
            ("scene.name=x", "scene: has no key name: it is 'small'"),
            ("garments.0.fabric=absent.yaml", "garments.0.fabric: no such file: absent.yaml"),
            (
                "garments.0.fabric.weight_gf_per_cm2=-1",
                "weight_gf_per_cm2: must be greater than",
            ),
            ("mesh={edge", "not valid YAML"),
            ("mesh", "write KEY.PATH=VALUE"),
            (".mesh=1", "write KEY.PATH=VALUE"),
        ],
    )
    def test_fault(self, small, override, line):
        [fault] = faults(small, override)
        assert fault.startswith(f"--set {override}: ") and line in fault


def test_pose_of_another_body(small):
    small.change("pose", "root", "elbow")
    with pytest.raises(InputError, match="pose.yaml:3:10: rotations_degree.elbow: elbow is not a bone of body sphere"):
        load_body_and_pose(small.path("body"), small.path("pose"))


@pytest.mark.parametrize("path", sorted((CONFIGS / "scenes").glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_scene(path):
    start = time.perf_counter()
    assert load_scene(path).scene == path.stem
    assert time.perf_counter() - start < 3  # about 0.3 s on an idle core


def test_a_list_that_is_too_long_is_refused_before_its_files_are_read(small, monkeypatch):
    """A scene of a thousand garments: half a minute of reading the same files."""
    read = []
    monkeypatch.setattr(references, "read_yaml", lambda path: read.append(path) or read_yaml(path))
    load_scene(small.scene)
    each = len(read)
    text = small.scene.read_text()
    start, end = text.index("  - "), text.index("\nmesh:") + 1
    small.scene.write_text(text[:start] + text[start:end] * 1000 + text[end:])
    (line,) = faults(small)
    assert line.startswith("scene.yaml:") and "garments: List should have at most 10 items" in line
    assert each <= len(read) - each <= 10 * each
