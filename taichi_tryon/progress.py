"""What a long run says of its progress, and how a terminal shows it."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

PLAIN_INTERVAL = 5.0
"""Seconds between two lines where the output is not a terminal."""


class Report(Protocol):
    def __call__(self, phase: str, fraction: float, note: str = "") -> None:
        """Tell how far a phase has come, 0 to 1 (less than before where an estimate was wrong), and a few words."""


def silent(phase: str, fraction: float, note: str = "") -> None:
    """The report that says nothing."""


class TerminalProgress:
    """Shows reports on stderr: a bar for each phase with time left on a terminal, else a line every few seconds.

    A context manager and a ``Report``.
    """

    def __init__(self) -> None:
        self._bars: Progress | None = None
        self._tasks: dict[str, TaskID] = {}
        self._last_phase: str | None = None
        self._last_line = 0.0
        if sys.stderr.isatty():
            columns = ("{task.description:<10}", BarColumn(), "{task.percentage:>3.0f} %", TimeElapsedColumn())
            left = (TextColumn("left"), TimeRemainingColumn(), TextColumn("{task.fields[note]}", markup=False))
            self._bars = Progress(*columns, *left, console=Console(stderr=True))

    def __enter__(self) -> TerminalProgress:
        if self._bars:
            self._bars.start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, traceback: TracebackType | None) -> None:
        if self._bars:
            self._bars.stop()

    def __call__(self, phase: str, fraction: float, note: str = "") -> None:
        fraction = min(max(fraction, 0.0), 1.0)
        if self._bars:
            self._show_bar(self._bars, phase, fraction, note)
        else:
            self._print_line(phase, fraction, note)
        self._last_phase = phase

    def _show_bar(self, bars: Progress, phase: str, fraction: float, note: str) -> None:
        if phase != self._last_phase and self._last_phase in self._tasks:
            bars.update(self._tasks[self._last_phase], completed=1.0)
        if phase not in self._tasks:
            self._tasks[phase] = bars.add_task(phase, total=1.0, note=note)
        bars.update(self._tasks[phase], completed=fraction, note=note)

    def _print_line(self, phase: str, fraction: float, note: str) -> None:
        now = time.monotonic()
        if phase != self._last_phase or now - self._last_line >= PLAIN_INTERVAL:
            print(f"{phase}: {100 * fraction:.0f} % {note}".rstrip(), file=sys.stderr, flush=True)
            self._last_line = now
