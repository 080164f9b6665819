"""Where limbs run into each other: cloth in the crease between them has no room outside both.

Groups that are joined share balls, so that where their skins cross (armpit, hip, crotch) these are nearly one. Where
limbs run into each other their skins cross at a sharp crease.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from taichi_tryon.body.density import density, gradient
from taichi_tryon.body.model import Balls

# a spot is looked at so far around, at points so far apart [m]
REACH, SPACING = 0.03, 0.003
# the cosine of the angle between two skins' normals, below which their crease is sharp
SHARP = 0.5


def meeting(balls: Balls, at: np.ndarray) -> tuple[int, int] | None:
    """The two groups that run into each other around a point (3,) [m]; None where none do."""
    steps = np.arange(-REACH, REACH + SPACING / 2, SPACING)
    points = at + np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    groups = [(group,) for group in range(balls.membership.shape[1])]
    points = points[(np.array([density(balls, points, group) for group in groups]) > 1).sum(axis=0) > 1]
    slopes = np.array([gradient(balls, points, group) for group in groups])
    steep = np.maximum(np.linalg.norm(slopes, axis=2), 1e-9)
    depths = (np.array([density(balls, points, group) for group in groups]) - 1) / steep
    # as near to the skin as the points lie: what crosses deeper in is not seen
    seen = (depths < SPACING).all(axis=0)
    for one, other in combinations(range(len(groups)), 2):
        cosine = (slopes[one] * slopes[other]).sum(axis=1) / (steep[one] * steep[other])
        if (seen & (depths[[one, other]] > 0).all(axis=0) & (cosine < SHARP)).any():
            return one, other
    return None
