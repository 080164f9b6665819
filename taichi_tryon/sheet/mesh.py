"""From a sheet to its mesh, in the same form as a sewn garment's."""

from __future__ import annotations

import numpy as np

from taichi_tryon.mesh.garment import GarmentMesh, material_coordinates
from taichi_tryon.mesh.triangulate import triangulate
from taichi_tryon.sheet.spec import SheetSpec
from taichi_tryon.units import CM, DEGREE

PANEL = "sheet"
# of the spacing, how far an inner vertex of a jittered mesh is shifted along each axis at most
JITTER = 0.25


def sheet_mesh(spec: SheetSpec, edge_length: float, name: str) -> GarmentMesh:
    """Mesh a sheet with triangles of about ``edge_length`` [m]; the legs of the right-angled ones have that length.

    Pattern points lie in the sheet's own x and y. Edges are called bottom, right, top, left of a rectangle, rim of a
    disk, side_0, side_1, ... of a polygon from its first corner. Raises PatternError where the mesher fails.
    """
    sides = _sides(spec, edge_length)
    outline = np.concatenate([side[:-1] for side in sides.values()])
    if spec.mesh == "delaunay":
        points, triangles = triangulate(outline, edge_length, name)
    else:
        points, triangles = _grid(spec, edge_length)
    vertex = _weld(points, spec)
    angle = spec.grain_degree * DEGREE
    grain = np.tile([np.cos(angle), np.sin(angle)], (len(points), 1))
    mesh = GarmentMesh(
        name=name,
        triangles=vertex[triangles].astype(np.int32),
        rest=material_coordinates(points, grain)[triangles],
        panel=np.zeros(len(triangles), np.int32),
        panel_names=(PANEL,),
        vertex_count=int(vertex.max()) + 1,
        pattern_points=points,
        point_panel=np.zeros(len(points), np.int32),
        point_vertex=vertex.astype(np.int32),
        point_triangles=triangles.astype(np.int32),
        edge_points={(PANEL, side): _numbers(points, along) for side, along in sides.items()},
    )
    _ = mesh.topology  # refuses what is not a cloth
    return mesh


def _sides(spec: SheetSpec, edge_length: float) -> dict[str, np.ndarray]:
    """Points (k, 2) [m] along each side of the outline, both ends included; counter-clockwise but for polygons."""
    if spec.diameter_cm is not None:
        radius = spec.diameter_cm * CM / 2
        angles = np.linspace(0, 2 * np.pi, max(6, round(2 * np.pi * radius / edge_length)) + 1)
        return {"rim": radius * np.column_stack([np.cos(angles), np.sin(angles)])}
    if spec.size_cm is not None:
        w, h = np.array(spec.size_cm) * CM
        corners, names = np.array([[0, 0], [w, 0], [w, h], [0, h]]), ("bottom", "right", "top", "left")
    else:
        corners = np.array(spec.outline_cm) * CM
        names = tuple(f"side_{i}" for i in range(len(corners)))
    sides = {}
    for name, a, b in zip(names, corners, np.roll(corners, -1, axis=0), strict=True):
        count = max(1, round(float(np.linalg.norm(b - a)) / edge_length))
        sides[name] = a + np.linspace(0, 1, count + 1)[:, None] * (b - a)
    return sides


def _grid(spec: SheetSpec, edge_length: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of a rectangle of nx by ny squares, each cut by a diagonal."""
    size = np.array(spec.size_cm) * CM
    nx, ny = (max(1, round(float(length) / edge_length)) for length in size)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij"))
    points = np.column_stack([i / nx, j / ny]) * size
    if spec.mesh == "jittered":
        inner = (i > 0) & (i < nx) & (j > 0) & (j < ny)
        shift = np.random.default_rng(0).uniform(-JITTER, JITTER, (len(points), 2)) * size / [nx, ny]
        points = points + shift * inner[:, None]
    i, j = (index.ravel() for index in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    a = i * (ny + 1) + j
    b, c, d = a + ny + 1, a + ny + 2, a + 1
    rising = np.stack([np.column_stack([a, b, c]), np.column_stack([a, c, d])], axis=1)
    falling = np.stack([np.column_stack([a, b, d]), np.column_stack([b, c, d])], axis=1)
    turned = ((i + j) % 2 == 1) & (spec.mesh == "alternating")
    return points, np.where(turned[:, None, None], falling, rising).reshape(-1, 3)


def _weld(points: np.ndarray, spec: SheetSpec) -> np.ndarray:
    """Vertex (np,) of each point: of a tube, a point of the right edge is that of the left edge at its height."""
    vertex = np.arange(len(points))
    if spec.tube_radius_cm is None:
        return vertex
    width = spec.size_cm[0] * CM
    left, right = (np.flatnonzero(np.isclose(points[:, 0], x, rtol=0, atol=1e-9)) for x in (0.0, width))
    vertex[right[np.argsort(points[right, 1])]] = left[np.argsort(points[left, 1])]
    return np.unique(vertex, return_inverse=True)[1].ravel()


def _numbers(points: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Which of the points (n, 2) lie at the places ``along`` (k, 2)."""
    return np.linalg.norm(points[None] - along[:, None], axis=2).argmin(axis=1)
