"""What the worn cloth feels, as arrays over its triangles and vertices."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree


def strains(green: np.ndarray) -> dict[str, np.ndarray]:
    """Stretch along warp and weft [%] and shear angle [degree] of Green strains (nt, 3), E11, E22, 2 E12."""
    lengths = np.sqrt(np.maximum(1 + 2 * green[:, :2], 0))
    cosine = green[:, 2] / np.maximum(lengths.prod(axis=1), 1e-30)
    return {
        "strain_warp_percent": 100 * (lengths[:, 0] - 1),
        "strain_weft_percent": 100 * (lengths[:, 1] - 1),
        "shear_degree": np.degrees(np.arcsin(np.clip(cosine, -1, 1))),
    }


def vertex_pressure(pressure: np.ndarray, vertices: np.ndarray, weights: np.ndarray, areas: np.ndarray, count: int):
    """Mean contact pressure around each vertex (nv,) from that at the contact samples, in the samples' unit.

    pressure (ns,), vertices (ns, 3), barycentric weights (ns, 3) and areas (ns,) of the samples.
    """
    shares = weights * areas[:, None]
    total = np.bincount(vertices.ravel(), (shares * pressure[:, None]).ravel(), count)
    return total / np.maximum(np.bincount(vertices.ravel(), shares.ravel(), count), 1e-30)


def vertex_forces(forces: np.ndarray, vertices: np.ndarray, weights: np.ndarray, count: int) -> np.ndarray:
    """Forces (nv, 3) on the vertices from those (ns, 3) at samples: vertices (ns, 3), barycentric weights (ns, 3)."""
    corners, found = vertices.ravel(), np.zeros((count, 3))
    for axis, f in enumerate(forces.T):
        found[:, axis] = np.bincount(corners, (weights * f[:, None]).ravel(), count)
    return found


def gaps(positions: np.ndarray, near_gap: np.ndarray, skin: np.ndarray, trusted: float = 0.01) -> np.ndarray:
    """Distance of each vertex from the skin (nv,) [m], negative inside.

    The body's own gap counts within ``trusted`` of the skin; a density of compact support knows no distance far out,
    where the nearest of the ``skin``'s points (n, 3) does, if there are any.
    """
    result = near_gap.copy()
    far = near_gap > trusted
    if far.any() and len(skin):
        result[far] = np.maximum(cKDTree(skin).query(positions[far])[0], trusted)
    return result


def weighted_percentiles(values: np.ndarray, weights: np.ndarray, percents: tuple[float, ...]) -> list[float]:
    """Percentiles of ``values`` (n,) that count by ``weights`` (n,); zeros where there is nothing."""
    if len(values) == 0 or weights.sum() <= 0:
        return [0.0] * len(percents)
    order = np.argsort(values, kind="stable")
    position = (np.cumsum(weights[order]) - weights[order] / 2) / weights.sum()
    return [float(np.interp(percent / 100, position, values[order])) for percent in percents]
