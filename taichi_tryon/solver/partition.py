"""Vertices of the cloth in compact groups, by which preconditioners divide it."""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra

from taichi_tryon.cloth.model import Cloth


def patches(cloth: Cloth, count: int) -> np.ndarray:
    """Patch (nv,) of each vertex, counted from 0, about ``count`` in all, and one at least for each connected piece.

    A patch is what is nearer to its middle than to any other along the edges, seams included; the middles are chosen
    farthest first (Gonzalez 1985, "Clustering to minimize the maximum intercluster distance").
    """
    # rest lengths of the triangles' sides, from the hats' gradients: |e_k| = 2 A |g_k|
    lengths = np.zeros(len(cloth.hinges))
    lengths[cloth.triangle_edges.ravel()] = (2 * cloth.areas[:, None] * np.linalg.norm(cloth.gradients, axis=2)).ravel()
    i, j = cloth.hinges[:, :2].T
    nv = cloth.vertex_count
    graph = sp.csr_matrix((np.tile(lengths, 2), (np.r_[i, j], np.r_[j, i])), shape=(nv, nv))
    nearest, patch = np.full(nv, np.inf), np.zeros(nv, np.int64)
    middles = 0
    while middles < count or np.isinf(nearest.max()):
        reach = nearest.max()
        if reach <= 0:
            break
        found = dijkstra(graph, indices=int(np.argmax(nearest)), limit=reach)
        closer = found < nearest
        nearest[closer], patch[closer] = found[closer], middles
        middles += 1
    return np.unique(patch, return_inverse=True)[1]


def blocks(points: np.ndarray, patch: np.ndarray, most: int) -> np.ndarray:
    """Block (nv,) of each vertex at ``points`` (nv, 3), counted from 0, of at most ``most`` vertices of one ``patch``.

    Each patch is cut in two across its longest extent until the blocks are small enough (recursive coordinate
    bisection; Berger and Bokhari 1987, "A partitioning strategy for nonuniform problems on multiprocessors").
    """
    order = np.argsort(patch, kind="stable")
    waiting = np.split(order, np.flatnonzero(np.diff(patch[order])) + 1)
    block, count = np.empty(len(points), np.int64), 0
    while waiting:
        ids = waiting.pop()
        needed = -(-len(ids) // most)
        if needed == 1:
            block[ids] = count
            count += 1
        else:
            along = np.argsort(points[ids, np.argmax(np.ptp(points[ids], axis=0))], kind="stable")
            # both halves get as many vertices as fill their blocks alike
            half = len(ids) * (needed // 2) // needed
            waiting += [ids[along[half:]], ids[along[:half]]]
    return block
