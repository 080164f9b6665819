"""What is kept of a run, the same of every simulator: figures of each frame, positions at a moment, the time taken."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_tryon.bench.pareto.problem import FRAME, Problem
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.cloth.nodal import strains
from taichi_tryon.dressing.check import crossings
from taichi_tryon.output import maps


@dataclass(frozen=True)
class Track:
    """A run of nf frames, or, with nf = 1, a way to rest.

    lowest (nf,) [m]: height of the lowest vertex; strain (nf,): size of the strain along warp or weft below which 99 %
    of the triangles are; depth (nf,) [m]: of the deepest point inside the body; positions (nv, 3) [m]: at the moment
    that is compared. cpu_s and wall_s [s] were spent on so many ``frames``, the first step not counted; all of a way to
    rest counts as one.
    """

    positions: np.ndarray
    lowest: np.ndarray
    strain: np.ndarray
    depth: np.ndarray
    cpu_s: float
    wall_s: float
    frames: float
    crossings: np.ndarray | None = None


class Tracker:
    """Follows a cloth from where it starts through a problem; ``seen`` at any times, looked at once a frame."""

    def __init__(self, cloth: Cloth, positions: np.ndarray, velocities: np.ndarray, problem: Problem):
        self.cloth, self.problem = cloth, problem
        self._last = (0.0, positions, velocities)
        self._frame = 1
        self._figures: list[tuple[float, float, float]] = []
        self._crossings: list[int] = []
        self._positions = positions

    def seen(self, time: float, positions: np.ndarray, velocities: np.ndarray) -> None:
        """The cloth at a ``time`` [s] after the last one: positions, velocities (nv, 3). Frames between two times are
        on the cubic that has both ends' positions and velocities."""
        while self._frame * FRAME <= time + 1e-9:
            at = self._between(self._frame * FRAME, (time, positions, velocities))
            self._figures.append(self._look(at))
            if self.problem.layers:
                self._crossings.append(len(crossings(at, self.cloth.triangles)))
            if self._frame == round(self.problem.moment / FRAME):
                self._positions = at
            self._frame += 1
        self._last = (time, positions, velocities)

    def track(self, cpu_s: float, wall_s: float, seconds: float) -> Track:
        """What was seen, and the time spent on so many simulated ``seconds``."""
        counted = np.array(self._crossings) if self.problem.layers else None
        return Track(self._positions, *np.array(self._figures).T, cpu_s, wall_s, seconds / FRAME, counted)

    def _between(self, time: float, now: tuple[float, np.ndarray, np.ndarray]) -> np.ndarray:
        (t0, x0, v0), (t1, x1, v1) = self._last, now
        if abs(time - t1) < 1e-9:
            return x1
        h, s = t1 - t0, (time - t0) / (t1 - t0)
        ends = x0 + s**2 * (3 - 2 * s) * (x1 - x0)
        return ends + h * s * (1 - s) * ((1 - s) * v0 - s * v1)

    def _look(self, positions: np.ndarray) -> tuple[float, float, float]:
        ball = self.problem.ball
        depth = 0.0 if ball is None else max(0.0, ball - _nearest(positions[self.cloth.triangles]).min())
        return float(positions[:, 1].min()), stretched(positions, self.cloth), float(depth)


def stretched(positions: np.ndarray, cloth: Cloth) -> float:
    """Size of the strain below which 99 % of the triangles are, along warp or weft, whichever is greater."""
    found = maps.strains(strains(cloth, positions))
    return max(float(np.percentile(np.abs(found[f"strain_{way}_percent"]), 99)) for way in ("warp", "weft")) / 100


def _nearest(corners: np.ndarray) -> np.ndarray:
    """Distance (nt,) of each triangle, corners (nt, 3, 3), from the origin: to its plane where the foot lies inside,
    else to the nearest of its edges."""
    sides = np.roll(corners, -1, axis=1) - corners
    along = np.clip(-(corners * sides).sum(axis=2) / (sides**2).sum(axis=2), 0, 1)
    to_edges = np.linalg.norm(corners + along[..., None] * sides, axis=2).min(axis=1)
    normals = np.cross(sides[:, 0], sides[:, 1])
    share = (corners[:, 0] * normals).sum(axis=1) / (normals**2).sum(axis=1)
    foot = share[:, None] * normals
    inside = (np.cross(sides, foot[:, None] - corners) * normals[:, None]).sum(axis=2).min(axis=1) >= 0
    return np.where(inside, np.linalg.norm(foot, axis=1), to_edges)
