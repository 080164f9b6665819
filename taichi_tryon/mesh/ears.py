"""Triangles in corners of panels that cannot be sewn as they are."""

from __future__ import annotations

import numpy as np

from taichi_tryon.mesh.triangulate import signed_areas


def open_crowded_ears(points: np.ndarray, triangles: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Flip the inner sides of corner triangles where sewing would put four triangles on one edge.

    A triangle that fills a corner of a panel (an ear) has its inner side between two boundary points. Where both sides
    of the corner are sewn to the same other panel, as in two panels sewn all round, the inner sides of both ears become
    one edge. Flipped, one of them runs from the corner into its panel instead.

    ``points`` (p, 2) [m] and ``triangles`` (t, 3) of all panels in the flat, ``vertices`` (p,) the welded vertex of
    each point. Returns triangles of the same number and sense; what no flip can mend is left to the check of the mesh.
    """
    triangles = triangles.copy()
    while (flip := _find_flip(points, triangles, vertices)) is not None:
        first, second, pair = flip
        triangles[[first, second]] = pair
    return triangles


def _find_flip(points: np.ndarray, triangles: np.ndarray, vertices: np.ndarray):
    """The first inner side to flip: its two triangles and what replaces them; None where there is none."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    _, group, uses = np.unique(np.sort(vertices[sides], axis=1), axis=0, return_inverse=True, return_counts=True)
    group = group.ravel()
    for crowded in np.flatnonzero(uses > 2):
        for side in np.flatnonzero(group == crowded):
            here = np.flatnonzero((sides == sides[side, ::-1]).all(axis=1))
            if len(here) != 1:
                continue  # a side on the boundary has no partner within its panel
            (a, b), c, d = sides[side], _third(triangles, side), _third(triangles, here[0])
            pair = np.array([(c, a, d), (c, d, b)])
            is_ear = np.count_nonzero(triangles == c) == 1
            if is_ear and (signed_areas(points, pair) > 0).all():
                return side // 3, here[0] // 3, pair
    return None


def _third(triangles: np.ndarray, side: int) -> int:
    """The corner opposite to a side, counted as 3 * triangle + corner it starts from."""
    return triangles[side // 3, (side + 2) % 3]
