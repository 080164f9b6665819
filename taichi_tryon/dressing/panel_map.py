"""The panels of a meshed garment in (u, theta): which points lie on which side, and the map of flatten.py for each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_tryon.dressing.flatten import harmonic, locate, mean_value_weights, remap_rows, signed_areas
from taichi_tryon.dressing.spec import DressingSpec, PanelSpec
from taichi_tryon.errors import DressingError
from taichi_tryon.mesh.garment import GarmentMesh
from taichi_tryon.pattern.panel import Panel, Pattern
from taichi_tryon.units import CM

ROW_SAMPLES = 80


@dataclass(frozen=True)
class PanelMap:
    """One panel, its darts closed, on the rectangle 0 <= u <= disks - 1, 0 <= t <= 1."""

    panel: str
    disks: tuple[str, ...]
    vertices: np.ndarray  # (n,) welded ids of the garment
    triangles: np.ndarray  # (m, 3) local ids
    weights: object  # sparse (n, n) mean-value weights
    u: np.ndarray  # (n,)
    t: np.ndarray  # (n,) from the panel's left side to its right side
    sides: np.ndarray  # local ids on the left and right side
    laid: np.ndarray  # local ids on top and bottom


def map_panel(spec: DressingSpec, pattern: Pattern, mesh: GarmentMesh, name: str) -> PanelMap:
    """The map of one panel; DressingError names panel and disk where lines are out of order or triangles fold."""
    panel, where, disks = pattern.panels[name], spec.panels[name], spec.disks_of(name)
    points = np.flatnonzero(mesh.point_panel == mesh.panel_names.index(name))
    local = _close_darts(pattern, mesh, name, points)
    chosen = np.isin(mesh.point_triangles[:, 0], points)
    triangles = local[mesh.point_triangles[chosen]]
    corners = mesh.pattern_points[mesh.point_triangles[chosen]]
    n = local[points].max() + 1
    vertices = np.empty(n, int)
    vertices[local[points]] = mesh.point_vertex[points]

    top, right, bottom, left = (_chain(mesh, name, edges) for edges in _sides(spec, pattern, panel, mesh))
    top, right = top[::-1], right[::-1]  # all four now run from top to bottom or from left to right
    arc = {
        side: _arc(mesh, local, chain)
        for side, chain in (("top", top), ("bottom", bottom), ("left", left), ("right", right))
    }
    chains = (("left", left), ("right", right))
    fractions = {side: _row_fractions(mesh, panel, where, disks, side, chain, arc[side]) for side, chain in chains}
    heights = 0.5 * (fractions["left"] + fractions["right"])
    boundary = {}
    for (side, chain), t in zip(chains, (0.0, 1.0), strict=True):
        v = np.interp(arc[side], fractions[side], heights)
        boundary |= {local[p]: (v_, t) for p, v_ in zip(chain, v, strict=True)}
    for side, chain, v in (("top", top, 0.0), ("bottom", bottom, 1.0)):
        boundary |= {local[p]: (v, t) for p, t in zip(chain, arc[side], strict=True)}

    weights = mean_value_weights(triangles, corners, n)
    rectangle = harmonic(weights, np.array(list(boundary)), np.array(list(boundary.values())))
    rows = []
    for k in range(1, len(disks) - 1):
        ends = [_at_fraction(mesh.pattern_points[chain], arc[side], fractions[side][k]) for side, chain in chains]
        line = ends[0] + np.linspace(0, 1, ROW_SAMPLES)[:, None] * (ends[1] - ends[0])
        traced = locate(line[1:-1], corners, rectangle[triangles])
        rows.append(np.vstack([[heights[k], 0.0], traced[np.isfinite(traced[:, 0])], [heights[k], 1.0]]))
    u = remap_rows(rectangle, rows, name, disks)
    t = rectangle[:, 1]
    folded = signed_areas(triangles, np.stack([t, -u], axis=1)) < -1e-9
    if folded.any():
        disk = disks[int(round(u[triangles[folded]].mean()))]
        message = f"panel '{name}': {folded.sum()} triangles fold near disk '{disk}'; straighten its rows"
        raise DressingError(message, at=("rows",))
    sides = np.unique(local[np.concatenate([left, right])])
    laid = np.unique(local[np.concatenate([top, bottom])])
    return PanelMap(name, tuple(disks), vertices, triangles, weights, u, t, sides, laid)


def dart_edges(pattern: Pattern, name: str) -> list[str]:
    """Edges of a panel that are sewn to their neighbour in the outline: dart legs."""
    order = [edge.name for edge in pattern.panels[name].edges]
    legs = []
    for seam in pattern.seams:
        if len(seam.a) == len(seam.b) == 1 and seam.a[0][0] == seam.b[0][0] == name:
            i, j = order.index(seam.a[0][1]), order.index(seam.b[0][1])
            if (i - j) % len(order) in (1, len(order) - 1):
                legs += [seam.a[0][1], seam.b[0][1]]
    return legs


def _close_darts(pattern: Pattern, mesh: GarmentMesh, name: str, points: np.ndarray) -> np.ndarray:
    """Local id for each pattern point of the panel (-1 elsewhere); the two legs of a dart share theirs."""
    legs = dart_edges(pattern, name)
    local = np.full(len(mesh.pattern_points), -1)
    local[points] = np.arange(len(points))
    if legs:
        sewn = np.unique(np.concatenate([mesh.edge_points[(name, edge)] for edge in legs]))
        _, group = np.unique(mesh.point_vertex[sewn], return_inverse=True)
        local[sewn] = len(points) + group
        local[points] = np.unique(local[points], return_inverse=True)[1]
    return local


def _sides(spec: DressingSpec, pattern: Pattern, panel: Panel, mesh: GarmentMesh) -> list[list[str]]:
    """Edges of top, right, bottom and left, each in the order of a counter-clockwise walk, darts left out."""
    where = spec.panels[panel.name]
    names = [edge.name for edge in panel.edges]
    for key, edges in (("top", where.top), ("bottom", where.bottom)):
        for edge in edges:
            if edge not in names:
                raise DressingError(f"panel '{panel.name}' has no edge '{edge}'; edges: {', '.join(names)}", at=(key,))
    walk = np.concatenate([mesh.edge_points[(panel.name, edge)][:-1] for edge in names])
    x, y = mesh.pattern_points[walk].T
    clockwise = (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() < 0
    order = [edge for edge in (names[::-1] if clockwise else names) if edge not in dart_edges(pattern, panel.name)]
    kinds = [0 if edge in where.top else 2 if edge in where.bottom else 1 for edge in order]
    starts = [i for i in range(len(order)) if kinds[i] != kinds[i - 1]]
    if len(starts) != 4:
        first, last = spec.disks_of(panel.name)[0], spec.disks_of(panel.name)[-1]
        raise DressingError(
            f"panel '{panel.name}': the edges on disk '{first}' and those on disk '{last}' must each be one run "
            f"of its outline, with other edges between them on both sides; outline: {', '.join(order)}",
            at=("top",),
        )
    runs = [[order[i % len(order)] for i in range(a, b if b > a else b + len(order))]
            for a, b in zip(starts, starts[1:] + starts[:1], strict=True)]  # fmt: skip
    bottom = next(k for k in range(4) if runs[k][0] in where.bottom)
    after = [runs[(bottom + k) % 4] for k in range(4)]  # bottom, right, top, left
    return [after[2], after[1], after[0], after[3]]


def _chain(mesh: GarmentMesh, panel: str, edges: list[str]) -> np.ndarray:
    """Pattern points along a run of edges, counter-clockwise; both legs' ends of a dart between two edges are kept."""
    steps = [1 if _counter_clockwise(mesh, panel, edge) else -1 for edge in edges]
    chain = np.concatenate([mesh.edge_points[(panel, edge)][::step] for edge, step in zip(edges, steps, strict=True)])
    return chain[np.concatenate([[True], chain[1:] != chain[:-1]])]


def _counter_clockwise(mesh: GarmentMesh, panel: str, edge: str) -> bool:
    """Whether an edge runs with the panel on its left."""
    a, b = mesh.edge_points[(panel, edge)][:2]
    own = mesh.point_triangles[(mesh.point_triangles == a).any(axis=1) & (mesh.point_triangles == b).any(axis=1)][0]
    c = own[(own != a) & (own != b)][0]
    p, q = mesh.pattern_points[b] - mesh.pattern_points[a], mesh.pattern_points[c] - mesh.pattern_points[a]
    return bool(p[0] * q[1] - p[1] * q[0] > 0)


def _arc(mesh: GarmentMesh, local: np.ndarray, chain: np.ndarray) -> np.ndarray:
    """Share of the length, 0 to 1, at each point of a chain; the step across a closed dart counts nothing."""
    step = np.linalg.norm(np.diff(mesh.pattern_points[chain], axis=0), axis=1)
    step[local[chain[1:]] == local[chain[:-1]]] = 0.0
    length = np.concatenate([[0.0], np.cumsum(step)])
    return length / length[-1]


def _at_fraction(points: np.ndarray, arc: np.ndarray, fraction: float) -> np.ndarray:
    return np.array([np.interp(fraction, arc, points[:, k]) for k in range(2)])


def _row_fractions(
    mesh: GarmentMesh, panel: Panel, where: PanelSpec, disks: list[str], side: str, chain: np.ndarray, arc: np.ndarray
) -> np.ndarray:
    """Shares of the length of a side, from its top, at which it meets each disk (first 0, last 1)."""
    points = mesh.pattern_points[chain]
    shares = [0.0]
    for disk in disks[1:-1]:
        row = where.rows[disk]
        end = row[side == "right"] if isinstance(row, list) else row
        place = f"panel '{panel.name}', row on disk '{disk}', {side} side"
        if isinstance(end, str):
            edge, which = end.split(".")
            if (panel.name, edge) not in mesh.edge_points:
                names = ", ".join(edge.name for edge in panel.edges)
                raise DressingError(f"{place}: no edge '{edge}'; edges: {names}", at=("rows", disk))
            point = mesh.edge_points[(panel.name, edge)][0 if which == "start" else -1]
            found = np.flatnonzero(chain == point)
            if not len(found):
                raise DressingError(f"{place}: {end} does not lie on that side", at=("rows", disk))
            shares.append(float(arc[found[0]]))
        else:
            y = points[:, 1] - end * CM
            found = np.flatnonzero((y[:-1] >= 0) & (y[1:] < 0))
            if not len(found):
                low, high = points[:, 1].min() / CM, points[:, 1].max() / CM
                raise DressingError(
                    f"{place}: the side does not cross y = {end:g} cm; it spans {high:.1f} to {low:.1f}",
                    at=("rows", disk),
                )
            i = found[0]
            shares.append(float(arc[i] + (arc[i + 1] - arc[i]) * y[i] / (y[i] - y[i + 1])))
        if shares[-1] <= shares[-2] or shares[-1] >= 1:
            message = f"{place}: it must lie below the row before it and above the bottom"
            raise DressingError(message, at=("rows", disk))
    return np.array([*shares, 1.0])
