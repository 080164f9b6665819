"""A batch holds no more memory after its hundredth drape than after its tenth.

A small sheet falls for one step, over and over in a sweep, each time in a process of its own, as ``run`` does it. What
is measured is the process that hands the drapes out; those of the drapes end with them.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from taichi_tryon.batch.course import run_batch
from taichi_tryon.batch.drape import Program
from taichi_tryon.batch.plan import plan
from taichi_tryon.bench.record import Record, absolute, told
from taichi_tryon.bench.simulate import scene_path
from taichi_tryon.errors import RunError
from taichi_tryon.scene.sweep import spread

SCENE = "hang.yaml"
SMALL = ("mesh.edge_length_mm=100", "drape.duration_s=0.0166")
# by then everything has been loaded that a batch needs
FIRST = 10
LIMIT_MB = 2.0
"""What 100 reports take, kept for the table, and the allocator's own rounding."""


def records(quick: bool) -> Iterator[Record]:
    count, begin = 20 if quick else 100, time.perf_counter()
    densities = [round(0.02 + 0.0001 * number, 4) for number in range(count)]
    variants = spread((*SMALL, f"garments.0.fabric.weight_gf_per_cm2={densities}"))
    drapes, held = plan([scene_path(SCENE)], variants), []
    with TemporaryDirectory() as folder:
        program = Program(options=("--arch", "cpu"))
        batch = run_batch(drapes, Path(folder), program=program, say=lambda line: held.append(resident_mb()))
    if batch.exit_code:
        reason = next(row.report["reason"] for row in batch.rows if row.status != "finished")
        raise RunError(f"memory: a drape failed: {reason}")
    wall = time.perf_counter() - begin
    yield told("memory", {"drapes": count}, "held", "MB", held[-1], wall)
    grown = held[-1] - held[FIRST - 1]
    yield absolute("memory", {"drapes": count, "since": FIRST}, "growth", "MB", grown, 0.0, LIMIT_MB, wall)


def resident_mb() -> float:
    """Memory that this process holds, from proc(5)'s statm."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
