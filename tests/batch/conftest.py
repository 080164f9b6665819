"""A program that stands in for the simulation: it does what the scene's text says, in a process of its own."""

from __future__ import annotations

import time

import pytest

from taichi_tryon.batch.drape import Drape, Program

STAND_IN = """
import json, os, signal, sys, threading, time
from pathlib import Path
from taichi_tryon.batch.child import end_with_parent

def end(status, code):
    with open(folder / "log.txt", "a") as log:
        log.write(status + "\\n")
    (folder / "report.json").write_text(json.dumps({"status": status, "reason": "as told", "quality": {"speed": 1.5}}))
    os._exit(code)

if __name__ == "__main__":
    threading.Thread(target=end_with_parent, daemon=True).start()
    signal.signal(signal.SIGTERM, lambda *_: end("interrupted", 130))
    text, folder = Path(sys.argv[2]).read_text(), Path(sys.argv[4])
    again = (folder / "log.txt").exists()
    with open(folder / "log.txt", "a") as log:
        log.write("begun " + " ".join(sys.argv[5:]) + " " + os.environ.get("OMP_NUM_THREADS", "") + "\\n")
    (folder / "pids").write_text(f"{os.getpid()} {os.getppid()}.")
    if text == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    if text == "refuse":
        print("top: cannot be put on", file=sys.stderr)
        sys.exit(2)
    time.sleep((0 if again else 60) if text == "once" else float(text))
    end("settled", 0)
"""


@pytest.fixture
def program(tmp_path) -> Program:
    script = tmp_path / "stand_in.py"
    script.write_text(STAND_IN)
    return Program(start=(str(script),))


@pytest.fixture
def make_drapes():
    """Makes drapes of texts: seconds to sleep, "crash", "refuse", or "once", which sleeps long the first time only."""
    return lambda *texts: [Drape(f"d{n}_{text}", "s.yaml", {"n": n}, text) for n, text in enumerate(texts)]


@pytest.fixture
def wait_for_pids():
    """Waits until a drape's process has begun in a folder: the ids of it and of its parent."""

    def wait(folder):
        found = folder / "pids"
        for _ in range(1000):
            if found.exists() and (text := found.read_text()).endswith("."):
                return tuple(map(int, text[:-1].split()))
            time.sleep(0.05)
        raise AssertionError(f"nothing has begun in {folder}")

    return wait
