"""The state of a run in one file, from which it goes on."""

from __future__ import annotations

import hashlib
import zipfile
from pathlib import Path

import numpy as np

from taichi_tryon.errors import InputError, RunError
from taichi_tryon.output.files import replace_atomically

NAME = "checkpoint.npz"


def fingerprint(scene_text: str) -> str:
    """What must be the same for a run to go on from a checkpoint."""
    return hashlib.sha256(scene_text.encode()).hexdigest()


def save(folder: Path, scene_text: str, state: dict[str, np.ndarray]) -> None:
    """Write ``checkpoint.npz``, whole or not at all. Raises RunError where the disk refuses or a value is NaN."""
    for name, values in state.items():
        if values.dtype.kind == "f" and np.isnan(values).any():
            raise RunError(f"{folder / NAME}: {name} is not a number; the checkpoint before is kept")

    def write(path: Path) -> None:
        with path.open("wb") as file:
            np.savez(file, fingerprint=np.array(fingerprint(scene_text)), **state)

    replace_atomically(folder / NAME, write)


def load(folder: Path, scene_text: str) -> dict[str, np.ndarray]:
    """Read a checkpoint of the same scene. Raises InputError where it lacks, is broken, or the scene differs."""
    path = folder / NAME
    if not path.exists():
        raise InputError(f"{path}: no checkpoint to resume from; leave --resume out to start anew")
    try:
        with np.load(path, allow_pickle=False) as file:
            state = {name: file[name] for name in file.files}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as fault:
        raise InputError(f"{path}: not a checkpoint ({fault}); leave --resume out to start anew") from fault
    if str(state.pop("fingerprint", "")) != fingerprint(scene_text):
        raise InputError(f"{path}: was written by another scene; leave --resume out to start anew")
    return state
