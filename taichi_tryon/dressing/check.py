"""Is a start good? Outside the body everywhere, and no two triangles through each other."""

from __future__ import annotations

import numpy as np

from taichi_tryon.body.density import density, gap
from taichi_tryon.body.model import Balls

CELLS = 256
# density below which a point counts as far off: it is over 1 cm from the skin of an adult's body
NEAR = 0.2


def body_gaps(positions: np.ndarray, triangles: np.ndarray, balls: Balls) -> np.ndarray:
    """(nt,) least distance [m] from the body of each triangle's corners, edge midpoints and centroid; infinite where
    it is so far that the density is below NEAR."""
    edges, of_triangle = unique_edges(triangles)
    at_vertices = _gap_of_near(balls, positions)
    at_edges = _gap_of_near(balls, positions[edges].mean(axis=1))
    at_centroids = _gap_of_near(balls, positions[triangles].mean(axis=1))
    return np.minimum(np.minimum(at_vertices[triangles].min(axis=1), at_edges[of_triangle].min(axis=1)), at_centroids)


def _gap_of_near(balls: Balls, points: np.ndarray) -> np.ndarray:
    result = np.full(len(points), np.inf)
    near = density(balls, points) > NEAR
    result[near] = gap(balls, points[near])
    return result


def unique_edges(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (ne, 2) and, for each triangle, the ids (nt, 3) of its edges 01, 12, 20."""
    pairs = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, inverse = np.unique(pairs, axis=0, return_inverse=True)
    return edges, inverse.reshape(-1, 3)


def crossings(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Pairs (k, 2) of triangles, the smaller id first, that pass through each other.

    Two triangles cross when an edge of one passes through the inside of the other; corners they share do not count, and
    neither does mere touching. The signs of tetrahedra's volumes decide.
    """
    edges, of_triangle = unique_edges(triangles)
    e, t = _overlapping_boxes(positions, edges, triangles)
    alien = (edges[e][:, :, None] != triangles[t][:, None, :]).all(axis=(1, 2))
    e, t = e[alien], t[alien]
    through = segment_through_triangle(
        *positions[edges[e]].transpose(1, 0, 2), *positions[triangles[t]].transpose(1, 0, 2)
    )
    e, t = e[through], t[through]
    owner = np.argsort(of_triangle.ravel(), kind="stable")
    first = np.searchsorted(of_triangle.ravel()[owner], np.arange(len(edges) + 1))
    count = first[e + 1] - first[e]
    k = np.repeat(first[e], count) + _ranges(count)
    pairs = np.stack([owner[k] // 3, np.repeat(t, count)], axis=1)
    return np.unique(np.sort(pairs, axis=1), axis=0)


def segment_through_triangle(p, q, a, b, c) -> np.ndarray:
    """(k,) whether the open segment pq passes through the open triangle abc; all (k, 3)."""
    side_p, side_q = _volume(a, b, c, p), _volume(a, b, c, q)
    u, v, w = _volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)
    inside = ((u > 0) & (v > 0) & (w > 0)) | ((u < 0) & (v < 0) & (w < 0))
    return (side_p * side_q < 0) & inside


def _volume(a, b, c, d) -> np.ndarray:
    return np.einsum("ki,ki->k", np.cross(b - a, c - a), d - a)


def _ranges(counts: np.ndarray) -> np.ndarray:
    """0 .. counts[0] - 1, 0 .. counts[1] - 1, and so on."""
    return np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)


def _overlapping_boxes(
    positions: np.ndarray, edges: np.ndarray, triangles: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Ids of edges and triangles whose boxes meet, each pair once, found by a grid of cells."""
    boxes = [(positions[part].min(axis=1), positions[part].max(axis=1)) for part in (edges, triangles)]
    origin = positions.min(axis=0)
    # at most CELLS cells a side, so that one huge triangle among tiny ones cannot fill the memory
    size = max(2 * np.median(boxes[1][1] - boxes[1][0]), (positions.max(axis=0) - origin).max() / CELLS) + 1e-12
    shape = np.floor((positions.max(axis=0) - origin) / size).astype(int) + 1
    (edge_cell, e), (triangle_cell, t) = (_cells(low, high, origin, size, shape) for low, high in boxes)
    order = np.argsort(triangle_cell, kind="stable")
    triangle_cell, t = triangle_cell[order], t[order]
    first, last = np.searchsorted(triangle_cell, edge_cell, "left"), np.searchsorted(triangle_cell, edge_cell, "right")
    count = last - first
    e, t = np.repeat(e, count), t[np.repeat(first, count) + _ranges(count)]
    meet = (boxes[0][0][e] <= boxes[1][1][t]).all(axis=1) & (boxes[1][0][t] <= boxes[0][1][e]).all(axis=1)
    pairs = np.unique(e[meet].astype(np.int64) * len(triangles) + t[meet])
    return pairs // len(triangles), pairs % len(triangles)


def _cells(
    low: np.ndarray, high: np.ndarray, origin: np.ndarray, size: float, shape: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Cells that each box touches: flat cell ids and box ids."""
    a, b = (np.floor((corner - origin) / size).astype(int) for corner in (low, high))
    span = b - a + 1
    count = span.prod(axis=1)
    box = np.repeat(np.arange(len(low)), count)
    k = _ranges(count)
    i, rest = k // (span[box, 1] * span[box, 2]), k % (span[box, 1] * span[box, 2])
    cell = a[box] + np.stack([i, rest // span[box, 2], rest % span[box, 2]], axis=1)
    return (cell[:, 0] * shape[1] + cell[:, 1]) * shape[2] + cell[:, 2], box
