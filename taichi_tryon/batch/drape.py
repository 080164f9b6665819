"""One drape of a batch in a process of its own: nothing that it leaves in memory, and no crash, reaches the others.

Workers and scheduler of a cluster import this module to read what they are sent: it imports little.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from taichi_tryon.errors import RunError
from taichi_tryon.output import checkpoint
from taichi_tryon.output.files import replace_atomically

# seconds between two looks at whether the batch was stopped, and after which a drape that does not end is killed
POLL, PATIENCE = 0.5, 60.0
ENDS = ("settled", "finished", "failed")


@dataclass(frozen=True)
class Drape:
    """One run of a batch.

    ``name`` is that of its folder, made of the scene's name, the swept values and the fingerprint of ``text``: a batch
    resumed finds it again whatever was added to the batch, and never takes another scene for it.
    ``text`` is the whole scene as YAML, files it names included: what is changed in them later does not reach it.
    """

    name: str
    scene: str
    parameters: dict[str, Any]
    text: str


class Stop(Protocol):
    """A threading.Event, or its like of a cluster."""

    def is_set(self) -> bool: ...


@dataclass(frozen=True)
class Program:
    """How a drape is run: the interpreter's arguments before those of ``run``, options after them, and what is set in
    its environment."""

    start: tuple[str, ...] = ("-m", "taichi_tryon.batch.child")
    options: tuple[str, ...] = ()
    environment: Mapping[str, str] = field(default_factory=dict)


def run_drape(drape: Drape, folder: Path, program: Program, stop: Stop) -> dict:
    """Run a drape in ``folder``, or go on with one that was cut off there; its report.

    A drape that has ended is left as it is, so that this can be called again wherever it is not known whether it was.
    One that ends without a report (a crash) gets a short one: status and reason. ``stop`` ends it as Ctrl-C does.
    """
    if report := ended(folder):
        return report
    if stop.is_set():
        return {"status": "interrupted", "reason": "the batch was stopped before it began"}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "report.json").unlink(missing_ok=True)
        scene = folder / "scene.yaml"
        replace_atomically(scene, lambda path: path.write_text(drape.text))
        resume = ("--resume",) if (folder / checkpoint.NAME).exists() else ()
        arguments = ("run", str(scene), "--output", str(folder), "--quiet", *resume, *program.options)
        code, said = _call([sys.executable, *program.start, *arguments], program.environment, stop)
    except (OSError, RunError) as fault:
        return {"status": "failed", "reason": str(fault)}
    if report := read_report(folder):
        return report
    # stopped in its first moments, it has nothing to say yet
    status = "interrupted" if code == 130 or stop.is_set() else "failed"
    return {"status": status, "reason": said or _how_it_ended(code)}


def clear(folder: Path) -> None:
    """Forget an earlier run of a drape: it begins anew."""
    for name in ("report.json", checkpoint.NAME):
        (folder / name).unlink(missing_ok=True)


def ended(folder: Path) -> dict | None:
    """The report of a drape that came to its end, None where there is none or it was interrupted."""
    report = read_report(folder)
    return report if report and report.get("status") in ENDS else None


def read_report(folder: Path) -> dict | None:
    """``report.json`` of a folder; None where it is missing or broken."""
    try:
        report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return report if isinstance(report, dict) else None


def _call(command: list[str], environment: Mapping[str, str], stop: Stop) -> tuple[int, str]:
    """Exit code of a command and what it wrote to stderr.

    It has a session of its own, as the terminal's Ctrl-C is for the batch to pass on, and an open standard input, which
    ends with this process.
    """
    with tempfile.TemporaryFile() as heard:
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.DEVNULL, "stderr": heard}
        variables = {**os.environ, **environment}
        with subprocess.Popen(command, env=variables, start_new_session=True, **pipes) as process:
            stopped = None
            while True:
                try:
                    code = process.wait(POLL)
                    break
                except subprocess.TimeoutExpired:
                    pass
                if stopped is None and stop.is_set():
                    stopped = time.monotonic()
                    process.terminate()
                elif stopped is not None and time.monotonic() - stopped > PATIENCE:
                    process.kill()
        heard.seek(0)
        return code, heard.read().decode(errors="replace").strip()[-2000:]


def _how_it_ended(code: int) -> str:
    if code >= 0:
        return f"its process ended with exit code {code} and without a report"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = "unknown"
    return f"its process was ended by signal {-code} ({name})"
