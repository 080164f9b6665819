"""A batch on a real Dask scheduler with two worker processes on loopback."""

import json
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from taichi_tryon.batch.course import Workers, run_batch
from taichi_tryon.batch.drape import Program, run_drape
from taichi_tryon.batch.plan import plan
from taichi_tryon.bench.stability.kills import differing, frames
from taichi_tryon.errors import InputError
from taichi_tryon.scene.sweep import Variant


@pytest.fixture
def cluster(tmp_path):
    """(address, workers): processes of a scheduler and of two workers with a thread each."""
    found = tmp_path / "scheduler.json"
    place = ["--scheduler-file", str(found)]
    scheduler = ["dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    worker = ["dask_worker", "--no-nanny", "--nthreads", "1", "--no-dashboard", "--local-directory", str(tmp_path)]
    processes = [
        subprocess.Popen([sys.executable, "-m", f"distributed.cli.{name}", *options, *place], stderr=subprocess.DEVNULL)
        for name, *options in (scheduler, worker, worker)
    ]
    try:
        while not (found.exists() and found.read_text().endswith("}")):  # it is not written at once
            assert processes[0].poll() is None
            time.sleep(0.05)
        yield json.loads(found.read_text())["address"], processes[1:]
    finally:
        for process in processes:
            process.kill()
            process.wait()


def test_every_drape_ends_once_though_a_worker_is_killed(tmp_path, cluster, make_drapes, program, wait_for_pids):
    address, workers = cluster
    drapes, said = make_drapes("0", "0", "once", "crash", "0", "0"), []

    def say(line):
        said.append(line)
        if len(said) == 1:
            _, parent = wait_for_pids(tmp_path / "out" / drapes[2].name)
            next(worker for worker in workers if worker.pid == parent).kill()

    batch = run_batch(drapes, tmp_path / "out", Workers(scheduler=address), program=program, say=say)
    assert [row.status for row in batch.rows] == ["failed" if d.text == "crash" else "settled" for d in drapes]
    assert len(said) == len(drapes)
    logs = [(tmp_path / "out" / drape.name / "log.txt").read_text() for drape in drapes]
    assert [log.count("settled") for log in logs] == [1, 1, 1, 0, 1, 1]
    # what the killed worker was at was begun anew by the other
    assert [log.count("begun") for log in logs] == [1, 1, 2, 1, 1, 1]


@pytest.fixture
def sheets(tmp_path, make_cone_scene):
    """Drapes of a hanging sheet of three weights, each of some seconds, and the program that runs them."""
    sheet = {
        "name": "sheet", "sheet": {"size_cm": [30, 10], "mesh": "regular"}, "holds": {"top": {"edge": "top"}},
        "fabric": make_cone_scene()["garments"][0]["fabric"],
    }  # fmt: skip
    scene = {
        "scene": "sheet", "garments": [sheet], "mesh": {"edge_length_mm": 50}, "drape": {"duration_s": 2},
        "solver": {"preconditioner": "block_jacobi"}, "settle": {"max_steps": 0},
        "output": {"images": False, "video": False, "frames_per_s": 60, "checkpoint_s": 0},
    }  # fmt: skip
    (tmp_path / "sheet.yaml").write_text(json.dumps(scene))
    key = "garments.0.fabric.weight_gf_per_cm2"
    drapes = plan([tmp_path / "sheet.yaml"], [Variant((f"{key}={w}",), {key: w}) for w in (0.01, 0.02, 0.03)])
    environment = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "OMP_NUM_THREADS": "1"}
    return drapes, Program(options=("--arch", "cpu"), environment=environment)


def test_what_a_killed_worker_had_begun_ends_as_if_nothing_had_been(tmp_path, cluster, sheets):
    address, workers = cluster
    drapes, program = sheets
    killed = []

    def kill() -> None:
        """Kill the first worker of whose drape ten frames are there."""
        while not killed:
            for drape in drapes:
                if len(frames(tmp_path / "out" / drape.name)) >= 10:
                    worker = next((w for w in workers if _computes(w.pid, drape.name)), None)
                    if worker is not None and not killed:
                        worker.kill()
                        killed.append(drape)
            time.sleep(0.01)

    threading.Thread(target=kill, daemon=True).start()
    said = []
    batch = run_batch(drapes, tmp_path / "out", Workers(scheduler=address), program=program, say=said.append)
    assert [row.status for row in batch.rows] == ["finished"] * 3 and len(said) == 3
    (cut,) = killed
    run_drape(cut, tmp_path / "alone", program, threading.Event())
    assert len(frames(tmp_path / "alone")) > 100
    assert differing(tmp_path / "alone", tmp_path / "out" / cut.name) == []


def _computes(worker: int, name: str) -> bool:
    """Whether a worker has a child whose command names a drape."""
    try:
        children = Path(f"/proc/{worker}/task").glob("*/children")
        found = [Path(f"/proc/{child}/cmdline").read_bytes() for path in children for child in path.read_text().split()]
    except OSError:
        return False
    return any(name.encode() in command for command in found)


def test_no_scheduler(tmp_path, make_drapes, program, monkeypatch):
    monkeypatch.setattr("taichi_tryon.batch.cluster.CONNECT", 0.5)
    with pytest.raises(InputError, match="--scheduler tcp://127.0.0.1:9: no scheduler answers: .*dask scheduler"):
        run_batch(make_drapes("0"), tmp_path, Workers(scheduler="tcp://127.0.0.1:9"), program=program)


def test_without_dask_it_says_how_to_get_it(tmp_path, make_drapes, program, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'taichi-tryon\[cluster\]'"):
        run_batch(make_drapes("0"), tmp_path, Workers(scheduler="tcp://127.0.0.1:9"), program=program)
