"""Would a sheet that starts in the body come out of it on one side?

Contact takes each point of the cloth out of the body by the shortest way. Where the points of one triangle would leave
through skins that face away from each other, the cloth would be left with a limb in it.
"""

from __future__ import annotations

import numpy as np

from taichi_tryon.body.density import closest, density
from taichi_tryon.body.model import Balls
from taichi_tryon.dressing.check import unique_edges


def parted(positions: np.ndarray, triangles: np.ndarray, balls: Balls) -> tuple[np.ndarray, np.ndarray]:
    """Ids (k,) of the ``triangles`` (nt, 3) in the body whose corners, edge midpoints and centroid would not leave it
    on one side, the deepest first, and how deep [m] they are; ``positions`` (nv, 3) [m]."""
    edges, of_triangle = unique_edges(triangles)
    points = np.concatenate([positions, positions[edges].mean(axis=1), positions[triangles].mean(axis=1)])
    first, nt = len(positions) + len(edges), len(triangles)
    samples = np.column_stack([triangles, len(positions) + of_triangle, first + np.arange(nt)])
    inside = np.flatnonzero((density(balls, points) > 1)[samples].any(axis=1))
    asked = np.unique(samples[inside])
    gap, _, normal = closest(balls, points[asked])
    which = np.searchsorted(asked, samples[inside])
    # where nothing reaches the normal is 0: such a point parts from none
    apart = (np.einsum("tai,tbi->tab", normal[which], normal[which]) < 0).any(axis=(1, 2))
    depth = -gap[which[apart]].min(axis=1, initial=np.inf)
    order = np.argsort(-depth, kind="stable")
    return inside[apart][order], depth[order]
