"""Laying a garment around the body (paper, section 5): the start of the simulation.

Every panel is mapped to (u, theta), laid on its ruled surface and pushed out of the body along the radius. Panels meet
where they are sewn. Then the cloth is drawn together where it is stretched, kept clear of the body, and checked.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_tryon.body.model import Balls, Body
from taichi_tryon.dressing.check import body_gaps
from taichi_tryon.dressing.disks import disk_frame, make_disk
from taichi_tryon.dressing.join import join
from taichi_tryon.dressing.layers import Layer, lift
from taichi_tryon.dressing.panel_map import PanelMap, map_panel
from taichi_tryon.dressing.relax import clear, draw_together, neighbour_matrix, part_rims, untangle
from taichi_tryon.dressing.spec import DressingSpec
from taichi_tryon.dressing.surface import RuledSurface, push_along_radius
from taichi_tryon.errors import DressingError, below
from taichi_tryon.mesh.garment import GarmentMesh
from taichi_tryon.pattern.panel import Pattern
from taichi_tryon.units import MM

__all__ = ["Dressed", "FitLine", "disk_frame", "dress"]

LIFTS, LIFTED = 20, 1e-4  # attempts to lay a garment over those underneath, and a shift that is none any more [m]
ELSEWHERE = "or let the scene begin in another pose and lead the body to this one by `motion`"
LEAST_SHARE = 0.2  # of the clearance that vertices, midpoints and centroids must keep at least


@dataclass(frozen=True)
class FitLine:
    """An opening of the garment (hem, cuff, waist) that was laid on a disk."""

    name: str
    disk: str
    vertices: np.ndarray  # (k,) ids
    bone: str  # that carries the disk


@dataclass(frozen=True)
class Dressed:
    """A checked start."""

    positions: np.ndarray  # (nv, 3) [m]
    lines: tuple[FitLine, ...]
    notes: tuple[str, ...]


def dress(
    pattern: Pattern,
    mesh: GarmentMesh,
    spec: DressingSpec,
    body: Body,
    transforms: np.ndarray,
    under: tuple[Layer, ...] = (),
) -> Dressed:
    """Lay a meshed pattern around the body whose bones stand at ``transforms`` (b, 4, 4).

    ``under`` are the garments worn underneath, the innermost first: this one lies ``layer_mm`` further out for each of
    them, and as far over them where they stand off the body. Raises DressingError, naming panel and disk, where a panel
    cannot be mapped, the cloth does not come clear of the body, or triangles cross away from the stretched seams.
    """
    _check_names(pattern, spec)
    balls = body.posed(transforms)
    extra = len(under) * spec.layer_mm * MM
    clearance = spec.clearance_mm * MM + extra
    names = sorted({disk for panel in mesh.panel_names for disk in spec.disks_of(panel)})
    disks = {}
    for name in names:
        with below("disks", name):
            disks[name] = make_disk(spec, name, body, transforms, balls, extra)
    maps = []
    for name in mesh.panel_names:
        with below("panels", name):
            maps.append(map_panel(spec, pattern, mesh, name))
    placed = []
    for m in maps:
        first, last = spec.panels[m.panel].around
        surface = RuledSurface(tuple(disks[name] for name in m.disks))
        _check_order(spec, m.panel, surface)
        groups = body.groups(*dict.fromkeys(group for disk in m.disks for group in spec.disks[disk].groups))
        points = surface.point(m.u, first + m.t * (last - first))
        placed.append(push_along_radius(points, surface.axis(m.u), balls, groups, clearance))

    edges, lengths = mesh.topology.edges, mesh.edge_lengths
    x = join(maps, placed, neighbour_matrix(edges, mesh.vertex_count), float(lengths.mean()))
    x = part_rims(x, mesh.opened, edges)
    x = draw_together(x, edges, lengths, balls, clearance)
    x = clear(x, mesh.triangles, edges, balls, clearance)
    for _ in range(LIFTS if under else 0):
        shift = lift(x, under, spec.layer_mm * MM)
        if np.abs(shift).max() < LIFTED:
            break
        x = clear(x + shift, mesh.triangles, edges, balls, clearance)
    x, crossing = untangle(x, mesh.triangles, edges, balls, clearance)
    notes = _check(x, crossing, mesh, spec, maps, balls, clearance, pattern)
    return Dressed(x, _fit_lines(spec, mesh), notes)


def _check_names(pattern: Pattern, spec: DressingSpec) -> None:
    for name in pattern.panels:
        if name not in spec.panels:
            raise DressingError(
                f"dressing '{spec.dressing}' lacks panel '{name}' of pattern '{pattern.name}'", at=("panels",)
            )
    for name in spec.panels:
        if name not in pattern.panels:
            raise DressingError(f"dressing '{spec.dressing}': pattern '{pattern.name}' has no panel '{name}'; "
                                f"panels: {', '.join(pattern.panels)}", at=("panels", name))  # fmt: skip


def _check_order(spec: DressingSpec, panel: str, surface: RuledSurface) -> None:
    """Every disk must lie beyond the one before it all round, or the surface would turn back into itself."""
    for upper, lower in zip(surface.disks, surface.disks[1:], strict=False):
        along = (lower.rim - upper.rim) @ (upper.normal + lower.normal)
        if along.min() <= 0:
            share = round(100 * float((along <= 0).mean()))
            raise DressingError(
                f"dressing '{spec.dressing}', panel '{panel}': disk '{lower.name}' does not lie beyond disk "
                f"'{upper.name}' on {share} % of the way round; mend their order, places or normals, {ELSEWHERE}",
                at=("surfaces", spec.panels[panel].surface),
            )


def _check(
    x: np.ndarray,
    pairs: np.ndarray,
    mesh: GarmentMesh,
    spec: DressingSpec,
    maps: list[PanelMap],
    balls: Balls,
    clearance: float,
    pattern: Pattern,
) -> tuple[str, ...]:
    least = LEAST_SHARE * clearance
    gaps = body_gaps(x, mesh.triangles, balls)
    worst = int(gaps.argmin())
    if gaps[worst] < least:
        raise DressingError(
            f"dressing '{spec.dressing}': {_place(worst, mesh, maps)} is {_side(gaps[worst])} "
            f"({least * 1e3:.1f} mm outside is the least); "
            f"widen the disk, put another one where the surface cuts through the body, {ELSEWHERE}",
            at=_disk_at(worst, mesh, maps),
        )
    excused = _beside_stretched_seams(mesh, spec, pattern)
    bad = pairs[~(excused[pairs[:, 0]] & excused[pairs[:, 1]])]
    if len(bad):
        raise DressingError(
            f"dressing '{spec.dressing}': {len(bad)} pairs of triangles cross, "
            f"the first {_place(bad[0, 0], mesh, maps)} with "
            f"{_place(bad[0, 1], mesh, maps)}; widen the outer of the two disks, narrow the inner one, {ELSEWHERE}",
            at=_disk_at(bad[0, 0], mesh, maps),
        )
    if len(pairs):
        seams = ", ".join(spec.stretched_seams)
        return (f"{len(pairs)} pairs of triangles cross beside the stretched seams ({seams}); the drape frees them",)
    return ()


def _side(gap: float) -> str:
    return f"{-gap * 1e3:.1f} mm inside the body" if gap < 0 else f"{gap * 1e3:.1f} mm outside the body"


def _place(triangle: int, mesh: GarmentMesh, maps: list[PanelMap]) -> str:
    """Panel of a triangle and the disk nearest to it, in words."""
    m = maps[int(mesh.panel[triangle])]
    return f"panel '{m.panel}' near disk '{_nearest_disk(triangle, mesh, m)}'"


def _disk_at(triangle: int, mesh: GarmentMesh, maps: list[PanelMap]) -> tuple[str, str]:
    """Where the disk nearest to a triangle stands in the dressing."""
    return "disks", _nearest_disk(triangle, mesh, maps[int(mesh.panel[triangle])])


def _nearest_disk(triangle: int, mesh: GarmentMesh, m: PanelMap) -> str:
    u = m.u[np.isin(m.vertices, mesh.triangles[triangle])].mean()
    return m.disks[int(round(u))]


def _beside_stretched_seams(mesh: GarmentMesh, spec: DressingSpec, pattern: Pattern) -> np.ndarray:
    """(nt,) bool: triangles with a corner within two rings of an edge named as stretched."""
    marked = np.zeros(mesh.vertex_count, bool)
    for index, entry in enumerate(spec.stretched_seams):
        found = [points for (_, edge), points in mesh.edge_points.items() if edge == entry]
        if not found:
            message = f"dressing '{spec.dressing}': no edge is named '{entry}'"
            raise DressingError(message, at=("stretched_seams", index))
        marked[mesh.point_vertex[np.concatenate(found)]] = True
    for _ in range(2):
        marked[mesh.triangles[marked[mesh.triangles].any(axis=1)]] = True
    return marked[mesh.triangles].any(axis=1)


def _fit_lines(spec: DressingSpec, mesh: GarmentMesh) -> tuple[FitLine, ...]:
    lines = []
    for name, disk in spec.lines.items():
        points = [mesh.edge_points[(panel, edge)] for panel, where in spec.panels.items()
                  for edges, at in ((where.top, 0), (where.bottom, -1)) if spec.disks_of(panel)[at] == disk
                  for edge in edges]  # fmt: skip
        if not points:
            message = f"dressing '{spec.dressing}': line '{name}': no top or bottom lies on disk '{disk}'"
            raise DressingError(message, at=("lines", name))
        vertices = np.unique(mesh.point_vertex[np.concatenate(points)])
        lines.append(FitLine(name, disk, vertices, spec.disks[disk].turns_with))
    return tuple(lines)
