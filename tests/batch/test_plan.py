"""The drapes of a batch: names that stay, and every fault before anything runs."""

import json

import pytest

from taichi_tryon.batch.plan import plan
from taichi_tryon.errors import InputError
from taichi_tryon.scene.load import load_scene
from taichi_tryon.scene.resolved import to_yaml
from taichi_tryon.scene.sweep import spread


@pytest.fixture
def scene(tmp_path, make_cone_scene):
    path = tmp_path / "cone.yaml"
    path.write_text(json.dumps(make_cone_scene()))
    return path


def test_each_scene_with_each_variant(scene, tmp_path):
    drapes = plan([scene], spread(["mesh.edge_length_mm=[20, 30]", "gravity_m_s2=[[0, -9.81, 0], [0, 0, 0]]"]))
    assert [drape.name.rpartition("_")[0] for drape in drapes] == [
        "cone_edge_length_mm=20_gravity_m_s2=0,-9.81,0",
        "cone_edge_length_mm=20_gravity_m_s2=0,0,0",
        "cone_edge_length_mm=30_gravity_m_s2=0,-9.81,0",
        "cone_edge_length_mm=30_gravity_m_s2=0,0,0",
    ]
    (tmp_path / "again.yaml").write_text(drapes[1].text)
    again = load_scene(tmp_path / "again.yaml")
    assert (again.mesh.edge_length_mm, again.gravity_m_s2) == (20, [0, 0, 0])
    assert to_yaml(again) == drapes[1].text


def test_a_drape_has_its_name_whatever_else_is_in_the_batch_until_its_scene_changes(scene):
    names = [drape.name for drape in plan([scene], spread(["contact.friction=[0, 0.1, 0.2]"]))]
    assert plan([scene], spread(["contact.friction=[0.2]"]))[0].name == names[2]
    changed = json.loads(scene.read_text())
    changed["drape"]["duration_s"] = 0.2
    scene.write_text(json.dumps(changed))
    assert plan([scene], spread(["contact.friction=[0.2]"]))[0].name not in names


def test_every_fault_is_told_at_once(scene, tmp_path):
    (tmp_path / "bad.yaml").write_text("scene: bad\nposse: 1\n")
    with pytest.raises(InputError) as caught:
        plan([tmp_path / "bad.yaml", scene, tmp_path / "none.yaml"], spread(["mesh.edge_length_mm=[20, -1]"]))
    text = "\n".join(caught.value.faults)
    assert "bad.yaml:2:1: posse: unknown key" in text and text.count("posse") == 1
    assert "--set mesh.edge_length_mm=-1: " in text and "none.yaml: no such file" in text


def test_one_drape_twice_is_refused(scene):
    with pytest.raises(InputError, match="is the same as cone_edge_length_mm=20_"):
        plan([scene], spread(["mesh.edge_length_mm=[20, 20.0]"]))
