"""Where the cloth presses on the wearer: its contact forces as a pressure on the body's surface.

Contact is felt at points of the cloth, each with a force. Each force is shared out among the vertices of the surface
around its point, by (1 - d^2 / reach^2)^2 in the distance d, the area of the vertex and how far the surface there faces
as the force pushes; the shares of a point add up to one. So no force is lost or made, an even pressure stays even, and
a point between two limbs presses on the one that it touches. What is finer than the reach is blurred, as by the pad of
a sensor.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree


def surface_vectors(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Area (n,) [m^2] and area times normal (n, 3) of each vertex's third of the triangles around it."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    vectors = np.cross(b - a, c - a) / 6
    corners, count = triangles.ravel(), len(vertices)
    areas = np.bincount(corners, np.repeat(np.linalg.norm(vectors, axis=1), 3), count)
    return areas, np.stack([np.bincount(corners, np.repeat(v, 3), count) for v in vectors.T], axis=1)


def imprint(
    points: np.ndarray,
    forces: np.ndarray,
    normals: np.ndarray,
    vertices: np.ndarray,
    triangles: np.ndarray,
    reach: float,
) -> np.ndarray:
    """Pressure (n,) [Pa] at the ``vertices`` (n, 3) [m] of a surface with outward ``triangles`` (m, 3).

    points (k, 3) [m] of the cloth, the sizes (k,) [N] of the normal forces there and the body's outward normals (k, 3);
    reach [m]: no finer than the mean edges of cloth and surface. Pressure times area of all vertices adds up to the
    forces.
    """
    areas, vectors = surface_vectors(vertices, triangles)
    facing = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-30)
    pressing = np.flatnonzero(forces > 0)
    if not len(pressing):
        return np.zeros(len(vertices))
    points, forces, normals = points[pressing], forces[pressing], normals[pressing]
    near = cKDTree(vertices).query_ball_point(points, reach, return_sorted=True)
    k = np.repeat(np.arange(len(points)), [len(found) for found in near])
    j = np.concatenate([np.array(found, int) for found in near])
    apart = ((points[k] - vertices[j]) ** 2).sum(axis=1) / reach**2
    agree = np.maximum((normals[k] * facing[j]).sum(axis=1), 0.0)
    weight = areas[j] * np.maximum(1 - apart, 0.0) ** 2 * agree
    total = np.bincount(k, weight, len(points))
    share = weight / np.where(total > 0, total, 1.0)[k]
    found = np.bincount(j, share * forces[k], len(vertices))
    # what is further off than the reach presses where the surface is nearest
    lone = np.flatnonzero(total <= 0)
    if len(lone):
        found = found + np.bincount(cKDTree(vertices).query(points[lone])[1], forces[lone], len(vertices))
    return found / np.maximum(areas, 1e-30)
