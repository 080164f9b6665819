"""Triangles inside a polygon whose boundary stays as given: Netgen with the precautions it needs."""

from __future__ import annotations

import threading

import numpy as np
from shapely import Polygon

from taichi_tryon.errors import PatternError
from taichi_tryon.units import CM

SHORTEST_SEGMENT = 0.02 * CM
"""Netgen cannot mesh a boundary with a segment below this length [m]."""
_NETGEN_KEEPS_GLOBAL_STATE = threading.Lock()


def triangulate(outline: np.ndarray, edge_length: float, panel: str) -> tuple[np.ndarray, np.ndarray]:
    """Mesh the inside of a simple polygon.

    ``outline`` (n, 2) [m] in either sense, without a repeated point; ``edge_length`` [m]; ``panel`` for messages.
    Returns points (p, 2), the first n of them the outline as given, and triangles (t, 3), counter-clockwise.
    The mesh depends on neither the sense nor the starting point of the outline. Raises PatternError naming the panel.
    """
    _check_outline(outline, panel)
    order = _canonical_order(outline)
    # Netgen's own tolerances are made for lengths about one; rounded, so that the sense of the loop leaves no trace.
    given = np.round(outline[order] / edge_length, 9)
    points, triangles = _netgen(given, panel)
    if not np.array_equal(points[: len(given)], given):
        raise PatternError(f"panel '{panel}': the mesher moved the boundary; try another edge length")
    points *= edge_length
    renumbered = np.concatenate([order, np.arange(len(outline), len(points))])
    triangles = renumbered[triangles]
    points[renumbered] = points.copy()
    points[: len(outline)] = outline
    backwards = signed_areas(points, triangles) < 0
    triangles[backwards] = triangles[backwards][:, [0, 2, 1]]
    _check_boundary(len(outline), triangles, panel)
    return points, triangles


def signed_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Areas (t,) [m^2] of triangles (t, 3) of points (p, 2); negative where clockwise."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


def corner_angles(corners: np.ndarray) -> np.ndarray:
    """Angles (t, 3) [rad] of triangles given by their corners (t, 3, 2)."""
    to_next = np.roll(corners, -1, axis=1) - corners
    to_previous = np.roll(corners, 1, axis=1) - corners
    cross = to_next[..., 0] * to_previous[..., 1] - to_next[..., 1] * to_previous[..., 0]
    return np.arctan2(np.abs(cross), (to_next * to_previous).sum(axis=-1))


def _check_outline(outline: np.ndarray, panel: str) -> None:
    """Netgen hangs on a crossing outline, crashes on a repeated point and fails on a tiny segment."""
    shortest = np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1).min()
    if shortest < SHORTEST_SEGMENT:
        raise PatternError(
            f"panel '{panel}': two boundary vertices are {shortest / CM:.2g} cm apart, "
            f"less than {SHORTEST_SEGMENT / CM:g} cm; let edges that nearly end together across a seam end together"
        )
    if not Polygon(outline).is_valid:
        raise PatternError(
            f"panel '{panel}': the outline crosses itself when it is divided into straight segments; "
            "use a smaller edge length or widen the narrow place"
        )


def _canonical_order(outline: np.ndarray) -> np.ndarray:
    """Point numbers (n,) of the outline counter-clockwise, from its lowest leftmost point."""
    order = np.arange(len(outline))
    x, y = outline.T
    if (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() < 0:
        order = order[::-1]
    start = np.lexsort((outline[order, 1], outline[order, 0]))[0]
    return np.roll(order, -start)


def _netgen(outline: np.ndarray, panel: str) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles for a counter-clockwise outline in units of the edge length."""
    with _NETGEN_KEEPS_GLOBAL_STATE:
        from netgen.geom2d import SplineGeometry  # here, since loading it takes a third of a second
        from netgen.meshing import NgException

        geometry = SplineGeometry()
        numbers = [geometry.AppendPoint(float(x), float(y)) for x, y in outline]
        for first, second in zip(numbers, numbers[1:] + numbers[:1], strict=True):
            geometry.Append(["line", first, second], leftdomain=1, rightdomain=0)
        try:
            # segmentsperedge below one: Netgen shall not divide the segments given to it
            mesh = geometry.GenerateMesh(maxh=1.0, segmentsperedge=0.01)
        except NgException as error:
            raise PatternError(f"panel '{panel}': the mesher failed ({error}); try another edge length") from None
        points = np.array(mesh.Coordinates())[:, :2].copy()
        triangles = np.array(mesh.Elements2D().NumPy()["nodes"], dtype=np.int64) - 1
    return points, triangles


def _check_boundary(count: int, triangles: np.ndarray, panel: str) -> None:
    """The edges of only one triangle must be the outline's segments, no more and no fewer."""
    sides = np.sort(np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    unique, uses = np.unique(sides, axis=0, return_counts=True)
    around = np.arange(count)
    wanted = np.unique(np.sort(np.stack([around, np.roll(around, -1)], axis=1), axis=1), axis=0)
    if uses.max() > 2 or not np.array_equal(unique[uses == 1], wanted):
        raise PatternError(f"panel '{panel}': the mesher did not keep the boundary edges; try another edge length")
