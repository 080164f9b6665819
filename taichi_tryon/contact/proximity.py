"""Which pieces of cloth may come near each other on their way: pairs of a vertex and a triangle, or of two edges.

Boxes around the paths of edges and triangles are sorted into the cells of a grid; every vertex looks for triangles in
the cells of its own box, every edge for edges. What is found is sorted: the same pairs in the same order every run.

While the cloth hardly moves, that is done once with a margin, and only those pairs are looked at again until a vertex
has left it (Verlet 1967, "Computer experiments on classical fluids I").
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.contact.distance import EDGES, FACE, distance
from taichi_tryon.contact.passage import reach
from taichi_tryon.errors import StepFailure
from taichi_tryon.kernel_loops import shared_if_many

# cells of the grid at most, and their size in mean lengths of an edge
CELLS, CELL_SIZE = 1 << 19, 1.5
# how far vertices may go before all pairs are looked for again, in mean lengths of an edge
MARGIN = 0.25


@dataclass(frozen=True)
class Pairs:
    """``kind`` (k,) int32, FACE or EDGES, and ``corners`` (k, 4) of each pair; ``key`` (k,) int64 names it for good."""

    kind: np.ndarray
    corners: np.ndarray
    key: np.ndarray

    def __len__(self) -> int:
        return len(self.kind)

    def __getitem__(self, chosen) -> "Pairs":
        return Pairs(self.kind[chosen], self.corners[chosen], self.key[chosen])


@ti.data_oriented
class Proximity:
    """Finds the pairs of a cloth at ``x`` that come nearer than ``distance`` [m] on the way along ``path``, and some
    that do not quite; pieces that share a corner are no pair."""

    def __init__(self, cloth: Cloth, x, path, distance: float, edge_length: float):
        nv, edges, triangles = cloth.vertex_count, cloth.hinges[:, :2], cloth.triangles
        self.x, self.path, self.distance = x, path, distance
        # vertices, edges and triangles in one row: the first two look, the last two are looked for
        self.nv, self.lookers, self.count = nv, nv + len(edges), nv + len(edges) + len(triangles)
        ids = np.arange(nv)
        self.corners = np.vstack([np.column_stack([ids, ids, ids]), edges[:, [0, 1, 1]], triangles]).astype(np.int32)
        tables = fields.Tables()
        self.corner = tables.vectors(self.corners)
        tables.fill()
        self.low, self.high = (ti.Vector.field(3, float, shape=self.count) for _ in range(2))
        # middle of its corners, the mean of their paths, and how far corners and paths are from those
        self.middle, self.travel = (ti.Vector.field(3, float, shape=self.count) for _ in range(2))
        self.extent = ti.field(float, shape=self.count)
        self.cell = CELL_SIZE * edge_length + distance
        self.slots = 8
        self.margin = MARGIN * edge_length
        # pairs within the margin of where the cloth was ``seen``
        self.known: Pairs | None = None
        self.seen = ti.Vector.field(3, float, shape=nv)
        self.peaks, self.bounds = fields.sums(2), fields.sums(6)

    def find(self) -> Pairs:
        """The pairs on the paths as they are. Raises StepFailure where positions or paths are not finite."""
        self._measure(self.peaks)
        longest, farthest = self.peaks.max(axis=0)
        if not np.isfinite(longest + farthest):
            raise StepFailure("positions or paths of the cloth are not finite")
        if self.known is None or farthest > self.margin:
            if longest > 0.5 * self.margin:
                self.known = None
                return self._search(0.0)
            self.known = self._search(self.margin)
            self._see()
        near = np.empty(len(self.known), np.int32)
        self._choose(self.known.kind, self.known.corners, near)
        return self.known[near == 1]

    def _search(self, margin: float) -> Pairs:
        """All pairs on the paths, or within the ``margin`` [m] that vertices may go, where there is one."""
        self._box(margin)
        low, size, shape = self._grid()
        count = np.zeros(2 * int(np.prod(shape)), np.int32)
        grid = (*low, 1 / size, *(int(n) for n in shape))
        self._sort(*grid, count, np.zeros(1, np.int32), 0)
        start = np.concatenate([[0], np.cumsum(count)]).astype(np.int32)
        items = np.empty(max(int(start[-1]), 1), np.int32)
        self._sort(*grid, start[:-1].copy(), items, 1)
        found = np.empty((self.lookers, self.slots), np.int32)
        number = np.zeros(self.lookers, np.int32)
        self._look(*grid, start, items, found, number, margin)
        if number.max() > self.slots:
            self.slots = 1 << int(number.max()).bit_length()
            found = np.empty((self.lookers, self.slots), np.int32)
            self._look(*grid, start, items, found, number, margin)
        first = np.repeat(np.arange(self.lookers), number)
        second = found[np.arange(self.slots) < number[:, None]]
        return self._pairs(np.sort(first * self.count + second))

    def _pairs(self, key: np.ndarray) -> Pairs:
        first, second = np.divmod(key, self.count)
        a, b = self.corners[first], self.corners[second]
        edges = first >= self.nv
        corners = np.where(edges[:, None], np.hstack([a[:, :2], b[:, :2]]), np.hstack([a[:, :1], b]))
        kind = np.where(edges, EDGES, FACE).astype(np.int32)
        return Pairs(kind, np.ascontiguousarray(corners, np.int32), key)

    def _grid(self) -> tuple[np.ndarray, float, np.ndarray]:
        """Lowest corner, cell size and numbers of cells of a grid around all boxes."""
        self._bound(self.bounds)
        low, high = self.bounds[:, :3].min(axis=0), self.bounds[:, 3:].max(axis=0)
        size = self.cell
        while True:
            shape = np.floor((high - low) / size) + 1
            if shape.prod() <= CELLS:
                return low, size, shape.astype(int)
            size *= 1.26

    @ti.kernel
    def _bound(self, bounds: ti.types.ndarray()):
        """Lowest and highest corners of the vertices' boxes, which are those of all."""
        for chunk in range(fields.CHUNKS):
            first, last = fields.chunk_bounds(chunk, self.nv)
            low, high = self.low[first], self.high[first]
            for i in range(first, last):
                low, high = ti.min(low, self.low[i]), ti.max(high, self.high[i])
            for k in ti.static(range(3)):
                bounds[chunk, k], bounds[chunk, 3 + k] = low[k], high[k]

    @ti.kernel
    def _measure(self, peaks: ti.types.ndarray()):
        """The longest path, and the farthest that a vertex is from where it was seen, at either end of its path."""
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            longest, farthest = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
            for i in range(low, high):
                away = self.x[i] - self.seen[i]
                far = ti.max(away.norm(), (away + self.path[i]).norm())
                # what is not a number must win over every number
                longest = ti.max(longest, ti.cast(self.path[i].norm(), ti.f64))
                farthest = ti.max(farthest, ti.cast(far, ti.f64)) if far < ti.math.inf else ti.math.inf
            peaks[chunk, 0], peaks[chunk, 1] = longest, farthest

    @ti.kernel
    def _see(self):
        for i in range(self.nv):
            self.seen[i] = self.x[i]

    @ti.kernel
    def _choose(self, kind: ti.types.ndarray(), corners: ti.types.ndarray(), near: ti.types.ndarray()):
        for p in range(kind.shape[0]):
            i = ti.Vector([corners[p, 0], corners[p, 1], corners[p, 2], corners[p, 3]])
            near[p] = ti.cast(self._may_meet(kind[p], i, 0.0), ti.i32)

    @ti.kernel
    @shared_if_many
    def _box(self, margin: float):
        for b in range(self.count):
            i = self.corner[b]
            low, high = self.x[i[0]], self.x[i[0]]
            middle, travel = ti.Vector([0.0] * 3), ti.Vector([0.0] * 3)
            for k in range(3):
                at, path = self.x[i[k]], self._path(i[k], margin)
                low, high = ti.min(low, at, at + path), ti.max(high, at, at + path)
                middle, travel = middle + at / 3, travel + path / 3
            radius, spread = ti.cast(0.0, float), ti.cast(0.0, float)
            for k in range(3):
                radius = ti.max(radius, (self.x[i[k]] - middle).norm())
                spread = ti.max(spread, (self._path(i[k], margin) - travel).norm())
            wide = 0.5 * self.distance + margin
            self.low[b], self.high[b] = low - wide, high + wide
            self.middle[b], self.travel[b], self.extent[b] = middle, travel, radius + spread + wide

    @ti.func
    def _path(self, i: int, margin: float):
        """The path of vertex i; none where there is a margin."""
        return self.path[i] if margin == 0.0 else ti.Vector([0.0] * 3)

    @ti.kernel
    @shared_if_many
    def _sort(
        self, x: float, y: float, z: float, per_cell: float, nx: int, ny: int, nz: int,
        place: ti.types.ndarray(), items: ti.types.ndarray(), write: int,
    ):  # fmt: skip
        """Count what lies in each cell, edges and triangles apart; then ``write`` it there, ``place`` being the next
        free place of each cell."""
        for b in range(self.nv, self.count):
            origin = ti.Vector([x, y, z])
            a = ti.cast((self.low[b] - origin) * per_cell, ti.i32)
            e = ti.cast((self.high[b] - origin) * per_cell, ti.i32)
            for i, j, k in ti.ndrange((a[0], e[0] + 1), (a[1], e[1] + 1), (a[2], e[2] + 1)):
                n = ti.atomic_add(place[2 * ((i * ny + j) * nz + k) + ti.cast(b >= self.lookers, ti.i32)], 1)
                if write == 1:
                    items[n] = b

    @ti.kernel
    @shared_if_many
    def _look(
        self, x: float, y: float, z: float, per_cell: float, nx: int, ny: int, nz: int,
        start: ti.types.ndarray(), items: ti.types.ndarray(), found: ti.types.ndarray(), number: ti.types.ndarray(),
        margin: float,
    ):  # fmt: skip
        for q in range(self.lookers):
            origin = ti.Vector([x, y, z])
            low, high = self.low[q], self.high[q]
            a = ti.cast((low - origin) * per_cell, ti.i32)
            e = ti.cast((high - origin) * per_cell, ti.i32)
            kind = EDGES if q >= self.nv else FACE
            count = 0
            for i, j, k in ti.ndrange((a[0], e[0] + 1), (a[1], e[1] + 1), (a[2], e[2] + 1)):
                cell = 2 * ((i * ny + j) * nz + k) + ti.cast(kind == FACE, ti.i32)
                for n in range(start[cell], start[cell + 1]):
                    b = items[n]
                    # edges are met twice, and boxes in every cell that they share: once is enough
                    if b > q and self._overlap(q, b):
                        at = ti.cast((ti.max(low, self.low[b]) - origin) * per_cell, ti.i32)
                        if at[0] == i and at[1] == j and at[2] == k and self._near(kind, q, b, margin):
                            if count < found.shape[1]:
                                found[q, count] = b
                            count += 1
            number[q] = count

    @ti.func
    def _overlap(self, q: int, b: int):
        """Whether boxes overlap, and balls around the two in a frame that moves along with one of them."""
        result = False
        if (self.low[q] <= self.high[b]).all() and (self.low[b] <= self.high[q]).all():
            apart = (self.middle[q] - self.middle[b]).norm()
            result = apart <= self.extent[q] + self.extent[b] + (self.travel[q] - self.travel[b]).norm()
        return result

    @ti.func
    def _near(self, kind: int, q: int, b: int, margin: float):
        """Whether the two share no corner and may meet."""
        p, r = self.corner[q], self.corner[b]
        i = ti.Vector([p[0], r[0], r[1], r[2]])
        apart = p[0] != r[0] and p[0] != r[1] and p[0] != r[2]
        if kind == EDGES:
            i = ti.Vector([p[0], p[1], r[0], r[1]])
            apart = apart and p[1] != r[0] and p[1] != r[1]
        near = False
        if apart:
            near = self._may_meet(kind, i, margin)
        return near

    @ti.func
    def _may_meet(self, kind: int, i, margin: float):
        """Whether a pair can come nearer than ``distance`` on its paths, or where its corners go by the ``margin``."""
        now = distance(kind, self.x[i[0]], self.x[i[1]], self.x[i[2]], self.x[i[3]])
        gone = 2.0 * margin
        if margin == 0.0:
            gone = reach(kind, self.path[i[0]], self.path[i[1]], self.path[i[2]], self.path[i[3]])
        return now < self.distance + gone
