"""Bands of the pattern on the mesh: segments of tape between neighbouring vertices of an edge."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from taichi_tryon.pattern.panel import Band, EdgeName


@dataclass(frozen=True, eq=False)
class Tapes:
    """Segments of tape: the ``vertices`` (k, 2) at their ends, rest ``lengths`` (k,) [m], ``stiffness`` (k,) [N]."""

    vertices: np.ndarray
    lengths: np.ndarray
    stiffness: np.ndarray

    @staticmethod
    def none() -> Tapes:
        return Tapes(np.zeros((0, 2), int), np.zeros(0), np.zeros(0))


def lay_tapes(
    bands: Iterable[Band], points: np.ndarray, point_vertex: np.ndarray, edge_points: dict[EdgeName, np.ndarray]
) -> Tapes:
    """Sew each band along its edges; a band of another length than theirs is spread evenly.

    points (np, 2) [m] of the flat pattern, point_vertex (np,), edge_points: the points along each edge.
    """
    parts = [Tapes.none()]
    for band in bands:
        pairs = np.concatenate(
            [np.stack([edge_points[name][:-1], edge_points[name][1:]], axis=1) for name in band.edges]
        )
        drawn = np.linalg.norm(points[pairs[:, 1]] - points[pairs[:, 0]], axis=1)
        lengths = drawn * (1.0 if band.length is None else band.length / drawn.sum())
        parts.append(Tapes(point_vertex[pairs], lengths, np.full(len(pairs), band.stiffness)))
    arrays = ([part.vertices, part.lengths, part.stiffness] for part in parts)
    return Tapes(*(np.concatenate(column) for column in zip(*arrays, strict=True)))
