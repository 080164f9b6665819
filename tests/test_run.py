"""Whole runs, each in a process of its own as they start Taichi anew: what they write, say and leave behind."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import meshio
import numpy as np
import pytest
from PIL import Image

from taichi_tryon.run import _Run

QUALITY = {
    "residual_relative",
    "speed_max_mm_s",
    "penetration_mm",
    "penetrating_samples_percent",
    "strain_percent",
    "shear_degree",
    "gap_mm",
    "contact_area_percent",
    "pressure_kPa",
    "body_pressure_kPa",
    "contact_force_N",
    "energy_J",
    "crossing_triangle_pairs",
}
FIELDS = {
    "": {
        "schema",
        "scene",
        "status",
        "reason",
        "versions",
        "device",
        "mesh",
        "run",
        "timing_s",
        "quality",
        "garments",
        "holds",
        "skipped",
        "warnings",
    },
    "versions": {"taichi_tryon", "taichi", "numpy", "python"},
    "device": {"arch", "precision", "threads", "renderer"},
    "mesh": {"vertices", "triangles", "edge_length_mm", "min_angle_deg"},
    "mesh.edge_length_mm": {"mean", "min", "max"},
    "run": {"simulated_s", "steps", "rejected_steps", "newton_iterations", "linear_iterations", "step_ms"},
    "run.step_ms": {"min", "mean", "max"},
    "timing_s": {"total", "startup", "compile", "body", "mesh", "dressing", "solve", "contact", "output"},
    "quality": QUALITY,
    "quality.strain_percent": {"warp", "weft"},
    "quality.strain_percent.warp": {"p50", "p99", "max"},
    "quality.strain_percent.weft": {"p50", "p99", "max"},
    "quality.shear_degree": {"p99", "max"},
    "quality.gap_mm": {"p50", "p95", "max"},
    "quality.pressure_kPa": {"p50", "p95", "max"},
    "quality.body_pressure_kPa": {"p50", "p95", "max"},
    "quality.contact_force_N": {"normal", "friction"},
    "quality.energy_J": {"stretch", "shear", "bend", "gravity"},
    "garments": {"cone"},
    "garments.cone": QUALITY | {"fit_mm"},
    "garments.cone.fit_mm": {"hem"},
    "garments.cone.fit_mm.hem": {"mean", "min", "max"},
}

# Interrupted twice: by a KeyboardInterrupt from the progress callback, then, gone on, by Ctrl-C's signal.
INTERRUPTED = """
import os, signal, sys
from pathlib import Path
from taichi_tryon.run import run_scene
from taichi_tryon.scene.load import load_scene

def after(steps, action):
    count = 0
    def progress(phase, fraction, note=""):
        nonlocal count
        count += phase not in ("prepare", "compile")
        if count == steps:
            action()
    return progress

def stop():
    raise KeyboardInterrupt

if __name__ == "__main__":
    scene, folder = load_scene(sys.argv[1]), Path(sys.argv[2])
    first = run_scene(scene, folder, arch="cpu", progress=after(4, stop))
    (folder / "report.json").rename(folder / "first.json")
    ctrl_c = after(5, lambda: os.kill(os.getpid(), signal.SIGINT))
    second = run_scene(scene, folder, arch="cpu", resume=True, progress=ctrl_c)
    (folder / "second.json").write_text((folder / "report.json").read_text())
    print(first.status, first.exit_code, second.status, second.exit_code)
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory, make_cone_scene) -> Path:
    """A folder with the scene, and the kernels' cache that the runs share."""
    folder = tmp_path_factory.mktemp("runs")
    scene = make_cone_scene()
    # the coarse space, which takes long to compile, is tried in test_simulation
    scene["solver"] = {"threads": 2, "preconditioner": "block_jacobi"}
    (folder / "cone.yaml").write_text(json.dumps(scene))
    return folder


def python(place: Path, *arguments) -> subprocess.CompletedProcess:
    environment = {**os.environ, "XDG_CACHE_HOME": str(place / "cache")}
    command = [sys.executable, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=600)


def command(place: Path, *arguments) -> subprocess.CompletedProcess:
    return python(place, "-m", "taichi_tryon", "--debug", "run", place / "cone.yaml", "--arch", "cpu", *arguments)


@pytest.fixture(scope="module")
def whole(place):
    """(process, folder, report) of a run from start to end."""
    done = command(place, "--output", place / "whole", "--quiet")
    assert done.returncode == 0, done.stderr
    return done, place / "whole", json.loads((place / "whole" / "report.json").read_text())


@pytest.fixture(scope="module")
def interrupted(whole, place):
    """(process, folder) of the run that was stopped twice; the kernels are in the cache by then."""
    done = python(place, "-c", INTERRUPTED, place / "cone.yaml", place / "parts")
    assert done.returncode == 0, done.stderr
    return done, place / "parts"


@pytest.fixture(scope="module")
def resumed(interrupted, place):
    """The same run, gone on to its end by the command line: (process, folder, times of the frames found there)."""
    folder = interrupted[1]
    found = {path.name: path.stat().st_mtime_ns for path in (folder / "frames").iterdir()}
    done = command(place, "--output", folder, "--resume")
    assert done.returncode == 0, done.stderr
    return done, folder, found


def at(report: dict, path: str):
    for key in filter(None, path.split(".")):
        report = report[key]
    return report


def test_it_settles(whole):
    done, folder, report = whole
    assert done.stdout.splitlines() == [f"settled: {report['reason']}", str(folder)]
    assert report["status"] == "settled" and report["scene"] == "cone" and report["schema"] == 1
    assert report["quality"]["residual_relative"] <= 0.01
    assert report["quality"]["penetration_mm"] == 0
    assert report["quality"]["contact_area_percent"] > 0 and report["quality"]["pressure_kPa"]["max"] > 0


@pytest.mark.parametrize("path", FIELDS)
def test_the_report_has_all_its_fields_and_no_others(whole, path):
    assert set(at(whole[2], path)) == FIELDS[path]


def test_the_reports_figures_agree_with_each_other(whole):
    report = whole[2]
    for name in QUALITY:  # one garment: the same as all together
        assert report["garments"]["cone"][name] == report["quality"][name]
    timing = report["timing_s"]
    assert sum(value for name, value in timing.items() if name != "total") == pytest.approx(timing["total"], rel=0.1)
    assert min(timing.values()) >= 0
    assert {"what", "why"} == set().union(*report["skipped"])
    assert {"motion of the body", "pictures", "film", "maps"} <= {item["what"] for item in report["skipped"]}
    (asleep,) = (item["why"] for item in report["skipped"] if item["what"] == "far contact samples")
    assert re.search(r": in the mean \d+\.\d % of \d+$", asleep)
    assert report["device"] == {"arch": "cpu", "precision": "f64", "threads": 2, "renderer": "none"}
    steps = report["run"]
    assert 0 < steps["step_ms"]["min"] <= steps["step_ms"]["mean"] <= steps["step_ms"]["max"]
    assert steps["newton_iterations"] >= steps["steps"] > 0 and steps["rejected_steps"] >= 0


def test_what_is_written(whole):
    _, folder, _ = whole
    assert {path.name for path in folder.iterdir()} == {
        "checkpoint.npz",
        "frames",
        "frames.pvd",
        "log.txt",
        "report.json",
        "scene.yaml",
    }
    assert "settle done after" in (folder / "log.txt").read_text()
    assert not [path for path in folder.rglob("*") if ".part" in path.name]


def test_frames_hold_the_arrays(whole):
    _, folder, report = whole
    frames = sorted((folder / "frames").glob("frame_*.vtu"))
    assert len(frames) >= 4
    for path in frames:
        mesh = meshio.read(path)
        assert len(mesh.points) == report["mesh"]["vertices"] and np.isfinite(mesh.points).all()
        assert len(mesh.cells_dict["triangle"]) == report["mesh"]["triangles"]
        assert {"velocity_m_s", "pressure_kPa", "gap_mm"} <= set(mesh.point_data)
        assert {"strain_warp_percent", "strain_weft_percent", "shear_degree", "panel"} <= set(mesh.cell_data)
        assert mesh.point_data["velocity_m_s"].shape == mesh.points.shape
    last = meshio.read(frames[-1])
    assert np.abs(last.cell_data["strain_warp_percent"][0]).max() == pytest.approx(
        report["quality"]["strain_percent"]["warp"]["max"], rel=1e-5
    )
    with np.load(folder / "checkpoint.npz") as state:
        assert np.array_equal(last.points, state["positions"])


def test_paraviews_list_names_files_that_are_there(whole):
    _, folder, _ = whole
    listed = [part.split('"')[0] for part in (folder / "frames.pvd").read_text().split('file="')[1:]]
    assert listed and all((folder / name).is_file() for name in listed)
    assert {path.name for path in (folder / "frames").glob("frame_*.vtu")} <= {Path(name).name for name in listed}


def test_interrupted_it_keeps_everything_and_says_so(interrupted):
    done, folder = interrupted
    assert done.stdout.split() == ["interrupted", "130", "interrupted", "130"]
    first, second = (json.loads((folder / f"{name}.json").read_text()) for name in ("first", "second"))
    for report, steps in ((first, 4), (second, 9)):
        assert report["status"] == "interrupted" and "--resume" in report["reason"]
        assert report["run"]["steps"] == steps
        assert set(report) == FIELDS[""] and set(report["quality"]) == QUALITY
    assert (folder / "checkpoint.npz").is_file()


def test_resumed_it_ends_as_if_it_had_never_been_interrupted(whole, resumed):
    with np.load(whole[1] / "checkpoint.npz") as one, np.load(resumed[1] / "checkpoint.npz") as other:
        assert set(one.files) == set(other.files)
        for name in one.files:
            assert np.array_equal(one[name], other[name]), name
    report = json.loads((resumed[1] / "report.json").read_text())
    assert report["status"] == "settled" and report["quality"] == whole[2]["quality"]
    assert report["run"]["steps"] == whole[2]["run"]["steps"]


def test_the_same_scene_gives_the_same_frames_to_the_last_bit(whole, resumed):
    _, folder, found = resumed
    one, other = ({path.name: path for path in (where / "frames").iterdir()} for where in (whole[1], folder))
    frames = {name for name in one if name.startswith("frame_")}
    assert frames == {name for name in other if name.startswith("frame_")}
    for name in frames:
        assert one[name].read_bytes() == other[name].read_bytes(), name
    # those from before the interruption were not written anew
    assert found and all(other[name].stat().st_mtime_ns == time for name, time in found.items())


def test_it_does_not_go_on_from_another_scene(resumed, place):
    done = command(place, "--output", resumed[1], "--resume", "--set", "contact.friction=0.1")
    assert done.returncode == 2
    assert "checkpoint.npz: was written by another scene" in done.stderr and "Traceback" not in done.stderr


def test_a_run_that_does_not_settle_fails_and_is_kept(whole, place):
    done = command(place, "--output", place / "short", "--quiet", "--set", "settle.residual=1e-6",
                   "--set", "settle.max_steps=2", "--set", "drape.duration_s=0")  # fmt: skip
    assert done.returncode == 3, done.stderr
    report = json.loads((place / "short" / "report.json").read_text())
    assert report["status"] == "failed" and report["reason"].startswith("not settled")
    assert report["quality"]["residual_relative"] > 1e-6
    assert (place / "short" / "checkpoint.npz").is_file()
    failure = report["failure"]
    assert set(failure) == {"garment", "panel", "at_cm", "world_cm", "seen", "try"}
    assert failure["garment"] == "cone" and failure["panel"] in ("front", "back") and failure["try"]
    assert failure["seen"]["residual_relative"] == report["quality"]["residual_relative"]
    worst = f"worst in cone, panel {failure['panel']}, at ({failure['at_cm'][0]:g}, {failure['at_cm'][1]:g}) cm: "
    assert done.stdout.splitlines()[1].startswith(worst)
    assert done.stdout.splitlines()[2] == f"try: {'; '.join(failure['try'])}"
    last = meshio.read(sorted((place / "short" / "frames").glob("frame_*.vtu"))[-1])
    assert np.linalg.norm(100 * last.points - failure["world_cm"], axis=1).min() < 0.02
    with Image.open(place / "short" / "images" / "failed.png") as picture:
        assert picture.size == (2 * 720, 960) and not report["warnings"]


def test_a_sweep_writes_a_folder_for_each_value_and_one_table(whole, place):
    done = command(place, "--output", place / "sweep", "--threads", 1, "--set", "settle.max_steps=[1, 200]")
    assert done.returncode == 3 and done.stdout.startswith("2 drapes: 1 failed, 1 settled\n"), done.stderr
    found = json.loads((place / "sweep" / "batch.json").read_text())["drapes"]
    assert [drape["parameters"] for drape in found] == [{"settle.max_steps": 1}, {"settle.max_steps": 200}]
    for drape in found:
        assert json.loads((place / "sweep" / drape["drape"] / "report.json").read_text()) == drape["report"]
    # a drape of a batch is the run that it would be alone, on two threads
    assert found[1]["report"]["quality"] == whole[2]["quality"]


def test_an_output_folder_that_cannot_be_made_is_told_at_once(place):
    (place / "file").write_text("")
    done = command(place, "--output", place / "file" / "out")
    assert done.returncode in (2, 3)
    assert "file" in done.stderr and "Traceback" not in done.stderr


MEETS, LIES = " where a and b run into each other", ", in cone, panel back, at [10.0, 10.0, 0.0] cm"


@pytest.mark.parametrize(("depth", "limbs", "said"), [(0.0, "ab", None), (9e-4, None, LIES), (2e-3, "ab", MEETS)])
def test_cloth_that_rests_in_the_body_is_told(resting, depth, limbs, said):
    told, deep = resting(depth, limbs)._inside()
    assert told == (f"cloth is {1000 * depth:.2g} mm inside the body{said}" if said else "") and not deep


def test_cloth_that_rests_deep_in_the_body_is_no_result(resting):
    assert resting(0.06, None)._inside() == (f"cloth is 60 mm inside the body{LIES}", True)


@pytest.fixture
def resting():
    """Makes a run at its end, one triangle of which, of the second garment, is some depth [m] in the body."""

    def make(depth, limbs) -> _Run:
        corners = np.array([[0.0, 0, 0], [0.3, 0, 0], [0, 0.3, 0], [9, 9, 9]])
        one = object.__new__(_Run)
        one.observer = SimpleNamespace(probe=SimpleNamespace(look=lambda: (np.array([0.0, depth]), None, None)))
        parts = (
            SimpleNamespace(name="top", triangles=slice(0, 1)),
            SimpleNamespace(name="cone", triangles=slice(1, 2)),
        )
        cloth = SimpleNamespace(triangles=np.array([[1, 2, 3], [0, 1, 2]]), parts=parts)
        meshes = (SimpleNamespace(mesh=SimpleNamespace(panel_names=(name,), panel=[0])) for name in ("front", "back"))
        setup = SimpleNamespace(cloth=cloth, garments=tuple(meshes))
        stepper = SimpleNamespace(x=SimpleNamespace(to_numpy=lambda: corners))
        one.simulation = SimpleNamespace(stepper=stepper, setup=setup)
        one._meeting = lambda at: limbs if at == pytest.approx([0.1, 0.1, 0.0]) else None
        return one

    return make
