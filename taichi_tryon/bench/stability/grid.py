"""Scenes against stress: each cell of the grid is a run in a process of its own, which holds or does not.

A cell holds where its run comes to its end, or settles where it is to, with finite positions and bounded energy after
every step; where physics may say no, it may also end as failed, with a reason and the last good state kept.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator

from taichi_tryon.bench.record import Record, at_least, told
from taichi_tryon.bench.simulate import scene_path
from taichi_tryon.bench.stability.cell import Outcome, run_cell
from taichi_tryon.bench.stability.stresses import Cell, cells
from taichi_tryon.bench.stability.watch import Crashed, Hung, Watched

LIMIT_S = 600.0


def records(quick: bool) -> Iterator[Record]:
    """A record a cell, then the sums."""
    scene_path("hang.yaml")  # raises where configs is not here
    counts, begin = Counter(), time.perf_counter()
    for cell in cells(quick):
        start = time.perf_counter()
        outcome = tried(cell)
        counts["tried"] += 1
        counts["held"] += outcome.held
        counts["refused_with_reason"] += outcome.kind == "refused"
        where = {"scene": cell.scene, "stress": cell.stress, "level": cell.level, "outcome": outcome.kind}
        where |= {"energy_share": f"{outcome.energy_share:.3g}", "reason": outcome.reason}
        yield at_least("grid", where, "held", "1", outcome.held, 1, time.perf_counter() - start)
    for quantity in ("tried", "held", "refused_with_reason"):
        yield told("grid", {}, f"cells_{quantity}", "1", counts[quantity], time.perf_counter() - begin)


def tried(cell: Cell) -> Outcome:
    """The outcome of a cell."""
    with Watched(run_cell, LIMIT_S) as watched:
        try:
            return watched(cell.scene, cell.change)
        except Hung as fault:
            return Outcome("hung", str(fault))
        except Crashed as fault:
            return Outcome("crashed", str(fault))
