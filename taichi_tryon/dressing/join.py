"""One position for every sewn vertex, from the places that its panels give it.

An edge laid on a disk keeps its place: the sleeve's cap stays on the armhole disk, the bodice's armhole comes to it.
Other edges that are sewn meet half way: the crotch, which the half disks leave blank, closes on the median plane.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import splu

from taichi_tryon.dressing.flatten import harmonic
from taichi_tryon.dressing.panel_map import PanelMap

FADE = 0.06  # [m] over which cloth follows an edge that came to another panel's disk


def join(maps: list[PanelMap], placed: list[np.ndarray], neighbours: csr_matrix, edge_length: float) -> np.ndarray:
    """Positions (nv, 3) [m] of the sewn garment.

    ``placed`` holds each panel's points (n, 3) on its own surface, ``neighbours`` (nv, nv) is 1 where an edge joins two
    vertices, ``edge_length`` [m] their mean distance at rest.
    """
    n = neighbours.shape[0]
    everywhere = _mean(n, [(m.vertices, x) for m, x in zip(maps, placed, strict=True)])
    on_disk = np.zeros(n, bool)
    for m in maps:
        on_disk[m.vertices[m.laid]] = True
    disk = _mean(n, [(m.vertices[m.laid], x[m.laid]) for m, x in zip(maps, placed, strict=True)])
    middle = np.where(on_disk[:, None], disk, everywhere)

    result = middle.copy()
    came = []  # vertices whose panel must follow them to a disk, and how far
    for m, x in zip(maps, placed, strict=True):
        shift = middle[m.vertices] - x
        foreign = np.setdiff1d(m.sides[on_disk[m.vertices[m.sides]]], m.laid)
        met = np.setdiff1d(np.union1d(m.sides, m.laid), foreign)
        inside = ~on_disk[m.vertices]
        result[m.vertices[inside]] = (x + harmonic(m.weights, met, shift[met]))[inside]
        came.append((m.vertices[foreign], shift[foreign]))
    return result + _following(neighbours, edge_length, on_disk, _mean(n, came))


def _following(neighbours: csr_matrix, edge_length: float, fixed: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Shifts (nv, 3) of the free cloth that go over smoothly from ``shift`` at the ``fixed`` vertices to none.

    The solution of laplace(s) = s / FADE^2 on the mesh; fixed vertices, which are in place, get none.
    """
    degree = np.asarray(neighbours.sum(axis=1)).ravel()
    matrix = (diags(degree * (1 + (edge_length / FADE) ** 2)) - neighbours).tocsr()
    held, free = np.flatnonzero(fixed), np.flatnonzero(~fixed)
    result = np.zeros_like(shift)
    if len(free):
        result[free] = splu(matrix[free][:, free].tocsc()).solve(-(matrix[free][:, held] @ shift[held]))
    return result


def _mean(n: int, parts: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """(n, 3) mean of the values given for each vertex, 0 where none is."""
    total, count = np.zeros((n, 3)), np.zeros(n)
    for vertices, values in parts:
        np.add.at(total, vertices, values)
        np.add.at(count, vertices, 1)
    return total / np.maximum(count, 1)[:, None]
