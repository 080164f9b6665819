"""Calls that may hang or crash, in a process that is watched and replaced."""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing import get_context
from typing import Any


class Hung(Exception):
    """A call took longer than it may; its process was killed."""


class Crashed(Exception):
    """A call ended its process."""


class Watched:
    """Calls ``function`` in a process of its own, which lives on between calls; a context manager."""

    def __init__(self, function: Callable[..., Any], limit_s: float):
        self.function, self.limit_s = function, limit_s
        self._context, self._process, self._pipe = get_context("spawn"), None, None

    def __call__(self, *arguments: Any) -> Any:
        """The result for these arguments. Raises Hung or Crashed; the next call gets a new process."""
        if self._process is None:
            self._start()
        self._pipe.send(arguments)
        if not self._pipe.poll(self.limit_s):
            self._stop()
            raise Hung(f"longer than {self.limit_s:g} s")
        try:
            return self._pipe.recv()
        except EOFError:
            self._process.join()
            code = self._process.exitcode
            self._stop()
            raise Crashed(f"exit code {code}") from None

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
