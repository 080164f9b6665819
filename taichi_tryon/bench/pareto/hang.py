"""A square sheet, held by two corners, swings down from the level.

Reference: our own solution with TR-BDF2, 1/480 s and tight tolerances (``reference.py``), on the same mesh. It is a
stiff pendulum with waves of stretch in it: a step of 1/60 s errs by centimetres.
With ``--peers``, MuJoCo solves the same mesh with the same masses: as the isotropic fabric, which both can express, and
as our measured one, for which it takes the mean of warp and weft and 15 times the shear rigidity.
Limit: at no greater error, ten times faster than any of its settings.
"""

from __future__ import annotations

from collections.abc import Iterator

from taichi_tryon.bench.pareto import falls, peer
from taichi_tryon.bench.pareto.falls import Run
from taichi_tryon.bench.pareto.peer import PeerSetting
from taichi_tryon.bench.pareto.problem import Problem
from taichi_tryon.bench.pareto.reference import PER_SECOND, QUICK_PER_SECOND, distance, falling
from taichi_tryon.bench.record import Record

SIDE = 0.5
# vertices along a side, and how long they swing [s]: the finest take minutes a second
SECONDS = {32: 2.0, 64: 1.0, 128: 0.5}
TIMES_FASTER = 10.0


def problem(count: int, fabric: str, seconds: float) -> Problem:
    """The sheet of so many vertices along a side."""
    return Problem("hang", SIDE, count, fabric, seconds, compared=seconds)


def records(quick: bool, peers: bool = False) -> Iterator[Record]:
    """Every setting on every mesh and fabric; quick: one small mesh, half a second."""
    if peers:
        peer.require()
    per_second = QUICK_PER_SECOND if quick else PER_SECOND
    settings, others = (falls.FEW, falls.FEW_PEERS) if quick else (falls.SETTINGS, falls.PEERS)
    for count, seconds in ({12: 0.5} if quick else SECONDS).items():
        for fabric in ("isotropic", "table1") if peers else ("table1",):
            runs: list[Run] = []
            of = problem(count, fabric, seconds)
            yield from falls.records(of, settings, others if peers else (), per_second, runs)
            if peers and fabric == "isotropic":
                yield from faster(of, runs, per_second)


def faster(of: Problem, runs: list[Run], per_second: int) -> Iterator[Record]:
    """Against each of a peer's settings: those of our own that err by no more."""
    right = falling(of, per_second).track.positions
    found = [(setting, distance(track.positions, right), track) for setting, track in runs]
    for setting, error, track in found:
        if isinstance(setting, PeerSetting):
            as_exact = [mine for own, least, mine in found if not isinstance(own, PeerSetting) and least <= error]
            yield from falls.faster(of, setting, track, as_exact, TIMES_FASTER)
