"""From a sheet to its mesh, in the same form as a sewn garment's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from taichi_tryon.errors import PatternError
from taichi_tryon.mesh.bands import lay_tapes
from taichi_tryon.mesh.garment import GarmentMesh, material_coordinates
from taichi_tryon.mesh.triangulate import triangulate
from taichi_tryon.pattern.panel import Band
from taichi_tryon.sheet.spec import SheetSpec
from taichi_tryon.units import CM, DEGREE

PANEL = "sheet"
# of the spacing, how far an inner vertex of a jittered mesh is shifted along each axis at most
JITTER = 0.25


def sheet_mesh(spec: SheetSpec, edge_length: float, name: str, bands: Sequence[Band] = ()) -> GarmentMesh:
    """Mesh a sheet with triangles of about ``edge_length`` [m]; the legs of the right-angled ones have that length.

    Pattern points lie in the sheet's own x and y. Edges are called bottom, right, top, left of a rectangle, rim of a
    disk, side_0, side_1, ... of a polygon from its first corner. Raises PatternError where the mesher fails or squares
    do not end on a line that the mesh is to follow. ``bands`` are sewn along edges of the panel ``PANEL``.
    """
    sides = _sides(spec, edge_length)
    if spec.mesh == "delaunay":
        outlines = (_outline(part) for part in _parts(spec, sides, edge_length))
        points, triangles = _join([triangulate(outline, edge_length, name) for outline in outlines])
    else:
        points, triangles = _grid(spec, edge_length, name)
    vertex = _weld(points, spec)
    triangles = triangles.astype(np.int32)
    angle = spec.grain_degree * DEGREE
    grain = np.tile([np.cos(angle), np.sin(angle)], (len(points), 1))
    edge_points = {(PANEL, side): _numbers(points, along) for side, along in sides.items()}
    mesh = GarmentMesh(
        name=name,
        triangles=triangles if len(vertex) == vertex.max() + 1 else vertex[triangles].astype(np.int32),
        rest=material_coordinates(points, grain)[triangles],
        panel=np.zeros(len(triangles), np.int32),
        panel_names=(PANEL,),
        vertex_count=int(vertex.max()) + 1,
        pattern_points=points,
        point_panel=np.zeros(len(points), np.int32),
        point_vertex=vertex.astype(np.int32),
        point_triangles=triangles,
        edge_points=edge_points,
        tapes=lay_tapes(bands, points, vertex, edge_points),
        opened=np.zeros(0, int),
    )
    _ = mesh.topology  # refuses what is not a cloth
    return mesh


def _sides(spec: SheetSpec, edge_length: float) -> dict[str, np.ndarray]:
    """Points (k, 2) [m] along each side of the outline, both ends included; counter-clockwise but for polygons."""
    if spec.diameter_cm is not None:
        return {spec.edges[0]: _circle(spec.diameter_cm, edge_length)}
    if spec.size_cm is not None:
        w, h = np.array(spec.size_cm) * CM
        corners = np.array([[0, 0], [w, 0], [w, h], [0, h]])
    else:
        corners = np.array(spec.outline_cm) * CM
    lines, sides = np.array(spec.lines_cm) * CM, {}
    for name, a, b in zip(spec.edges, corners, np.roll(corners, -1, axis=0), strict=True):
        crossed = [x / w if name == "bottom" else 1 - x / w for x in lines] if name in ("bottom", "top") else []
        sides[name] = a + _shares([0.0, *sorted(crossed), 1.0], np.linalg.norm(b - a), edge_length)[:, None] * (b - a)
    return sides


def _circle(diameter_cm: float, edge_length: float) -> np.ndarray:
    """An even number of points (k, 2) [m] around the origin, from the x axis back to it."""
    radius = diameter_cm * CM / 2
    angles = np.linspace(0, 2 * np.pi, 2 * max(3, round(np.pi * radius / edge_length)) + 1)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def _shares(marks: list[float], length: float, edge_length: float) -> np.ndarray:
    """Shares 0 to 1 that divide a side of a ``length`` [m] evenly between marks."""
    shares = [np.zeros(1)]
    for low, high in zip(marks, marks[1:], strict=False):
        count = max(1, round(float((high - low) * length / edge_length)))
        shares.append(low + np.arange(1, count + 1) / count * (high - low))
    return np.concatenate(shares)


def _outline(sides: dict[str, np.ndarray]) -> np.ndarray:
    """Points (n, 2) of a loop of sides, none of them twice."""
    return np.concatenate([side[:-1] for side in sides.values()])


def _parts(spec: SheetSpec, sides: dict[str, np.ndarray], edge_length: float) -> list[dict[str, np.ndarray]]:
    """The sides of each part into which ``lines_cm`` or ``inner_diameter_cm`` cut the sheet."""
    if spec.inner_diameter_cm is not None:
        return _disk_and_half_rings(sides["rim"], _circle(spec.inner_diameter_cm, edge_length), edge_length)
    marks = np.array([0.0, *spec.lines_cm]) * CM
    if len(marks) == 1:
        return [sides]
    left, parts = sides["left"], []
    for low, high in zip(marks, [*marks[1:], spec.size_cm[0] * CM], strict=True):
        bottom, top = ([p for p in sides[name] if low - 1e-9 <= p[0] <= high + 1e-9] for name in ("bottom", "top"))
        parts.append({"bottom": bottom, "right": left[::-1] + [high, 0], "top": top, "left": left + [low, 0]})
    return parts


def _disk_and_half_rings(outer: np.ndarray, inner: np.ndarray, edge_length: float) -> list[dict[str, np.ndarray]]:
    """The disk within the ``inner`` circle, and what is left of the ``outer`` one, cut along the x axis, as the mesher
    wants parts without holes."""
    share = _shares([0.0, 1.0], outer[0, 0] - inner[0, 0], edge_length)[:, None]
    parts = [{"rim": inner}]
    for arc, back in zip(_halves(outer), _halves(inner), strict=True):
        inward, outward = arc[-1] + share * (back[-1] - arc[-1]), back[0] + share * (arc[0] - back[0])
        parts.append({"arc": arc, "inward": inward, "back": back[::-1], "outward": outward})
    return parts


def _halves(circle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    half = len(circle) // 2
    return circle[: half + 1], circle[half:]


def _join(parts: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of meshes side by side, as one: points at one place are one."""
    points = np.concatenate([part[0] for part in parts])
    first = np.cumsum([0, *(len(part[0]) for part in parts)])
    triangles = np.concatenate([part[1] + start for part, start in zip(parts, first, strict=False)])
    _, kept, number = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(kept))  # in the order of the first of each
    return points[np.sort(kept)], rank[number.ravel()][triangles]


def _grid(spec: SheetSpec, edge_length: float, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of a rectangle of nx by ny squares, each cut by a diagonal."""
    size = np.array(spec.size_cm) * CM
    nx, ny = (max(1, round(float(length) / edge_length)) for length in size)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij"))
    points = np.column_stack([i / nx, j / ny]) * size
    on_line = np.zeros(len(points), bool)
    for x in spec.lines_cm:
        here = np.isclose(points[:, 0], x * CM, rtol=0, atol=1e-9)
        if not here.any():
            raise PatternError(
                f"sheet '{name}': no square ends at lines_cm {x:g}; "
                "choose an edge length that divides it and the width",
                at=("lines_cm",),
            )
        on_line |= here
    if spec.mesh == "jittered":
        inner = (i > 0) & (i < nx) & (j > 0) & (j < ny)
        shift = np.random.default_rng(0).uniform(-JITTER, JITTER, (len(points), 2)) * size / [nx, ny]
        points = points + shift * np.column_stack([inner & ~on_line, inner])
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
    return cKDTree(points).query(along)[1]
