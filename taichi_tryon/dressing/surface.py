"""Ruled surfaces through a sequence of disks (paper, eqs. 4 to 6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_tryon.body.density import gap
from taichi_tryon.body.model import Balls
from taichi_tryon.dressing.disks import Disk

PUSHES = 12


@dataclass(frozen=True)
class RuledSurface:
    """Straight lines between points of equal theta on neighbouring disks; u counts the disks from 0."""

    disks: tuple[Disk, ...]

    def _between(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        k = np.clip(np.floor(u).astype(int), 0, len(self.disks) - 2)
        return k, (u - k)[:, None]

    def point(self, u: np.ndarray, t: np.ndarray) -> np.ndarray:
        """P(u, theta) = (1 - u) P_upper(theta) + u P_lower(theta) (eq. 6) at u (k,), shares of the way round t (k,)."""
        k, f = self._between(u)
        rims = np.array([disk.point(t) for disk in self.disks])
        i = np.arange(len(u))
        return (1 - f) * rims[k, i] + f * rims[k + 1, i]

    def axis(self, u: np.ndarray) -> np.ndarray:
        """Points (k, 3) between the disks' centres."""
        k, f = self._between(u)
        centers = np.array([disk.center for disk in self.disks])
        return (1 - f) * centers[k] + f * centers[k + 1]


def push_along_radius(
    points: np.ndarray, axis: np.ndarray, balls: Balls, groups: tuple[int, ...], clearance: float
) -> np.ndarray:
    """Points (k, 3); those nearer to the ``groups`` than ``clearance`` [m] move away from their ``axis`` points (k, 3).

    The distance to the body never exceeds the way to it along a ray, so stepping by it cannot jump over a limb.
    """
    points = points.copy()
    ray = points - axis
    ray /= np.maximum(np.linalg.norm(ray, axis=1), 1e-12)[:, None]
    near = np.arange(len(points))
    for _ in range(PUSHES):
        short = clearance - gap(balls, points[near], groups)
        near, short = near[short > 1e-5], short[short > 1e-5]
        if not len(near):
            break
        points[near] += short[:, None] * ray[near]
    return points
