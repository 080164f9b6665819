"""The output folder: whether it can be written, one run at a time in it, and what goes of an earlier run."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import IO

from taichi_tryon.errors import InputError, RunError

# the lock is on a file that every run opens to write anyway, and the system gives it back however a process ends
LOG = "log.txt"


def require_writable(folder: Path) -> None:
    """Find out without writing whether an output folder can be made. Raises InputError where not."""
    try:
        there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    except OSError as fault:
        raise InputError(f"--output {folder}: cannot be a folder: {fault.strerror}") from fault
    if not there.is_dir():
        raise InputError(f"--output {folder}: {there} is a file; choose another folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f"--output {folder}: {there} is not writable; choose another folder")


def lock(file: IO[str], folder: Path) -> None:
    """Keep other runs out of ``folder`` while its opened log ``file`` is open. Raises InputError where one is in it."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(
            f"--output {folder}: another run is writing there; wait for its end or choose another folder"
        ) from None
    except OSError:
        pass  # a file system that knows no locks


def require_free(folder: Path) -> None:
    """Raises InputError where a run is writing into ``folder``."""
    try:
        file = (folder / LOG).open()
    except OSError:
        return  # nothing is there, or nothing that this run may write, which it is told when it does
    with file:
        lock(file, folder)


def clear(folder: Path, resumed: bool) -> None:
    """Remove what an earlier run left and this one will not write anew; where that goes on, only what it had begun.

    Raises RunError where the disk refuses.
    """
    try:
        for place in (folder, folder / "frames", folder / "images"):
            for path in place.glob(".*.part.*"):
                path.unlink()
        if not resumed:
            clear_frames(folder, 0)
            for name in ("checkpoint.npz", "report.json", "video.mp4", "frames.pvd"):
                (folder / name).unlink(missing_ok=True)
    except OSError as fault:
        raise RunError(f"{fault.filename}: cannot be removed: {fault.strerror}") from fault


def clear_frames(folder: Path, first: int) -> None:
    """Remove frames and pictures from number ``first`` on: they are of an earlier run, not of this one."""
    for path in (*folder.glob("frames/*_[0-9]*.*"), *folder.glob("images/*.png")):
        number = path.stem.rpartition("_")[2]
        if not number.isdigit() or int(number) >= first:
            path.unlink()
