"""What borders on what in a triangle mesh, as flat tables for gathering."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from taichi_tryon.errors import PatternError


@dataclass(frozen=True, eq=False)
class Table:
    """A ragged table: row i is ``items[offsets[i]:offsets[i + 1]]``, int32."""

    offsets: np.ndarray
    items: np.ndarray

    def __getitem__(self, row: int) -> np.ndarray:
        return self.items[self.offsets[row] : self.offsets[row + 1]]

    @property
    def longest(self) -> int:
        return int(np.diff(self.offsets).max(initial=0))

    @classmethod
    def group(cls, rows: np.ndarray, items: np.ndarray, row_count: int) -> Table:
        """Sort items into rows, by item within a row."""
        order = np.lexsort((items, rows))
        offsets = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=row_count))])
        return cls(offsets.astype(np.int32), items[order].astype(np.int32))


@dataclass(frozen=True, eq=False)
class Topology:
    """Adjacency of an oriented manifold mesh with ``vertex_count`` vertices and ``triangles`` (nt, 3).

    ``edges`` (ne, 2), in rising order. Column 0 of ``edge_triangles`` (ne, 2) is the triangle that runs along the edge
    from its first to its second vertex, column 1 the other one; ``opposite`` (ne, 2) are their third vertices; -1 where
    there is none. ``triangle_edges`` (nt, 3): edge from corner i to corner i + 1.
    """

    vertex_count: int
    triangles: np.ndarray
    edges: np.ndarray
    edge_triangles: np.ndarray
    opposite: np.ndarray
    triangle_edges: np.ndarray

    @classmethod
    def of(cls, triangles: np.ndarray, vertex_count: int, labels: Sequence[str] | None = None) -> Topology:
        """The topology of triangles (nt, 3); ``labels`` (nt,) say in messages where a triangle is.

        Raises PatternError where a triangle has a vertex twice, more than two triangles share an edge, or two
        neighbours face opposite ways.
        """
        triangles = np.asarray(triangles, dtype=np.int32)
        labels = labels if labels is not None else [f"triangle {i}" for i in range(len(triangles))]
        _refuse(repeated_corners(triangles)[:, None], labels, "a triangle has two corners that are sewn together")
        starts, ends = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
        owners, thirds = np.repeat(np.arange(len(triangles)), 3), np.roll(triangles, -2, axis=1).ravel()
        sides = np.sort(np.stack([starts, ends], axis=1), axis=1)
        edges, edge_of_side, uses = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
        edge_of_side = edge_of_side.ravel()
        crowded = np.flatnonzero(uses > 2)
        _refuse([owners[edge_of_side == e] for e in crowded[:1]], labels, "more than two triangles share an edge")
        column = (starts != edges[edge_of_side, 0]).astype(int)
        slots, slot_uses = np.unique(2 * edge_of_side + column, return_counts=True)
        twisted = slots[slot_uses > 1] // 2
        _refuse([owners[edge_of_side == e] for e in twisted[:1]], labels, "neighbouring triangles face opposite ways")
        edge_triangles = np.full((len(edges), 2), -1, dtype=np.int32)
        opposite = np.full((len(edges), 2), -1, dtype=np.int32)
        edge_triangles[edge_of_side, column] = owners
        opposite[edge_of_side, column] = thirds
        return cls(
            vertex_count, triangles, edges.astype(np.int32), edge_triangles, opposite,
            edge_of_side.reshape(-1, 3).astype(np.int32),
        )  # fmt: skip

    @cached_property
    def is_boundary(self) -> np.ndarray:
        """Whether an edge (ne,) has one triangle only."""
        return (self.edge_triangles < 0).any(axis=1)

    @cached_property
    def vertex_triangles(self) -> Table:
        """For every vertex its triangles."""
        return Table.group(self.triangles.ravel(), np.repeat(np.arange(len(self.triangles)), 3), self.vertex_count)

    @cached_property
    def vertex_corners(self) -> Table:
        """For every vertex its corners, each as 3 * triangle + corner."""
        return Table.group(self.triangles.ravel(), np.arange(self.triangles.size), self.vertex_count)

    @cached_property
    def vertex_edges(self) -> Table:
        """For every vertex its edges."""
        return Table.group(self.edges.ravel(), np.repeat(np.arange(len(self.edges)), 2), self.vertex_count)

    @cached_property
    def vertex_neighbours(self) -> Table:
        """For every vertex the vertices that share an edge with it."""
        return Table.group(self.edges.ravel(), self.edges[:, ::-1].ravel(), self.vertex_count)

    @cached_property
    def euler_characteristic(self) -> int:
        """Vertices - edges + triangles: 2 - openings for one piece of cloth without handles."""
        return len(np.unique(self.triangles)) - len(self.edges) + len(self.triangles)

    @cached_property
    def component_count(self) -> int:
        """Pieces of cloth that hang together; vertices of no triangle are left out."""
        graph = coo_array((np.ones(len(self.edges)), self.edges.T), shape=(self.vertex_count,) * 2)
        _, labels = connected_components(graph, directed=False)
        return len(np.unique(labels[self.triangles]))

    def boundary_loops(self) -> list[np.ndarray]:
        """Closed chains of boundary vertices, one an opening or rim, with the cloth on the left of their sense.

        Raises PatternError where two rims touch at a vertex.
        """
        border = np.flatnonzero(self.is_boundary)
        forward = self.edge_triangles[border, 0] >= 0
        runs = np.where(forward[:, None], self.edges[border], self.edges[border][:, ::-1])
        following = dict(runs.tolist())
        if len(following) < len(runs):
            raise PatternError("two rims of the garment touch in one point; sew along an edge or leave them apart")
        loops = []
        while following:
            loop = [next(iter(following))]
            while loop[-1] in following:
                loop.append(following.pop(loop[-1]))
            loops.append(np.array(loop[:-1]))
        return loops


def repeated_corners(triangles: np.ndarray) -> np.ndarray:
    """Triangles (k,) that have a vertex twice."""
    return np.flatnonzero((triangles == np.roll(triangles, -1, axis=1)).any(axis=1))


def _refuse(cases: Sequence[Sequence[int]], labels: Sequence[str], what: str) -> None:
    """Raise PatternError for the first case, a group of triangles."""
    for case in cases:
        where = ", ".join(dict.fromkeys(labels[i] for i in case))
        raise PatternError(f"{what} ({where}); check the seams there, or use a smaller edge length")
