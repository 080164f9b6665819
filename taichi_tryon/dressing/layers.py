"""One garment over another: from the start, the next one lies outside those underneath.

Layers that meet keep their order: of garments that had changed places the wrong one would stay outside.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.spatial import cKDTree

from taichi_tryon.dressing.check import unique_edges

# positions (nv, 3) [m] and triangles (nt, 3), counter-clockwise seen from outside
Layer = tuple[np.ndarray, np.ndarray]

# from deeper beneath another garment than this none is lifted over it [m]
REACH = 0.05
# so far beyond its rim a garment is thought to go straight on, so that the next one passes over the rim [m]
BEYOND = 0.02


def beneath(points: np.ndarray, layer: Layer) -> np.ndarray:
    """(k,) bool: which of the points (k, 3) lie on the inner side of a layer. Where it ends it has no sides: a point to
    which its rim is nearest is not beneath it."""
    height, _, at_rim = heights(points, layer, np.inf)
    return (height < 0) & ~at_rim


def lift(points: np.ndarray, under: Iterable[Layer], gap: float) -> np.ndarray:
    """Shifts (k, 3) that take points (k, 3) to the height ``gap`` [m] over the layers ``under`` them, where they are
    lower by up to REACH."""
    shift = np.zeros_like(points)
    for layer in under:
        height, up, _ = heights(points + shift, layer, REACH)
        shift += np.maximum(gap - height, 0)[:, None] * up
    return shift


def heights(points: np.ndarray, layer: Layer, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distances (k,) [m] of points (k, 3) from a layer, negative on its inner side, the directions (k, 3) in which they
    grow, and (k,) bool where its rim is nearest; infinite and 0 further off than
    ``reach``.

    The sign is that of the angle-weighted pseudonormal at the closest point (Baerentzen, Aanaes 2005, "Signed distance
    computation using the angle weighted pseudonormal"). At the rim the distance is that from the cloth's plane, up to
    BEYOND it.
    """
    positions, triangles = layer
    point, triangle = _candidates(points, positions[triangles], reach)
    weights = _closest(points[point], positions[triangles[triangle]])
    away = points[point] - np.einsum("nk,nki->ni", weights, positions[triangles[triangle]])
    distance = np.linalg.norm(away, axis=1)
    order = np.lexsort((distance, point))
    nearest = order[np.unique(point[order], return_index=True)[1]]
    point, triangle, weights, away, distance = (a[nearest] for a in (point, triangle, weights, away, distance))

    normal, rim = _normals(positions, triangles, triangle, weights > 0)
    above = np.einsum("ni,ni->n", away, normal)
    sign = np.where(above < 0, -1.0, 1.0)
    flat = rim | (distance < 1e-9)  # where the cloth's own normal tells the direction
    up_there = np.where(flat[:, None], normal, away * (sign / np.maximum(distance, 1e-9))[:, None])
    near = distance <= np.where(rim, BEYOND, reach)
    height, up, at_rim = np.full(len(points), np.inf), np.zeros_like(points), np.zeros(len(points), bool)
    height[point[near]] = np.where(rim, above, sign * distance)[near]
    up[point[near]], at_rim[point[near]] = up_there[near], rim[near]
    return height, up, at_rim


def touching(positions: np.ndarray, triangles: np.ndarray, least: float) -> np.ndarray:
    """Vertices and triangles (k, 2) nearer to each other than ``least`` [m], which no edge is shorter than, but for a
    triangle's own corners."""
    corners = positions[triangles]
    vertex, triangle = _candidates(positions, corners, least)
    alien = (triangles[triangle] != vertex[:, None]).all(axis=1)
    vertex, triangle = vertex[alien], triangle[alien]
    weights = _closest(positions[vertex], corners[triangle])
    away = positions[vertex] - np.einsum("nk,nki->ni", weights, corners[triangle])
    near = np.linalg.norm(away, axis=1) < least
    return np.column_stack([vertex[near], triangle[near]])


def _candidates(points: np.ndarray, corners: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Ids of points and triangles: for each point within reach, all triangles that can be its nearest."""
    centroids = corners.mean(axis=1)
    size = np.linalg.norm(corners - centroids[:, None], axis=2).max()
    tree = cKDTree(centroids)
    distance, _ = tree.query(points, distance_upper_bound=reach + size)
    near = np.flatnonzero(np.isfinite(distance))
    # no triangle nearer than the one of the nearest centroid has its own centroid further off than this
    found = tree.query_ball_point(points[near], distance[near] + size, return_sorted=True)
    triangle = np.concatenate([np.zeros(0, int), *map(np.asarray, found)]).astype(int)
    return np.repeat(near, [len(one) for one in found]), triangle


def _closest(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Barycentric weights (n, 3) of the closest point of a triangle (n, 3, 3) to each point (n, 3), exactly 0 for the
    corners that it does not lie between."""
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area = np.einsum("ni,ni->n", normal, normal)
    result = np.stack(
        [np.einsum("ni,ni->n", np.cross(q - points, r - points), normal) / area for q, r in ((b, c), (c, a), (a, b))],
        axis=1,
    )
    best = np.where((result > 0).all(axis=1), -1.0, np.inf)  # the plane's point is inside: no side is nearer
    for i, j in ((0, 1), (1, 2), (2, 0)):
        side = corners[:, j] - corners[:, i]
        share = np.einsum("ni,ni->n", points - corners[:, i], side) / np.einsum("ni,ni->n", side, side)
        share = np.clip(share, 0, 1)
        distance = np.linalg.norm(corners[:, i] + share[:, None] * side - points, axis=1)
        nearer = distance < best
        result[nearer] = 0
        result[nearer, i], result[nearer, j] = 1 - share[nearer], share[nearer]
        best = np.minimum(best, distance)
    return result


def _normals(positions: np.ndarray, triangles: np.ndarray, triangle: np.ndarray, between: np.ndarray):
    """Pseudonormals (n, 3) where a point lies ``between`` (n, 3) bool corners of a ``triangle`` (n,), and (n,) bool
    where that is on the rim."""
    corners = positions[triangles]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    edges, of_triangle = unique_edges(triangles)
    of_edge, of_vertex = np.zeros((len(edges), 3)), np.zeros_like(positions)
    for k in range(3):
        to = corners[:, [(k + 1) % 3, (k + 2) % 3]] - corners[:, k, None]
        to /= np.linalg.norm(to, axis=2, keepdims=True)
        angle = np.arccos(np.clip(np.einsum("ni,ni->n", to[:, 0], to[:, 1]), -1, 1))
        np.add.at(of_edge, of_triangle[:, k], face)
        np.add.at(of_vertex, triangles[:, k], angle[:, None] * face)
    edge_ends = np.bincount(of_triangle.ravel(), minlength=len(edges)) == 1
    vertex_ends = np.zeros(len(positions), bool)
    vertex_ends[edges[edge_ends]] = True

    result, rim = face[triangle].copy(), np.zeros(len(triangle), bool)
    count = between.sum(axis=1)
    for k in range(3):
        on_edge = (count == 2) & between[:, k] & between[:, (k + 1) % 3]
        found = of_triangle[triangle[on_edge], k]
        result[on_edge], rim[on_edge] = of_edge[found], edge_ends[found]
        on_vertex = (count == 1) & between[:, k]
        found = triangles[triangle[on_vertex], k]
        result[on_vertex], rim[on_vertex] = of_vertex[found], vertex_ends[found]
    return result / np.linalg.norm(result, axis=1, keepdims=True), rim
