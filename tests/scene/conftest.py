"""A small scene of valid parts, written to a folder: a sphere dressed in a tube."""

from __future__ import annotations

from pathlib import Path

import pytest

BODY = """\
name: sphere
bones:
  root: {parent: null, head_cm: [0, 100, 0]}
groups: [trunk]
balls:
  ball: {center_cm: [0, 100, 0], radii_cm: [20, 20, 20], weight: 2.0, groups: [trunk], bones: {root: 1.0}}
landmarks:
  middle: {bone: root, position_cm: [0, 100, 0]}
"""
POSE = """\
name: turned
rotations_degree:
  root: [0, 30, 0]
"""
PATTERN = """\
pattern: tube
panels:
  sheet:
    edges:
      - {name: hem, line: [[0, 0], [80, 0]]}
      - {name: right, line: [[80, 0], [80, 20]]}
      - {name: top, line: [[80, 20], [0, 20]]}
      - {name: left, line: [[0, 20], [0, 0]]}
seams:
  - {name: side, a: [[sheet, right]], b: [[sheet, left]]}
"""
DRESSING = """\
dressing: tube
disks:
  upper:
    {at: middle, lift_cm: 5, turns_with: root, normal: [0, -1, 0], start: [0, 0, 1], groups: [trunk], ease_cm: 2}
  lower: {at: middle, turns_with: root, normal: [0, -1, 0], start: [0, 0, 1], groups: [trunk], ease_cm: 2}
surfaces: {around: [upper, lower]}
panels:
  sheet: {surface: around, around: [0, 1], top: [top], bottom: [hem]}
"""
FABRIC = """\
fabric: cloth
tensile_warp_gf_per_cm: 2440.0
tensile_weft_gf_per_cm: 2420.0
shear_gf_per_cm_degree: 1.38
bending_warp_gf_cm2_per_cm: 0.147
bending_weft_gf_cm2_per_cm: 0.108
bending_bias_gf_cm2_per_cm: 0.102
weight_gf_per_cm2: 0.029
"""
SCENE = """\
scene: small
body: parts/body.yaml
pose: parts/pose.yaml
garments:
  - name: tube
    pattern: parts/pattern.yaml
    dressing: parts/dressing.yaml
    fabric: parts/fabric.yaml
mesh: {edge_length_mm: 50}
solver:
  step_s: 1e-2
"""


class SceneFolder:
    """A scene with its parts on disk; ``change`` replaces text in one of the files."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.scene = folder / "scene.yaml"
        self.scene.write_text(SCENE)
        (folder / "parts").mkdir()
        parts = {"body": BODY, "pose": POSE, "pattern": PATTERN, "dressing": DRESSING, "fabric": FABRIC}
        for name, text in parts.items():
            (folder / "parts" / f"{name}.yaml").write_text(text)

    def path(self, name: str) -> Path:
        return self.scene if name == "scene" else self.folder / "parts" / f"{name}.yaml"

    def change(self, name: str, old: str, new: str) -> None:
        text = self.path(name).read_text()
        assert old in text
        self.path(name).write_text(text.replace(old, new, 1))


@pytest.fixture
def small(tmp_path: Path) -> SceneFolder:
    return SceneFolder(tmp_path)
