"""Memory of a batch: what the process holds is measured, and a batch that keeps what it need not is seen."""

import mmap
from pathlib import Path

import numpy as np
import pytest

from taichi_tryon.batch.course import Batch
from taichi_tryon.batch.table import Row
from taichi_tryon.bench.stability import memory
from taichi_tryon.errors import RunError

ROOT = Path(__file__).parents[3]


def touched(mb: int) -> mmap.mmap:
    """So much memory that the system has to hand out: an array could be where another one has been."""
    held = mmap.mmap(-1, mb * 1_000_000)
    np.frombuffer(held, np.uint8)[:] = 1
    return held


def test_what_a_process_holds_is_what_it_has_touched():
    before = memory.resident_mb()
    kept = touched(32)
    assert memory.resident_mb() - before == pytest.approx(len(kept) / 1e6, rel=0.2)


@pytest.mark.parametrize(("kept_mb", "passes"), [(0, True), (1, False)])
def test_a_batch_that_keeps_something_of_each_drape_is_seen(monkeypatch, kept_mb, passes):
    monkeypatch.chdir(ROOT)
    kept = []

    def run_batch(drapes, output, program, say):
        assert len(drapes) == len({drape.name for drape in drapes}) == 20
        for drape in drapes:
            kept.extend(touched(1) for _ in range(kept_mb))
            say(drape.name)
        return Batch([Row(drape, {"status": "finished", "reason": ""}) for drape in drapes], [], False)

    monkeypatch.setattr(memory, "run_batch", run_batch)
    _, growth = memory.records(quick=True)
    assert growth.passes == passes and growth.value == pytest.approx(10 * kept_mb, abs=1)


def test_a_drape_that_fails_is_no_measurement(monkeypatch):
    monkeypatch.chdir(ROOT)

    def run_batch(drapes, output, program, say):
        return Batch([Row(drapes[0], {"status": "failed", "reason": "no disk"})], [], False)

    monkeypatch.setattr(memory, "run_batch", run_batch)
    with pytest.raises(RunError, match="no disk"):
        next(memory.records(quick=True))
