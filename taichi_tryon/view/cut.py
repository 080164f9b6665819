"""Woven triangles cut along the lines of their check: pieces of one colour, for renderers that colour vertices only.

The cut depends on material coordinates alone, so it is made once for a garment.
"""

from __future__ import annotations

import numpy as np

_NEAR = 1e-5  # of a stripe: a corner that near to a line is on it


def cut_along_lines(weave: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut triangles at whole values of both coordinates.

    Args:
        weave: (n, 3, 2) material coordinates in stripes.

    Returns:
        parent (m,) number of the triangle a piece belongs to, weights (m, 3, 3) barycentric coordinates of the
        piece's corners in it; the turning sense is kept and the pieces of a triangle cover it exactly once.
    """
    coordinates = np.asarray(weave, float)
    parent = np.arange(len(coordinates))
    weights = np.tile(np.eye(3), (len(coordinates), 1, 1))
    for axis in range(2):
        whole_parent, whole_weights = [parent[:0]], [weights[:0]]
        while len(parent):
            value = np.einsum("nij,nj->ni", weights, coordinates[parent, :, axis])
            line = np.floor(value.min(axis=1) + _NEAR) + 1
            crossed = value.max(axis=1) > line + _NEAR
            whole_parent.append(parent[~crossed])
            whole_weights.append(weights[~crossed])
            parent, weights = _split(parent[crossed], weights[crossed], value[crossed] - line[crossed, None])
        parent, weights = np.concatenate(whole_parent), np.concatenate(whole_weights)
    order = np.argsort(parent, kind="stable")
    return parent[order], weights[order]


def _split(parent: np.ndarray, weights: np.ndarray, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split each piece in three where ``distance`` (n, 3), with both signs in each row, is zero."""
    above = distance > 0
    # Turn the corners so that the one alone on its side comes first.
    lone = np.where(above.sum(axis=1) == 1, np.argmax(above, axis=1), np.argmin(above, axis=1))
    turn = (lone[:, None] + np.arange(3)) % 3
    rows = np.arange(len(parent))[:, None]
    (a, b, c), (da, db, dc) = weights[rows, turn].transpose(1, 0, 2), distance[rows, turn].T
    ab = a + (da / (da - db))[:, None] * (b - a)
    ac = a + (da / (da - dc))[:, None] * (c - a)
    pieces = [np.stack(corners, axis=1) for corners in ((a, ab, ac), (ab, b, c), (ab, c, ac))]
    return np.tile(parent, 3), np.concatenate(pieces)
