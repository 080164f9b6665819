"""Files that are whole or not there: nobody meets half of one, whatever ends the program."""

from __future__ import annotations

import os
from pathlib import Path

from taichi_tryon.errors import RunError


def replace_atomically(path: Path, write) -> None:
    """Call ``write(temporary path)`` and rename the result to ``path``; nothing is left behind where it fails.

    Raises:
        RunError: the disk refuses (full, read-only, folder gone).
    """
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        write(temporary)
        os.replace(temporary, path)
    except OSError as fault:
        raise RunError(f"{path}: cannot be written: {fault.strerror or fault}") from fault
    finally:
        temporary.unlink(missing_ok=True)
