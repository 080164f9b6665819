"""A square sheet falls onto a ball and drapes it.

Reference: our own solution with TR-BDF2, 1/480 s and tight tolerances (``reference.py``), on the same mesh, until the
flanks have come down; later the folds decide, of which many are possible. At the end, draped, the strain and the depth
in the ball are judged by themselves.
With ``--peers``, MuJoCo drapes the same mesh; see ``hang.py``. Limits: with strains below 0.5 % and nothing inside the
ball, ten times faster than MuJoCo at 5 steps a frame, its cheapest setting as exact as that, and 2.5 times faster than
at 1 step, which is not.
"""

from __future__ import annotations

from collections.abc import Iterator

from taichi_tryon.bench.pareto import falls, peer
from taichi_tryon.bench.pareto.falls import Run
from taichi_tryon.bench.pareto.ours import Setting
from taichi_tryon.bench.pareto.peer import PeerSetting
from taichi_tryon.bench.pareto.problem import Problem
from taichi_tryon.bench.pareto.reference import PER_SECOND, QUICK_PER_SECOND
from taichi_tryon.bench.pareto.track import Track
from taichi_tryon.bench.record import Record
from taichi_tryon.units import MM

SIDE, BALL = 1.0, 0.25
COUNTS = (50, 100)
# greatest strain, and depth in the ball [m], of a drape that counts as exact
STRAIN, DEPTH = 0.005, 0.01 * MM
# by the steps a frame of MuJoCo's CG
TIMES_FASTER = {1: 2.5, 5: 10.0}
PEERS = tuple(PeerSetting(steps) for steps in (1, 2, 5, 10))


def problem(count: int, fabric: str, seconds: float = 3.0) -> Problem:
    """The sheet of so many vertices along a side."""
    return Problem("drop_on_sphere", SIDE, count, fabric, seconds, ball=BALL)


def records(quick: bool, peers: bool = False) -> Iterator[Record]:
    """Every setting on both meshes and fabrics; quick: one small mesh, half a second."""
    if peers:
        peer.require()
    per_second = QUICK_PER_SECOND if quick else PER_SECOND
    settings, others = (falls.FEW[:3], falls.FEW_PEERS) if quick else (falls.SETTINGS, PEERS)
    for count in (20,) if quick else COUNTS:
        for fabric in ("isotropic", "table1") if peers and not quick else ("table1",):
            runs: list[Run] = []
            of = problem(count, fabric, 0.5) if quick else problem(count, fabric)
            yield from falls.records(of, settings, others if peers else (), per_second, runs)
            if peers and fabric == "table1":
                yield from faster(of, runs)


def faster(of: Problem, runs: list[Run]) -> Iterator[Record]:
    """Against each of a peer's settings: those of our own that are exact."""
    exact = [track for setting, track in runs if isinstance(setting, Setting) and is_exact(track)]
    for setting, track in runs:
        if isinstance(setting, PeerSetting):
            yield from falls.faster(of, setting, track, exact, TIMES_FASTER.get(setting.steps))


def is_exact(track: Track) -> bool:
    """Whether a drape may be compared."""
    return bool(track.strain[-1] <= STRAIN and track.depth[-1] <= DEPTH)
