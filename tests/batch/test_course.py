"""Batches of stand-ins for the simulation: what fails stops no other, nothing is done twice, a stop keeps what is."""

import csv
import json
import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from taichi_tryon.batch.course import Workers, run_batch
from taichi_tryon.batch.drape import Program, run_drape
from taichi_tryon.errors import InputError


def log(folder, drape):
    return (folder / drape.name / "log.txt").read_text().split("\n")


def test_what_fails_stops_no_other(tmp_path, make_drapes, program):
    drapes, said = make_drapes("0", "crash", "refuse", "0.1"), []
    batch = run_batch(drapes, tmp_path / "out", Workers(jobs=2), program=program, say=said.append)
    assert [row.status for row in batch.rows] == ["settled", "failed", "failed", "settled"]
    assert batch.rows[1].report["reason"] == "its process was ended by signal 11 (SIGSEGV)"
    assert batch.rows[2].report["reason"] == "top: cannot be put on"
    assert batch.exit_code == 3 and not batch.stopped
    assert len(said) == 4 and said[-1].startswith("4 of 4: ")
    whole = json.loads((tmp_path / "out" / "batch.json").read_text())
    assert whole["status"] == {"settled": 2, "failed": 2}
    assert [(d["drape"], d["parameters"]) for d in whole["drapes"]] == [(d.name, d.parameters) for d in drapes]
    with (tmp_path / "out" / "batch.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["n"] for line in lines] == ["0", "1", "2", "3"]
    assert [line["quality.speed"] for line in lines] == ["1.5", "", "", "1.5"]


def test_a_resumed_batch_repeats_nothing_that_ended(tmp_path, make_drapes, program):
    drapes = make_drapes("0", "crash")
    run_batch(drapes[:1], tmp_path, program=program)
    batch = run_batch(drapes, tmp_path, program=program, resume=True)
    assert len(log(tmp_path, drapes[0])) == 3  # begun, settled, and the end of the line
    assert [row.status for row in batch.rows] == ["settled", "failed"]
    run_batch(drapes, tmp_path, program=program, resume=True)
    assert len(log(tmp_path, drapes[0])) == 3 and len(log(tmp_path, drapes[1])) == 3  # the crash left no report
    run_batch(drapes[:1], tmp_path, program=program)
    assert len(log(tmp_path, drapes[0])) == 5


def test_a_drape_that_was_cut_off_goes_on_from_its_checkpoint(tmp_path, make_drapes, program):
    (drape,) = make_drapes("0")
    folder = tmp_path / drape.name
    folder.mkdir()
    (folder / "report.json").write_text('{"status": "interrupted", "reason": "stopped"}')
    (folder / "checkpoint.npz").write_text("")
    batch = run_batch([drape], tmp_path, program=Program(program.start, ("--arch", "cpu")), resume=True)
    assert batch.exit_code == 0
    assert log(tmp_path, drape)[0].split()[:5] == ["begun", "--quiet", "--resume", "--arch", "cpu"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopped_it_ends_what_runs_and_keeps_what_is_finished(tmp_path, make_drapes, program, number):
    drapes = make_drapes("0", "60", "60")
    begin = time.monotonic()
    batch = run_batch(drapes, tmp_path, program=program, say=lambda line: signal.raise_signal(number))
    assert time.monotonic() - begin < 30
    assert batch.stopped and batch.exit_code == 130
    assert [row.status for row in batch.rows] == ["settled", "interrupted", "interrupted"]
    assert not (tmp_path / drapes[2].name / "report.json").exists()
    assert json.loads((tmp_path / "batch.json").read_text())["status"] == {"settled": 1, "interrupted": 2}


def test_processes_at_a_time_share_the_cores(tmp_path, make_drapes, program, monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setattr("os.sched_getaffinity", lambda pid: set(range(6)))
    drapes = make_drapes("0", "0.1", "0.2")
    run_batch(drapes, tmp_path, Workers(jobs=2), program=program)
    assert [log(tmp_path, drape)[0].split()[-1] for drape in drapes] == ["3", "3", "3"]


def test_a_drape_ends_with_whoever_started_it(tmp_path, program, wait_for_pids):
    code = (
        "import sys, threading; from pathlib import Path; from taichi_tryon.batch.drape import *\n"
        f"run_drape(Drape('d', 's', {{}}, '60'), Path({str(tmp_path / 'd')!r}), Program({program.start!r}), "
        "threading.Event())"
    )
    parent = subprocess.Popen([sys.executable, "-c", code])
    child, _ = wait_for_pids(tmp_path / "d")
    parent.kill()
    parent.wait()
    for _ in range(100):
        if not _alive(child):
            break
        time.sleep(0.05)
    assert not _alive(child) and not (tmp_path / "d" / "report.json").exists()


def _alive(pid: int) -> bool:
    """Whether a process runs; one that nobody has waited for is dead."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_folder_that_cannot_be_made_fails_one_drape(tmp_path, make_drapes, program):
    (drape,) = make_drapes("0")
    (tmp_path / "file").write_text("")
    report = run_drape(drape, tmp_path / "file" / "d", program, threading.Event())
    assert report["status"] == "failed" and os.strerror(20) in report["reason"]


def test_an_output_that_is_a_file_is_refused(tmp_path, make_drapes, program):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file; choose another folder"):
        run_batch(make_drapes("0"), tmp_path / "file", program=program)
