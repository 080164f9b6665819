"""The course of a batch: drapes are handed to workers, here or on a cluster, and their reports gathered."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor, as_completed, wait
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from taichi_tryon.batch import table
from taichi_tryon.batch.cluster import cluster
from taichi_tryon.batch.drape import PATIENCE, Drape, Program, Stop, clear, ended, run_drape
from taichi_tryon.batch.table import Row
from taichi_tryon.output.folder import require_writable
from taichi_tryon.run import stop_by_signal

WAITING = {"status": "waiting", "reason": "has not been run yet"}


@dataclass(frozen=True)
class Workers:
    """Who runs the drapes: ``jobs`` processes at a time here, or those of the Dask ``scheduler`` at this address."""

    jobs: int = 1
    scheduler: str | None = None


@dataclass(frozen=True)
class Batch:
    """How a batch ended."""

    rows: list[Row]
    files: list[Path]
    stopped: bool

    @property
    def exit_code(self) -> int:
        """0 where all went well, 130 where it was stopped, else 3."""
        if self.stopped:
            return 130
        return 0 if all(row.status in ("settled", "finished") for row in self.rows) else 3


def run_batch(
    drapes: Sequence[Drape],
    output: Path,
    workers: Workers = Workers(),  # noqa: B008
    *,
    program: Program = Program(),  # noqa: B008
    resume: bool = False,
    say: Callable[[str], None] = lambda line: None,
) -> Batch:
    """Run drapes, each in its folder below ``output``, and write the table of all; ``say`` gets a line a drape.

    One that fails stops no other. resume: those that have ended in ``output`` are not repeated, and those that were cut
    off go on from their checkpoints. Ctrl-C and SIGTERM stop those that run, as they stop a single run, and begin no
    more. Raises InputError where ``output`` cannot be written or there is no such scheduler, RunError where the disk
    refuses the table.
    """
    require_writable(output)
    output.mkdir(parents=True, exist_ok=True)
    reports: dict[str, dict] = {}
    with stop_by_signal() as signals, _executor(workers, len(drapes)) as (executor, stop, environment):
        program = Program(program.start, program.options, {**environment, **program.environment})
        futures: dict[Future, Drape] = {}
        try:
            for drape in drapes:
                folder = (output / drape.name).absolute()
                if not resume:
                    clear(folder)
                elif report := ended(folder):
                    reports[drape.name] = report
                    continue
                futures[executor.submit(run_drape, drape, folder, program, stop)] = drape
            for future in as_completed(futures):
                drape = futures[future]
                reports[drape.name] = report = _report(future)
                say(f"{len(reports)} of {len(drapes)}: {drape.name}: {report['status']}: {report['reason']}")
        except KeyboardInterrupt:
            signals.gently = True  # once more changes nothing
            stop.set()
            done, _ = wait(futures, 2 * PATIENCE)
            reports |= {futures[future].name: _report(future) for future in done}
        stopped = stop.is_set()
    rows = [Row(drape, reports.get(drape.name, WAITING)) for drape in drapes]
    return Batch(rows, table.write(output, rows), stopped)


def _report(future: Future) -> dict:
    try:
        return future.result()
    except Exception as fault:  # of the cluster: a drape's own are in its report
        return {"status": "failed", "reason": f"its worker was lost: {type(fault).__name__}: {fault}"}


@contextmanager
def _executor(workers: Workers, count: int) -> Iterator[tuple[Executor, Stop, dict[str, str]]]:
    """Who takes drapes, the event that stops them, and what is set in their environment."""
    if workers.scheduler is not None:
        with cluster(workers.scheduler) as (executor, stop):
            yield executor, stop, {}
        return
    jobs = max(1, min(workers.jobs, count))
    share = max(1, len(os.sched_getaffinity(0)) // jobs)
    environment = {} if jobs == 1 else {"OMP_NUM_THREADS": os.environ.get("OMP_NUM_THREADS", str(share))}
    with ThreadPoolExecutor(jobs) as executor:
        yield executor, threading.Event(), environment
