"""The sewn mesh of a garment: every panel triangulated in the flat, seams and darts welded into shared vertices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from taichi_tryon.errors import below
from taichi_tryon.mesh.bands import Tapes, lay_tapes
from taichi_tryon.mesh.ears import open_crowded_ears
from taichi_tryon.mesh.sampling import EdgeSamples, sample_edges
from taichi_tryon.mesh.topology import Topology
from taichi_tryon.mesh.triangulate import corner_angles, triangulate
from taichi_tryon.pattern.check import check
from taichi_tryon.pattern.panel import EdgeName, Panel, Pattern


@dataclass(frozen=True, eq=False)
class GarmentMesh:
    """A garment of ``vertex_count`` vertices and nt triangles, known in three ways.

    Sewn: ``triangles`` (nt, 3) int32 of vertices, counter-clockwise seen from outside the wearer; ``panel`` (nt,) is
    the number of each one's panel in ``panel_names``.

    At rest: ``rest`` (nt, 3, 2) [m], the triangles' corners in material coordinates: axis 0 along the warp, axis 1
    along the weft, 90 degrees counter-clockwise from it.

    In the flat pattern: ``pattern_points`` (np, 2) [m] in the coordinates of the panel ``point_panel`` (np,), drawn
    from outside; ``point_vertex`` (np,) is the vertex each became; ``point_triangles`` (nt, 3) are the triangles in
    pattern points. ``edge_points`` gives for (panel, edge) the pattern points along the edge, in its own direction.
    ``tapes`` are the pattern's bands; ``opened`` the vertices on the rims of closures that are open.
    """

    name: str
    triangles: np.ndarray
    rest: np.ndarray
    panel: np.ndarray
    panel_names: tuple[str, ...]
    vertex_count: int
    pattern_points: np.ndarray
    point_panel: np.ndarray
    point_vertex: np.ndarray
    point_triangles: np.ndarray
    edge_points: dict[EdgeName, np.ndarray]
    tapes: Tapes
    opened: np.ndarray

    def edge_vertices(self, panel: str, edge: str) -> np.ndarray:
        """Vertices along an edge of a panel, in the edge's own direction."""
        return self.point_vertex[self.edge_points[panel, edge]]

    @cached_property
    def topology(self) -> Topology:
        return Topology.of(self.triangles, self.vertex_count, [f"panel '{self.panel_names[p]}'" for p in self.panel])

    @cached_property
    def areas(self) -> np.ndarray:
        """Areas (nt,) [m^2] at rest."""
        a, b = (self.rest[:, i] - self.rest[:, 0] for i in (1, 2))
        return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2

    @cached_property
    def edge_lengths(self) -> np.ndarray:
        """Lengths (ne,) [m] of the sewn mesh's edges at rest, in the order of the topology; a seam's is its mean."""
        lengths = np.linalg.norm(np.roll(self.rest, -1, axis=1) - self.rest, axis=2).ravel()
        edges = self.topology.triangle_edges.ravel()
        return np.bincount(edges, lengths) / np.bincount(edges)

    @cached_property
    def min_angle_deg(self) -> float:
        """The smallest angle of any triangle, sharp pattern corners included."""
        return float(np.degrees(corner_angles(self.rest).min()))


def build(pattern: Pattern, edge_length: float, name: str) -> GarmentMesh:
    """Mesh and sew a pattern with triangles of about ``edge_length`` [m].

    Raises PatternError where the pattern cannot be sewn or meshed, naming seam or panel.
    """
    check(pattern)
    samples = sample_edges(pattern, edge_length)
    flats: dict[str, _Flat] = {}
    for panel in pattern.panels.values():
        with below("panels", panel.mirror_of or panel.name):
            flats[panel.name] = _mesh_panel(panel, samples, edge_length, flats.get(panel.mirror_of or ""))

    first_point = dict(zip(flats, np.cumsum([0] + [len(flat.points) for flat in flats.values()]), strict=False))
    points = np.concatenate([flat.points for flat in flats.values()])
    edge_points = {
        (panel, edge): numbers + first_point[panel]
        for panel, flat in flats.items()
        for edge, numbers in flat.edges.items()
    }
    point_vertex, vertex_count = _weld(len(points), edge_points, samples)
    point_triangles = np.concatenate([flat.triangles + first_point[panel] for panel, flat in flats.items()])
    point_triangles = open_crowded_ears(points, point_triangles, point_vertex)
    numbers = np.arange(len(flats))
    point_panel = np.repeat(numbers, [len(flat.points) for flat in flats.values()])
    grains = np.stack([panel.grain for panel in pattern.panels.values()])
    mesh = GarmentMesh(
        name=name,
        triangles=point_vertex[point_triangles].astype(np.int32),
        rest=material_coordinates(points, grains[point_panel])[point_triangles],
        panel=point_panel[point_triangles[:, 0]].astype(np.int32),
        panel_names=tuple(flats),
        vertex_count=vertex_count,
        pattern_points=points,
        point_panel=point_panel.astype(np.int32),
        point_vertex=point_vertex.astype(np.int32),
        point_triangles=point_triangles.astype(np.int32),
        edge_points=edge_points,
        tapes=lay_tapes(pattern.bands, points, point_vertex, edge_points),
        opened=_opened(edge_points, point_vertex, samples),
    )
    with below("seams"):
        _ = mesh.topology  # refuses what is not a cloth
    return mesh


@dataclass(frozen=True, eq=False)
class _Flat:
    """One panel's mesh: points (p, 2), the boundary first; triangles (t, 3); the point numbers along each edge."""

    points: np.ndarray
    triangles: np.ndarray
    edges: dict[str, np.ndarray]
    boundary_count: int


def _mesh_panel(
    panel: Panel, samples: dict[EdgeName, EdgeSamples], edge_length: float, original: _Flat | None
) -> _Flat:
    """Mesh a panel; a mirrored one gets the mirror image of its ``original``'s mesh wherever their edges are alike."""
    along = [edge.at(samples[panel.name, edge.name].fractions) for edge in panel.edges]
    outline = np.concatenate([points[:-1] for points in along])
    count = len(outline)
    starts = np.cumsum([0] + [len(points) - 1 for points in along])
    edges = {
        edge.name: np.arange(start, start + len(points)) % count
        for edge, start, points in zip(panel.edges, starts, along, strict=False)
    }
    if original is not None and original.boundary_count == count:
        # a mirrored loop runs backwards: its point i is the original's point count - i
        back = np.concatenate([-np.arange(count) % count, np.arange(count, len(original.points))])
        points = original.points[back] * [-1.0, 1.0] + 0.0
        if np.allclose(points[:count], outline, rtol=0, atol=1e-9):
            return _Flat(points, back[original.triangles[:, ::-1]], edges, count)
    points, triangles = triangulate(outline, edge_length, panel.name)
    return _Flat(points, triangles, edges, count)


def _weld(
    point_count: int, edge_points: dict[EdgeName, np.ndarray], samples: dict[EdgeName, EdgeSamples]
) -> tuple[np.ndarray, int]:
    """The vertex (np,) of every pattern point, and how many there are: points on one knot of a seam are one vertex."""
    first_on_knot: dict[tuple[str, int], int] = {}
    pairs = []
    for name, numbers in edge_points.items():
        sample = samples[name]
        if sample.seam is not None:
            of_seam = zip(numbers[sample.sewn].tolist(), sample.knots[sample.sewn].tolist(), strict=True)
            for number, knot in of_seam:
                pairs.append((first_on_knot.setdefault((sample.seam, knot), number), number))
    i, j = np.array(pairs, dtype=int).reshape(-1, 2).T
    graph = coo_array((np.ones(len(i)), (i, j)), shape=(point_count, point_count))
    count, labels = connected_components(graph, directed=False)
    # number the vertices in the order of their first points, whatever the labels' order
    _, first = np.unique(labels, return_index=True)
    rank = np.empty(count, dtype=int)
    rank[np.argsort(first)] = np.arange(count)
    return rank[labels], count


def _opened(
    edge_points: dict[EdgeName, np.ndarray], point_vertex: np.ndarray, samples: dict[EdgeName, EdgeSamples]
) -> np.ndarray:
    """Vertices (k,) on edges of a seam where it is not sewn."""
    open_ = [points[~samples[name].sewn] for name, points in edge_points.items() if samples[name].seam is not None]
    return np.unique(point_vertex[np.concatenate([np.zeros(0, int), *open_])])


def material_coordinates(points: np.ndarray, grain: np.ndarray) -> np.ndarray:
    """Points (n, 2) turned so that axis 0 lies along the grain (n, 2)."""
    across = np.stack([-grain[:, 1], grain[:, 0]], axis=1)
    return np.stack([(points * grain).sum(axis=1), (points * across).sum(axis=1)], axis=1)
