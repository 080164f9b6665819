"""From tracks to records: what a setting costs, and what it gets for it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from taichi_tryon.bench.pareto.reference import Reference, distance
from taichi_tryon.bench.pareto.track import Track
from taichi_tryon.bench.record import Record, absolute, told

FALL = 2.0
"""How far [% of the whole fall] the sheet's lowest point may be from where it should be, at any time of it."""
RISE = 0.01
COSTS = {"cpu": "cpu_ms", "wall": "wall_ms"}


def cost(track: Track, clock: str = "cpu") -> float:
    """Milliseconds a frame, or of a way to rest, by the ``clock`` "cpu" (of all threads) or "wall"."""
    return 1000 * float(getattr(track, f"{clock}_s") / track.frames)


def figures(case: str, where: Mapping, track: Track, reference: Reference, unit: str) -> Iterator[Record]:
    """Times (in the ``unit``) and errors of a run."""
    wall = float(track.wall_s)
    error = 1000 * distance(track.positions, reference.track.positions)
    yield from times(case, where, track, unit)
    yield told(case, where, "position_error", "mm", error, wall)
    yield from state(case, where, track)


def times(case: str, where: Mapping, track: Track, unit: str) -> Iterator[Record]:
    """What a run takes, in the ``unit``."""
    for clock, name in COSTS.items():
        yield told(case, where, name, unit, cost(track, clock), float(track.wall_s))


def state(case: str, where: Mapping, track: Track) -> Iterator[Record]:
    """Strain and depth in the body, which need no converged solution."""
    wall = float(track.wall_s)
    yield told(case, where, "strain_p99_at_end", "%", 100 * track.strain[-1], wall)
    yield told(case, where, "strain_p99_worst_frame", "%", 100 * track.strain.max(), wall)
    yield told(case, where, "penetration_at_end", "mm", 1000 * track.depth[-1], wall)
    yield told(case, where, "penetration_worst_frame", "mm", 1000 * track.depth.max(), wall)


def fall(case: str, where: Mapping, track: Track, reference: Reference, judged: bool) -> Record:
    """How far the lowest point is from the converged one at any time of the converged fall, in parts of it."""
    frames = min(len(track.lowest), fall_ends(reference.track.lowest))
    right = reference.track.lowest[:frames]
    away = 100 * np.abs(track.lowest[:frames] - right).max() / np.ptp(right)
    return absolute(
        case, where, "lowest_point", "% of the fall", away, 0.0, FALL if judged else None, float(track.wall_s)
    )


def fall_ends(lowest: np.ndarray) -> int:
    """How many frames pass until the lowest point rises again, by RISE of its fall: from then on a sheet swings, and
    where it is at a moment depends on how it flapped before."""
    rises = lowest > np.minimum.accumulate(lowest) + RISE * np.ptp(lowest)
    return int(np.argmax(rises)) if rises.any() else len(lowest)


def doubt(case: str, where: Mapping, reference: Reference) -> Record:
    """What the converged solution is itself uncertain by."""
    wall = float(reference.track.wall_s)
    return told(case, where, "converged_to", "mm", 1000 * reference.doubt, wall)
