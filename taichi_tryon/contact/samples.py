"""Where the cloth feels the body: at vertices, edge midpoints and centroids of its triangles.

A flat triangle on a limb of radius r cuts h^2/6r into it when only its vertices are held outside (0.96 mm for 12 mm
edges on a wrist), so the points inside count too. Together they form the seven-point rule on a triangle, which
integrates pressure exactly up to cubic.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

# shares of a triangle's area: each corner, each edge midpoint, the centroid (Strang and Fix 1973)
CORNER, MIDPOINT, CENTROID = 1 / 20, 2 / 15, 9 / 20
# the samples cut a triangle into six, each in a circle about the way from a corner to the centroid, at most the longest
# edge L over sqrt(3); of what is curved by c, linear interpolation misses half of c times the circle's radius squared
SPAN = 1 / 24


@dataclass(frozen=True)
class Samples:
    """Points of the cloth: ``vertices`` (ns, 3) ids, barycentric ``weights`` (ns, 3), ``areas`` (ns,) [m^2], ``spans``
    (ns,) [m^2]: where the skin has the curvature c, a triangle whose samples are c times that off it is outside.

    The first come the vertices (one weight is 1), then edges in the order of ``edges``, then triangles; ``of_triangle``
    (nt, 7) are those of each triangle: its corners, its edges, its centroid.
    """

    vertices: np.ndarray
    weights: np.ndarray
    areas: np.ndarray
    spans: np.ndarray
    of_triangle: np.ndarray = field(default_factory=lambda: np.zeros((0, 7), int))

    @staticmethod
    def none() -> Samples:
        """Those of cloth that there is no body for."""
        return Samples(np.zeros((0, 3), int), np.zeros((0, 3)), np.zeros(0), np.zeros(0))

    @staticmethod
    def of(
        triangles: np.ndarray, rest: np.ndarray, areas: np.ndarray, edges: np.ndarray, triangle_edges: np.ndarray
    ) -> Samples:
        """Samples of a mesh: triangles (nt, 3), their corners at rest (nt, 3, 2) [m] and areas, edges (ne, 2), the
        three edges of each triangle."""
        nv = int(triangles.max()) + 1
        ids = np.arange(nv)
        spans = SPAN * ((rest - np.roll(rest, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
        at_vertex, at_edge = np.zeros(nv), np.zeros(len(edges))
        np.maximum.at(at_vertex, triangles.ravel(), np.repeat(spans, 3))
        np.maximum.at(at_edge, triangle_edges.ravel(), np.repeat(spans, 3))
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
            spans=np.concatenate([at_vertex, at_edge, spans]),
            of_triangle=np.column_stack([triangles, nv + triangle_edges, nv + len(edges) + np.arange(len(triangles))]),
        )
