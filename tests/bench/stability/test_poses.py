"""Drawn poses: within the ranges, the same every time, and every way in which a drape may end is told apart."""

from pathlib import Path

import numpy as np
import pytest

from taichi_tryon.bench.stability import poses
from taichi_tryon.bench.stability.poses import KINDS, Outcome
from taichi_tryon.body.ranges import beyond
from taichi_tryon.body.spec import BodySpec
from taichi_tryon.scene.load import load_part, load_scene

ROOT = Path(__file__).parents[3]
REFUSAL = (
    "/tmp/scene.yaml:9:3: garments.0.dressing.disks.knee_l: dressing 't', panel 'a' near disk 'knee_l' is 3 mm inside "
    "the body"
)


@pytest.fixture(autouse=True)
def _in_the_projects_folder(monkeypatch):
    monkeypatch.chdir(ROOT)


@pytest.fixture(scope="module")
def body() -> BodySpec:
    return load_part(ROOT / "configs/bodies/adult_woman_9AR.yaml", BodySpec)


def test_poses_reach_over_the_whole_range_and_not_beyond(body):
    drawn = [poses.drawn(body, number) for number in range(200)]
    assert not [line for pose in drawn for line in beyond(pose, body)]
    knees = np.array([pose.rotations_degree["calf_l"] for pose in drawn])
    assert knees[:, 0].min() < 5 and knees[:, 0].max() > 86 and not knees[:, 1:].any()
    # joints turn by themselves, and joints without a range not at all
    other = np.array([pose.rotations_degree["calf_r"][0] for pose in drawn])
    assert abs(np.corrcoef(knees[:, 0], other)[0, 1]) < 0.2
    assert "pelvis" not in drawn[0].rotations_degree


def test_a_pose_is_the_same_however_many_are_drawn(body):
    assert poses.drawn(body, 7) == poses.drawn(body, 7) != poses.drawn(body, 8)


def test_garments_take_turns_and_feel_themselves(tmp_path, body):
    drapes = [poses.drape_of(number) for number in range(3)]
    assert [drape.parameters["garment"] for drape in drapes] == ["top", "trousers", "top"]
    for number, drape in enumerate(drapes):
        (tmp_path / "scene.yaml").write_text(drape.text)
        scene = load_scene(tmp_path / "scene.yaml")
        assert scene.pose == poses.drawn(body, number) and scene.contact.layers is not None
        assert scene.mesh.edge_length_mm == 20


@pytest.mark.parametrize(
    ("report", "kind"),
    [
        ({"status": "settled", "quality": dict.fromkeys(poses.LIMITED, 0.0), "warnings": []}, "settled"),
        ({"status": "failed", "failure": {"panel": "back", "at_cm": [1, 2]}}, "failed"),
        ({"status": "failed", "reason": REFUSAL}, "refused"),
        ({"status": "failed", "reason": "its process was ended by signal 11 (SIGSEGV)"}, "silent"),
        ({"status": "interrupted", "reason": REFUSAL}, "silent"),
    ],
)
def test_how_a_drape_ended(report, kind):
    assert poses.judged({"reason": "net force 1e-3 of the weight", **report}).kind == kind


def test_cloth_between_limbs_that_overlap_is_told_and_not_counted():
    quality = {"penetration_mm": 5.0, "crossing_triangle_pairs": 2}
    report = {"status": "settled", "reason": "net force 1e-3 of the weight", "quality": quality}
    between = "cloth is 5 mm inside the body where leg_l and leg_r run into each other"
    outcome = poses.judged({**report, "warnings": ["pose 'a': knee beyond its range", between]})
    assert outcome == Outcome("settled", f"{report['reason']}; {between}", {"crossing_triangle_pairs": 2})
    elsewhere = poses.judged({**report, "warnings": ["cloth is 5 mm inside the body, in top, panel back"]})
    assert elsewhere.figures == quality


def test_a_failure_names_its_place():
    failure = {"panel": "back", "at_cm": [1.5, -2]}
    assert poses.judged({"status": "failed", "reason": "no", "failure": failure}).reason == (
        "no; worst in panel back at (1.5, -2) cm"
    )


def test_each_pose_is_judged_and_all_are_counted(monkeypatch):
    ends = {
        "top_0": Outcome("settled", "", {"penetration_mm": 0.0, "crossing_triangle_pairs": 0}),
        "trousers_1": Outcome("refused", REFUSAL),
        "trousers_1_led": Outcome("settled", "", {"penetration_mm": 0.2, "crossing_triangle_pairs": 3}),
        "top_2": Outcome("silent", "crashed"),
        "trousers_3": Outcome("refused", REFUSAL),
        "trousers_3_led": Outcome("failed", "no step; worst in panel back at (1, 2) cm"),
    }
    monkeypatch.setattr(poses, "tried", lambda drape, folder: ends[drape.name])
    found = list(poses.records(quick=True, count=4))
    told = [record for record in found if record.quantity == "settled_or_said_why"]
    assert [record.passes for record in told] == [True, True, False, True]
    starts = ["put on there", "led there", "put on there", "led there"]
    assert [record.parameters["start"] for record in told] == starts
    sums = {record.quantity: (record.value, record.passes) for record in found if not record.parameters}
    counts = dict(zip(("tried", "refused", *KINDS), (4, 2, 2, 1, 1), strict=True))
    assert sums == {
        **{f"poses_{kind}": (count, True) for kind, count in counts.items()},
        "penetration_mm_worst": (0.2, False),
        "crossing_triangle_pairs_worst": (3, False),
    }


def test_what_cannot_be_put_on_in_a_pose_is_led_there_from_its_own(tmp_path, body):
    drape = poses.drape_of(1, led=True)
    (tmp_path / "scene.yaml").write_text(drape.text)
    scene, own = load_scene(tmp_path / "scene.yaml"), load_scene("configs/scenes/trousers_step.yaml")
    assert scene.pose == own.pose and [step.pose for step in scene.motion] == [poses.drawn(body, 1)]
    assert drape.name != poses.drape_of(1).name


def test_a_pose_that_cannot_be_dressed_is_refused_by_panel_and_disk(tmp_path):
    drape = poses.drape_of(1)
    # a thigh that points forward
    text = drape.text.replace("edge_length_mm: 20", "edge_length_mm: 60")
    outcome = poses.tried(type(drape)(drape.name, drape.scene, drape.parameters, text), tmp_path)
    assert outcome.kind == "refused" and "panel" in outcome.reason and "disk" in outcome.reason
    assert outcome.reason.endswith("begin in another pose and lead the body to this one by `motion`")
