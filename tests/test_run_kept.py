"""What a run keeps when it is killed, when the disk is full, and when its folder is not its own."""

import fcntl
import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from taichi_tryon.bench.stability.kills import differing, differs, frames
from taichi_tryon.output import checkpoint
from taichi_tryon.output.frames import read_frame

SHEET = {
    "scene": "sheet",
    "garments": [
        {"name": "strip", "sheet": {"size_cm": [30, 10], "mesh": "regular"}, "holds": {"top": {"edge": "top"}}}
    ],
    "mesh": {"edge_length_mm": 50},
    "solver": {"threads": 1, "preconditioner": "block_jacobi"},
    "drape": {"duration_s": 1},
    "settle": {"max_steps": 0},
    "output": {"images": False, "video": False, "frames_per_s": 60, "checkpoint_s": 0},
}


@pytest.fixture(scope="module")
def place(tmp_path_factory, make_cone_scene) -> Path:
    folder = tmp_path_factory.mktemp("kept")
    garments = [{**SHEET["garments"][0], "fabric": make_cone_scene()["garments"][0]["fabric"]}]
    (folder / "sheet.yaml").write_text(json.dumps({**SHEET, "garments": garments}))
    return folder


def start(place: Path, output: str, *options: str, **more) -> subprocess.Popen:
    environment = {**os.environ, "XDG_CACHE_HOME": str(place / "cache")}
    command = [sys.executable, "-m", "taichi_tryon", "run", place / "sheet.yaml", "--output", place / output]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([*command, "--arch", "cpu", "--quiet", *options], env=environment, **pipes, **more)


def end(process: subprocess.Popen) -> tuple[int, str]:
    """(exit code, stderr)"""
    _, error = process.communicate(timeout=300)
    return process.returncode, error


@pytest.fixture(scope="module")
def whole(place) -> Path:
    code, error = end(start(place, "whole"))
    assert code == 0, error
    return place / "whole"


def test_killed_it_keeps_every_frame_and_goes_on_as_if_nothing_had_been(place, whole):
    assert len(frames(whole)) > 50
    parts, kept = place / "parts", 0
    for frame in (4, 20):
        process = start(place, "parts", *["--resume"] * (frame > 4))
        while process.poll() is None and len(frames(parts)) < frame:
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
        end(process)
        found = frames(parts)
        assert process.returncode == -signal.SIGKILL and len(found) >= max(frame, kept)
        assert not [name for name in found if differs(whole, parts, f"frames/{name}")]
        kept = len(found)
    code, error = end(start(place, "parts", "--resume"))
    assert code == 0, error
    assert differing(whole, parts) == []


def test_a_full_disk_ends_it_in_one_line_and_leaves_whole_files(place, whole):
    """No file may grow beyond what a checkpoint needs: the disk is full for that alone, or for everything."""
    sizes = {path.name: path.stat().st_size for path in whole.rglob("*") if path.is_file()}
    limit = (sizes["checkpoint.npz"] + max(sizes[name] for name in frames(whole))) // 2
    process = start(place, "full", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
    code, error = end(process)
    assert code == 3 and "Traceback" not in error and error.count("\n") <= 1
    full = place / "full"
    assert not [path.name for path in full.rglob("*") if ".part" in path.name]
    assert not (full / "checkpoint.npz").exists()
    for name in frames(full):
        assert len(read_frame(full / "frames" / name)) == 1
    report = json.loads((full / "report.json").read_text())
    assert report["status"] == "failed" and "checkpoint.npz: cannot be written: File too large" in report["reason"]


def test_a_folder_in_use_is_refused_and_left_alone(place, whole):
    before = {path: path.stat().st_mtime_ns for path in whole.rglob("*")}
    with (whole / "log.txt").open("a") as log:
        fcntl.flock(log, fcntl.LOCK_EX)
        for options in ([], ["--resume"]):
            code, error = end(start(place, "whole", *options))
            assert code == 2 and error.count("\n") == 1
            assert "another run is writing there; wait for its end or choose another folder" in error
    assert before == {path: path.stat().st_mtime_ns for path in whole.rglob("*")}


@pytest.mark.parametrize("name", ["frame_index", "progress_phase"])
def test_a_checkpoint_of_another_program_is_refused(place, whole, name):
    folder = place / f"other_{name}"
    folder.mkdir()
    with np.load(whole / "checkpoint.npz") as file:
        state = {key: file[key] for key in file.files if key not in (name, "fingerprint")}
    checkpoint.save(folder, (whole / "scene.yaml").read_text(), state)
    code, error = end(start(place, folder.name, "--resume"))
    assert code == 2 and error.count("\n") == 1 and "checkpoint.npz: does not fit this program" in error
    assert [path.name for path in folder.iterdir()] == ["checkpoint.npz"]
