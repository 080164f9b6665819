"""Cleaning a start: stretched cloth draws together, folds are smoothed, and all of it stays outside the body.

Laying a panel on ruled surfaces stretches it, here and there by half its length. A few sweeps that shorten such edges
leave the simulation a start nearer to its rest, so that its first steps are calm.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags

from taichi_tryon.body.density import density, gradient
from taichi_tryon.body.model import Balls
from taichi_tryon.dressing.check import NEAR, crossings

STEP = 0.01  # largest shift in one push [m]
SWEEPS = 120
SWEEPS_A_PUSH = 8
LAST_PUSHES = 20
UNTANGLINGS = 20
SMOOTHINGS = 4
RIM_GAP = 4e-3  # [m] between the two sides of an open closure
RINGS = 2  # of triangles about a crossing that are smoothed with it


def neighbour_matrix(edges: np.ndarray, n: int) -> csr_matrix:
    """(n, n) with 1 for each of the ``edges`` (ne, 2), in both directions."""
    half = coo_matrix((np.ones(len(edges)), edges.T), shape=(n, n))
    return (half + half.T).tocsr()


def push_out(x: np.ndarray, balls: Balls, clearance: float, samples: np.ndarray | None = None) -> np.ndarray:
    """Shifts (n, 3) that take points nearer than ``clearance`` [m] outwards along the gradient, to first order.

    With ``samples`` (k, j) the means of those j points are kept clear instead, and each of the points takes their
    shift; where there are several, their mean weighted by size.
    """
    points = x if samples is None else x[samples].mean(axis=1)
    found = density(balls, points)
    near = np.flatnonzero(found > NEAR)
    slope = gradient(balls, points[near])
    steep = np.maximum(np.linalg.norm(slope, axis=1), 1e-6)
    short = np.clip(clearance + (found[near] - 1) / steep, 0, STEP)
    push = -slope * (short / steep)[:, None]
    shift = np.zeros_like(x)
    if samples is None:
        shift[near] = push
        return shift
    weight = np.zeros(len(x))
    for column in samples[near].T:
        np.add.at(shift, column, push * short[:, None])
        np.add.at(weight, column, short)
    return shift / np.maximum(weight, 1e-12)[:, None]


def part_rims(x: np.ndarray, rims: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Positions (n, 3) where the vertices ``rims`` (k,) of open closures, whose two sides were laid on one line, have
    drawn back into their own cloth."""
    on_rim = np.zeros(len(x), bool)
    on_rim[rims] = True
    inner = neighbour_matrix(edges, len(x)) @ diags((~on_rim).astype(float))
    count = np.asarray(inner.sum(axis=1)).ravel()[rims, None]
    inward = (inner @ x)[rims] / np.maximum(count, 1) - np.where(count > 0, x[rims], 0.0)
    result = x.copy()
    result[rims] += RIM_GAP / 2 * inward / np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-12)
    return result


def draw_together(x: np.ndarray, edges: np.ndarray, length: np.ndarray, balls: Balls, clearance: float) -> np.ndarray:
    """Positions (n, 3) after sweeps in which every edge longer than its rest ``length`` (ne,) [m] shortens.

    Each point takes the mean of its edges' wishes (Jacobi), so their order does not matter.
    """
    n, count = len(x), len(edges)
    ends = edges.T.ravel()
    gather = coo_matrix((np.repeat([1.0, -1.0], count), (ends, np.tile(np.arange(count), 2))), shape=(n, count)).tocsr()
    share = 1.0 / np.bincount(ends, minlength=n)[:, None]
    for sweep in range(1, SWEEPS + 1):
        d = x[edges[:, 1]] - x[edges[:, 0]]
        now = np.linalg.norm(d, axis=1)
        x = x + share * (gather @ (d * np.maximum(1 - length / np.maximum(now, 1e-12), 0)[:, None]))
        if sweep % SWEEPS_A_PUSH == 0:
            x = x + push_out(x, balls, clearance)
    return x


def clear(x: np.ndarray, triangles: np.ndarray, edges: np.ndarray, balls: Balls, clearance: float) -> np.ndarray:
    """Positions whose vertices keep the clearance; edges' midpoints and triangles' centroids keep half of it."""
    for _ in range(LAST_PUSHES):
        of_vertices = push_out(x, balls, clearance)
        x = x + of_vertices
        of_samples = push_out(x, balls, 0.5 * clearance, edges) + push_out(x, balls, 0.5 * clearance, triangles)
        x = x + of_samples
        if max(np.abs(of_vertices).max(), np.abs(of_samples).max()) < 1e-4:
            break
    return x


def untangle(
    x: np.ndarray, triangles: np.ndarray, edges: np.ndarray, balls: Balls, clearance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Positions after smoothing the cloth about crossing triangles until none cross, or ``UNTANGLINGS`` times, and the
    pairs (k, 2) of those that still do."""
    neighbours = neighbour_matrix(edges, len(x))
    mean = diags(1 / np.asarray(neighbours.sum(axis=1)).ravel()) @ neighbours
    crossing = crossings(x, triangles)
    for attempt in range(UNTANGLINGS):
        if not len(crossing):
            break
        marked = np.zeros(len(x), bool)
        marked[triangles[crossing]] = True
        # what a small patch cannot free, a larger one may
        for _ in range(RINGS + attempt // 3):
            marked[triangles[marked[triangles].any(axis=1)]] = True
        for _ in range(SMOOTHINGS):
            x = np.where(marked[:, None], mean @ x, x)
        x = clear(x, triangles, edges, balls, clearance)
        crossing = crossings(x, triangles)
    return x, crossing
