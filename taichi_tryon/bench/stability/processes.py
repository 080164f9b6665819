"""Runs of scenes as a user starts them, each in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from taichi_tryon.errors import RunError


def start(scene: Path, output: Path, *options: str, **variables: str) -> subprocess.Popen:
    """``run SCENE --output OUTPUT`` with further options and environment ``variables``."""
    command = [sys.executable, "-m", "taichi_tryon", "run", str(scene), "--output", str(output), "--quiet"]
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    path = os.pathsep.join(filter(None, [os.getcwd(), os.environ.get("PYTHONPATH")]))
    environment = {**os.environ, "PYTHONPATH": path, **variables}
    return subprocess.Popen([*command, "--arch", "cpu", *options], text=True, env=environment, **pipes)


def end(process: subprocess.Popen, output: Path) -> None:
    """Wait for a run that is left alone. Raises RunError where it fails."""
    _, error = process.communicate()
    if process.returncode:
        raise RunError(f"{output.name}: exit code {process.returncode}: {error.strip()}")
