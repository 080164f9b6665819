"""Calls that may hang or crash, in a process that is watched and replaced."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path
from typing import Any

# a process that waits for others, or for the machine, is let live so many times as long as one that computes
PATIENCE = 12
LOOK_S = 0.05


class Hung(Exception):
    """A call took longer than it may; its process was killed."""


class Crashed(Exception):
    """A call ended its process."""


class Watched:
    """Calls ``function`` in a process of its own, which lives on between calls; a context manager.

    A call may compute for ``limit_s``: of the processor's time, as other programs may have it too.
    """

    def __init__(self, function: Callable[..., Any], limit_s: float):
        self.function, self.limit_s = function, limit_s
        self._context, self._process, self._pipe = get_context("spawn"), None, None

    def __call__(self, *arguments: Any) -> Any:
        """The result for these arguments. Raises Hung or Crashed; the next call gets a new process."""
        if self._process is None:
            self._start()
        begin, computed = time.monotonic(), self._computed_s()
        self._pipe.send(arguments)
        while not self._pipe.poll(LOOK_S):
            late = time.monotonic() - begin > PATIENCE * self.limit_s
            if late or self._computed_s() - computed > self.limit_s:
                self._stop()
                raise Hung(f"longer than {self.limit_s:g} s")
        try:
            return self._pipe.recv()
        except EOFError:
            self._process.join()
            code = self._process.exitcode
            self._stop()
            raise Crashed(f"exit code {code}") from None

    def _computed_s(self) -> float:
        """Processor time of the process, from proc(5)'s fields 14 and 15."""
        fields = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def _start(self) -> None:
        self._pipe, far = self._context.Pipe()
        self._process = self._context.Process(target=_serve, args=(self.function, far), daemon=True)
        self._process.start()
        far.close()
        self._pipe.recv()  # imported: what comes now is the call's own time

    def _stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._pipe.close()
            self._process = None

    def __enter__(self) -> Watched:
        return self

    def __exit__(self, *_: Any) -> None:
        self._stop()


def _serve(function: Callable[..., Any], pipe: Any) -> None:
    pipe.send("ready")
    while True:
        try:
            arguments = pipe.recv()
        except EOFError:
            return
        pipe.send(function(*arguments))
