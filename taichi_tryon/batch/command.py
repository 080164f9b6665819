"""``run`` with many scenes or a sweep: what is said of it on the terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from taichi_tryon.batch import table
from taichi_tryon.batch.course import Workers, run_batch
from taichi_tryon.batch.drape import Program
from taichi_tryon.batch.plan import plan
from taichi_tryon.scene.sweep import Variant


def run_many(
    scenes: Iterable[Path],
    variants: Iterable[Variant],
    output: Path,
    jobs: int,
    scheduler: str | None,
    options: tuple[str, ...],
    *,
    resume: bool,
    quiet: bool,
) -> int:
    """Run a batch, with ``options`` for each of its runs, and print how it went; the exit code."""
    drapes = plan(scenes, variants)

    def say(line: str) -> None:
        if not quiet:
            print(line, file=sys.stderr, flush=True)

    program = Program(options=options)
    batch = run_batch(drapes, output, Workers(jobs, scheduler), program=program, resume=resume, say=say)
    found = ", ".join(f"{count} {status}" for status, count in table.counts(batch.rows).items())
    print(f"{len(batch.rows)} drapes: {found}", *batch.files, sep="\n")
    return batch.exit_code
