"""How output folders are compared; the kills themselves are tried in tests/test_run.py."""

import json

import numpy as np
import pytest

from taichi_tryon.bench.stability import kills


@pytest.fixture
def make_folder(tmp_path):
    def make(name, frame=b"frame", x=1.0, speed=2.0, status="settled", step_ms=3.0):
        folder = tmp_path / name
        (folder / "frames").mkdir(parents=True)
        (folder / "frames" / "frame_0000.vtu").write_bytes(frame)
        (folder / "log.txt").write_text(name)
        np.savez(folder / "checkpoint.npz", positions=np.array(x))
        report = {"run": {"steps": 3, "step_ms": {"mean": step_ms}}, "mesh": {}, "garments": {}, "holds": {}}
        (folder / "report.json").write_text(
            json.dumps({**report, "status": status, "quality": {"speed": speed}, "timing_s": {"total": step_ms}})
        )
        return folder

    return make


def test_runs_differ_in_their_results_alone(make_folder):
    assert kills.differing(make_folder("whole"), make_folder("other", step_ms=9.0)) == []


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({"frame": b"frames"}, ["frames/frame_0000.vtu"]),
        ({"x": 1 + 2**-52}, ["checkpoint.npz"]),
        ({"speed": 2.1}, ["report.json"]),
        ({"status": "failed"}, ["report.json"]),
    ],
)
def test_what_differs_is_named(make_folder, change, found):
    assert kills.differing(make_folder("whole"), make_folder("other", **change)) == found


def test_frames_that_are_missing_or_half_written(make_folder):
    whole, other = make_folder("whole"), make_folder("other")
    (other / "frames" / "frame_0001.vtu").write_bytes(b"frame")
    (other / "frames" / ".frame_0002.7.part.vtu").write_bytes(b"fra")
    assert kills.frames(other) == ["frame_0000.vtu", "frame_0001.vtu"]
    assert kills.differs(whole, other, "frames/frame_0001.vtu")
    assert kills.differing(whole, other) == ["frames/.frame_0002.7.part.vtu", "frames/frame_0001.vtu"]
