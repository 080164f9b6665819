"""A batch on a real Dask scheduler with two worker processes on loopback."""

import json
import subprocess
import sys
import time

import pytest

from taichi_tryon.batch.course import Workers, run_batch
from taichi_tryon.errors import InputError


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


def test_no_scheduler(tmp_path, make_drapes, program, monkeypatch):
    monkeypatch.setattr("taichi_tryon.batch.cluster.CONNECT", 0.5)
    with pytest.raises(InputError, match="--scheduler tcp://127.0.0.1:9: no scheduler answers: .*dask scheduler"):
        run_batch(make_drapes("0"), tmp_path, Workers(scheduler="tcp://127.0.0.1:9"), program=program)


def test_without_dask_it_says_how_to_get_it(tmp_path, make_drapes, program, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'taichi-tryon\[cluster\]'"):
        run_batch(make_drapes("0"), tmp_path, Workers(scheduler="tcp://127.0.0.1:9"), program=program)
