"""Where the cloth feels the body: at vertices, edge midpoints and centroids of its triangles.

A flat triangle on a limb of radius r cuts h^2/6r into it when only its vertices are held outside (0.96 mm for 12 mm
edges on a wrist), so the points inside count too. Together they form the seven-point rule on a triangle, which
integrates pressure exactly up to cubic.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# shares of a triangle's area: each corner, each edge midpoint, the centroid (Strang and Fix 1973)
CORNER, MIDPOINT, CENTROID = 1 / 20, 2 / 15, 9 / 20


@dataclass(frozen=True)
class Samples:
    """Points of the cloth: ``vertices`` (ns, 3) ids, barycentric ``weights`` (ns, 3), ``areas`` (ns,) [m^2].

    The first come the vertices (one weight is 1), then edges in the order of ``edges``, then triangles.
    """

    vertices: np.ndarray
    weights: np.ndarray
    areas: np.ndarray

    @staticmethod
    def none() -> Samples:
        """Those of cloth that there is no body for."""
        return Samples(np.zeros((0, 3), int), np.zeros((0, 3)), np.zeros(0))

    @staticmethod
    def of(triangles: np.ndarray, areas: np.ndarray, edges: np.ndarray, triangle_edges: np.ndarray, nv: int) -> Samples:
        """Samples of a mesh: triangles (nt, 3), their areas, edges (ne, 2), the three edges of each triangle."""
        ids = np.arange(nv)
        of_vertex = np.bincount(triangles.ravel(), np.repeat(areas * CORNER, 3), nv)
        of_edge = np.bincount(triangle_edges.ravel(), np.repeat(areas * MIDPOINT, 3), len(edges))
        return Samples(
            vertices=np.vstack([np.column_stack([ids, ids, ids]), edges[:, [0, 1, 1]], triangles]),
            weights=np.vstack(
                [
                    np.tile([1.0, 0.0, 0.0], (nv, 1)),
                    np.tile([0.5, 0.5, 0.0], (len(edges), 1)),
                    np.full((len(triangles), 3), 1 / 3),
                ]
            ),
            areas=np.concatenate([of_vertex, of_edge, areas * CENTROID]),
        )
