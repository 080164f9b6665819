"""What the limits against MuJoCo ask, and no more: the sheet on a ball and the hanging one with the cheapest of our
settings that are exact enough, and with those of MuJoCo's that they are held against.

``sphere.py`` and ``hang.py`` say what is solved and what is demanded; they run every setting, which takes hours. The
sheet on the ball needs no converged solution here, as strain and depth are judged by themselves.
"""

from __future__ import annotations

from collections.abc import Iterator

from taichi_tryon.bench.pareto import compare, falls, hang, peer, sphere
from taichi_tryon.bench.pareto.falls import Run, solver
from taichi_tryon.bench.pareto.ours import Setting
from taichi_tryon.bench.pareto.peer import PeerSetting
from taichi_tryon.bench.pareto.reference import PER_SECOND, QUICK_PER_SECOND
from taichi_tryon.bench.record import Record, told

ONE_ITERATION = {**falls.COARSE, "max_newton_inside": 1}
DRAPES = (solver(**ONE_ITERATION), solver(**ONE_ITERATION, linear_tolerance=0.06))
DRAPED, QUICK_DRAPED = 2.0, 0.5
"""How long a sheet falls and drapes [s]."""
PEERS = tuple(PeerSetting(steps) for steps in sphere.TIMES_FASTER)


def motion(step_s: float, **values: float | str) -> Setting:
    """A fall with the scheme for motion and the peer's law of bending."""
    of = solver(scheme="tr_bdf2", step_s=step_s, **values)
    return Setting(f"bending constant, {of.name}", ("mesh.bending=constant", *of.overrides))


FALLS = {
    32: ((motion(1 / 30), motion(1 / 60), solver(scheme="tr_bdf2")), (PeerSetting(5), PeerSetting(20))),
    64: ((motion(1 / 30), motion(1 / 60), solver(scheme="tr_bdf2")), (PeerSetting(5), PeerSetting(20))),
    128: ((motion(1 / 30), solver(**ONE_ITERATION)), (PeerSetting(5),)),
}
"""Our settings and the peer's by vertices along a side of the hanging sheet."""
QUICK_FALLS = {12: ((motion(1 / 60),), (PeerSetting(5),))}
FALLS_S = 0.5


def records(quick: bool, peers: bool = False) -> Iterator[Record]:
    """The sheets on the ball, then the hanging ones, from small to large."""
    if peers:
        peer.require()
    for count in (20,) if quick else sphere.COUNTS:
        of = sphere.problem(count, "table1", QUICK_DRAPED if quick else DRAPED)
        runs: list[Run] = []
        for setting, where, track in falls.tracks(of, (*DRAPES, *(PEERS if peers else ()))):
            if track is None:
                yield told(of.scene, where, "failed", "1", 1, 0.0)
                continue
            runs.append((setting, track))
            yield from compare.times(of.scene, where, track, falls.UNIT)
            yield from compare.state(of.scene, where, track)
        yield from sphere.faster(of, runs)
    per_second = QUICK_PER_SECOND if quick else PER_SECOND
    for count, (settings, others) in (QUICK_FALLS if quick else FALLS).items():
        runs = []
        of = hang.problem(count, "isotropic", FALLS_S)
        yield from falls.records(of, settings, others if peers else (), per_second, runs)
        yield from hang.faster(of, runs, per_second)
