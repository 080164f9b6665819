"""The table of a batch: every report in JSON, a row of figures for each drape in CSV."""

import csv
import json

from taichi_tryon.batch.drape import Drape
from taichi_tryon.batch.table import Row, write


def test_both_files(tmp_path):
    failed = {
        "status": "failed",
        "reason": "not settled, alas",
        "failure": {"garment": "top", "at_cm": [1.5, 2.0]},
        "run": {"steps": 9},
        "quality": {"strain_percent": {"warp": {"p99": 0.5}}, "gap_mm": None},
        "skipped": [{"what": "film", "why": "not asked for"}],
    }
    rows = [
        Row(Drape("a", "s.yaml", {"gravity_m_s2": [0, 1, 0], "mesh.bending": "constant"}, ""), failed),
        Row(Drape("b", "t.yaml", {}, ""), {"status": "waiting", "reason": "has not been run yet"}),
    ]
    assert write(tmp_path, rows) == [tmp_path / "batch.csv", tmp_path / "batch.json"]
    with (tmp_path / "batch.csv").open(newline="") as file:
        one, two = csv.DictReader(file)
    assert one == {
        "drape": "a",
        "scene": "s.yaml",
        "gravity_m_s2": "[0, 1, 0]",
        "mesh.bending": "constant",
        "status": "failed",
        "reason": "not settled, alas",
        "failure.garment": "top",
        "failure.at_cm": "[1.5, 2.0]",
        "run.steps": "9",
        "quality.strain_percent.warp.p99": "0.5",
        "quality.gap_mm": "",
    }
    assert two["drape"] == "b" and two["status"] == "waiting" and two["run.steps"] == ""
    found = json.loads((tmp_path / "batch.json").read_text())
    assert found["schema"] == 1 and found["status"] == {"failed": 1, "waiting": 1}
    assert [drape["report"] for drape in found["drapes"]] == [row.report for row in rows]
