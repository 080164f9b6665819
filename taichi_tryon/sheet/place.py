"""Where a sheet starts, and how fast."""

from __future__ import annotations

import numpy as np

from taichi_tryon.body.skeleton import rotation_matrix
from taichi_tryon.mesh.garment import GarmentMesh
from taichi_tryon.sheet.spec import SheetSpec, WavesSpec
from taichi_tryon.units import CM, MM

# so many that their sum looks alike everywhere
WAVES = 16
# power of the radius with which folds around a rim grow: smooth in the middle, hardly there on a table
FADING = 4


def place(spec: SheetSpec, mesh: GarmentMesh) -> tuple[np.ndarray, np.ndarray]:
    """Positions (nv, 3) [m] and velocities (nv, 3) [m/s] at the start."""
    flat = np.zeros((mesh.vertex_count, 2))
    flat[mesh.point_vertex[::-1]] = mesh.pattern_points[::-1]  # of the points of one vertex the first counts
    x, y = flat.T
    local = np.column_stack([x, y, waves(spec.waves, flat) if spec.waves else np.zeros_like(x)])
    if spec.tube_radius_cm is not None:
        angle, radius = 2 * np.pi * x / (spec.size_cm[0] * CM), spec.tube_radius_cm * CM
        local = np.column_stack([radius * np.sin(angle), y, radius * np.cos(angle)])
    positions = local @ rotation_matrix(spec.rotation_degree).T + np.array(spec.origin_cm) * CM
    shares = np.bincount(mesh.triangles.ravel(), np.repeat(mesh.areas, 3), mesh.vertex_count)
    arms = positions - shares @ positions / shares.sum()
    return positions, np.array(spec.velocity_m_s) + np.cross(spec.spin_rad_s, arms)


def waves(spec: WavesSpec, points: np.ndarray) -> np.ndarray:
    """Heights (n,) [m] at points (n, 2) [m] of the sheet."""
    height = np.sqrt(2) * spec.height_mm * MM
    if spec.folds is not None:
        radius, angle = np.linalg.norm(points, axis=1), np.arctan2(points[:, 1], points[:, 0])
        return height * (radius / radius.max()) ** FADING * np.cos(spec.folds * angle)
    rng = np.random.default_rng(spec.seed)
    direction, phase = rng.uniform(0, 2 * np.pi, (2, WAVES))
    number = 2 * np.pi / (spec.length_cm * CM) * np.stack([np.cos(direction), np.sin(direction)])
    return height / np.sqrt(WAVES) * np.cos(points @ number + phase).sum(axis=1)
