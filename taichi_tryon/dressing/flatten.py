"""One-to-one map of a flat panel to the rectangle of normalised cylinder coordinates (u, theta) (paper, 5.2).

The paper forces a panel of any outline onto a simple surface by a method of Okabe et al. (1988). Here the map is
harmonic with mean-value weights (Floater 2003) and a boundary fixed on a rectangle: positive weights and a convex
boundary make it one-to-one (Tutte 1963, Floater 1997). A second, piecewise linear map of u alone then lays the panel's
inner lines on their disks; it rises everywhere, so the map stays one-to-one.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import splu

from taichi_tryon.errors import DressingError


def mean_value_weights(triangles: np.ndarray, corners: np.ndarray, n: int):
    """Sparse (n, n) matrix of positive weights w_ij = (tan(a/2) + tan(b/2)) / |x_i - x_j|.

    ``triangles`` (m, 3) vertex ids, ``corners`` (m, 3, 2) their flat shape [m] (any scale), given apart so that
    a panel with a closed dart can be mapped. a and b are the angles at i beside edge ij.
    """
    rows, cols, values = [], [], []
    for k in range(3):
        i, j, m = triangles[:, k], triangles[:, (k + 1) % 3], triangles[:, (k + 2) % 3]
        a, b = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        la, lb = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
        sine = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        half = sine / (la * lb + (a * b).sum(axis=1))  # tan of half the angle
        rows += [i, i]
        cols += [j, m]
        values += [half / la, half / lb]
    return coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(cols))), shape=(n, n)).tocsr()


def harmonic(weights, fixed: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Each free value is the weighted mean of its neighbours'; ``values`` (k, d) hold at vertices ``fixed`` (k,)."""
    n = weights.shape[0]
    free = np.setdiff1d(np.arange(n), fixed)
    result = np.zeros((n, values.shape[1]))
    result[fixed] = values
    if len(free):
        rows = weights[free]
        matrix = diags(np.asarray(rows.sum(axis=1)).ravel()) - rows[:, free]
        result[free] = splu(matrix.tocsc()).solve(rows[:, fixed] @ values)
    return result


def locate(points: np.ndarray, corners: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (k, d) at flat ``points`` (k, 2) by linear interpolation in triangles ``corners`` (m, 3, 2) that carry
    ``values`` (m, 3, d); nan outside all of them."""
    origin = corners[:, 0]
    e1, e2 = corners[:, 1] - origin, corners[:, 2] - origin
    det = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    d = points[:, None] - origin
    b1 = (d[..., 0] * e2[:, 1] - d[..., 1] * e2[:, 0]) / det
    b2 = (e1[:, 0] * d[..., 1] - e1[:, 1] * d[..., 0]) / det
    inside = np.minimum(np.minimum(b1, b2), 1 - b1 - b2)
    best = inside.argmax(axis=1)
    k = np.arange(len(points))
    b1, b2 = b1[k, best, None], b2[k, best, None]
    result = (1 - b1 - b2) * values[best, 0] + b1 * values[best, 1] + b2 * values[best, 2]
    result[inside[k, best] < -1e-6] = np.nan
    return result


def remap_rows(rectangle: np.ndarray, rows: list[np.ndarray], panel: str, disks: list[str]) -> np.ndarray:
    """Heights u (n,) in which the curve ``rows[k]`` (p, 2) of (v, t) points has u = k + 1; errors name ``disks``.

    For each t, u is the piecewise linear, rising function of v through (0, 0), (row k at t, k + 1), .., (1, rows + 1).
    """
    v, t = rectangle.T
    levels = [np.zeros_like(v)]
    for row, disk in zip(rows, disks[1:-1], strict=True):
        order = np.argsort(row[:, 1], kind="stable")
        levels.append(np.interp(t, row[order, 1], row[order, 0]))
        if (levels[-1] - levels[-2]).min() <= 0:
            message = f"panel '{panel}': its line on disk '{disk}' does not lie below the line before it"
            raise DressingError(message, at=("rows", disk))
    levels.append(np.ones_like(v))
    if (levels[-1] - levels[-2]).min() <= 0:
        message = f"panel '{panel}': its line on disk '{disks[-2]}' does not lie above its bottom"
        raise DressingError(message, at=("rows", disks[-2]))
    levels = np.array(levels)
    k = np.clip((levels[1:-1] <= v).sum(axis=0), 0, len(levels) - 2)
    i = np.arange(len(v))
    return k + (v - levels[k, i]) / (levels[k + 1, i] - levels[k, i])


def signed_areas(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(m,) areas of ``triangles`` over flat ``points`` (n, 2), positive counter-clockwise."""
    a, b, c = points[triangles[:, 0]], points[triangles[:, 1]], points[triangles[:, 2]]
    p, q = b - a, c - a
    return 0.5 * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
