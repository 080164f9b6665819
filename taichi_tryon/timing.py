"""Where the time goes: wall-clock seconds by stage, as the report states them."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager

from taichi_tryon import STARTED

STAGES = ("startup", "compile", "body", "mesh", "dressing", "solve", "contact", "output")


class Stopwatch:
    """Adds up the time spent in each stage; a stage inside another is taken out of the outer one, unless the outer one
    is to be counted ``whole``."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self._open: list[float] = []
        self._whole = False

    @contextmanager
    def __call__(self, stage: str, whole: bool = False) -> Iterator[None]:
        if self._whole:
            yield
            return
        begin = time.perf_counter()
        self._open.append(0.0)
        self._whole = whole
        try:
            yield
        finally:
            self._whole = False
            spent = time.perf_counter() - begin
            self.seconds[stage] += spent - self._open.pop()
            if self._open:
                self._open[-1] += spent

    def timings(self) -> dict[str, float]:
        """Seconds by stage, and the total since the program started."""
        stages = {stage: round(self.seconds[stage], 4) for stage in STAGES}
        return {"total": round(time.perf_counter() - STARTED, 4), **stages}
