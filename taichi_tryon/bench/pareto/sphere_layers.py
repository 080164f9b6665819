"""The sheet that falls onto a ball, with contact of cloth with cloth, which its folds need.

With ``--peers``, MuJoCo drapes the same mesh with its flex's own self-contact; see ``hang.py``. Pairs of triangles that
cross are counted after every frame, its own and ours by the same test (``dressing/check.py``). No reference: where the
folds come to lie, many ways are right; judged are crossings, and strain and depth in the ball at the end, as in
``sphere.py``. Limits: no crossing in any frame, and five times faster than MuJoCo at 5 steps a frame, where its strain
at the end comes near to 0.5 %; at 1 step it is seven times as large.
"""

from __future__ import annotations

from collections.abc import Iterator

from taichi_tryon.bench.pareto import compare, falls, peer, sphere
from taichi_tryon.bench.pareto.falls import AS_IS, COARSE, solver
from taichi_tryon.bench.pareto.ours import Setting
from taichi_tryon.bench.pareto.peer import PeerSetting
from taichi_tryon.bench.pareto.problem import Problem
from taichi_tryon.bench.pareto.track import Track
from taichi_tryon.bench.record import Record, absolute, told

CASE = "sphere_layers"
SETTINGS = (AS_IS, solver(**COARSE))
# by the steps a frame of MuJoCo's CG
TIMES_FASTER = {1: None, 5: 5.0}
COUNT, QUICK = (50, 3.0), (20, 1.0)
"""Vertices along a side, and how long it falls [s]."""


def problem(count: int, seconds: float) -> Problem:
    """The sheet of so many vertices along a side."""
    return Problem("drop_on_sphere", sphere.SIDE, count, "table1", seconds, ball=sphere.BALL, layers=True)


def records(quick: bool, peers: bool = False) -> Iterator[Record]:
    """Our settings and the peer's on one mesh; quick: a small one, for a second."""
    if peers:
        peer.require()
    of = problem(*(QUICK if quick else COUNT))
    runs = []
    others = [PeerSetting(steps) for steps in TIMES_FASTER] if peers else []
    for setting, where, track in falls.tracks(of, (*SETTINGS, *others)):
        own = isinstance(setting, Setting)
        if track is None:
            yield absolute(CASE, where, "failed", "1", 1, 0, 0 if own else None, 0.0)
            continue
        runs.append((setting, track))
        yield from figures(where, track, own)
    # a coarse mesh is not exact, and its times are not judged
    uncrossed = [track for setting, track in runs if isinstance(setting, Setting) and not track.crossings.any()]
    good = [track for track in uncrossed if quick or sphere.is_exact(track)]
    for setting, track in runs:
        if isinstance(setting, PeerSetting):
            yield from falls.faster(of, setting, track, good, None if quick else TIMES_FASTER[setting.steps], CASE)


def figures(where: dict, track: Track, own: bool) -> Iterator[Record]:
    """Times, crossings, strain and depth of a run; only our own crossings are judged."""
    wall = float(track.wall_s)
    yield from compare.times(CASE, where, track, falls.UNIT)
    worst = track.crossings.max()
    yield absolute(CASE, where, "crossing_triangle_pairs_worst_frame", "1", worst, 0, 0 if own else None, wall)
    yield told(CASE, where, "crossing_triangle_pairs_at_end", "1", track.crossings[-1], wall)
    yield from compare.state(CASE, where, track)
