"""Which pieces of cloth may come near each other on their way: pairs of a vertex and a triangle, or of two edges.

Boxes around the paths of edges and triangles are sorted into the cells of a grid; every vertex looks for triangles in
the cells of its own box, every edge for edges. What is found is sorted: the same pairs in the same order every run.

While most of the cloth hardly moves, that is done once with a margin, and only those pairs are looked at again (Verlet
1967, "Computer experiments on classical fluids I"); for what has left its margin, and only for that, pairs are looked
for anew. What the cloth moves as a whole does not count: who falls together stays together.
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
# how far vertices may go before their pairs are looked for again, in mean lengths of an edge
MARGIN = 0.25
# the part of that which hardly moving cloth goes at a time, the part of the vertices that may have left their margin
# before all pairs are looked for, and how many margins one may go before those on the paths alone are
SLOW, FEW, LONG = 0.5, 0.125, 2.0


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
        # pairs that may meet while each vertex is within ``around`` of where it was ``seen``
        self.known: Pairs | None = None
        self.seen = ti.Vector.field(3, float, shape=nv)
        self.around = ti.field(float, shape=nv)
        # how far all have gone since then in the mean, and the mean of the paths
        self.gone, self.wind = (ti.Vector.field(3, float, shape=()) for _ in range(2))
        self.means, self.peaks, self.bounds = fields.sums(6), fields.sums(1), fields.sums(6)
        self.restless = np.ones(nv, np.int32)
        # whether the boxes are those around the margins
        self.boxes_kept = False

    def find(self) -> Pairs:
        """The pairs on the paths as they are. Raises StepFailure where positions or paths are not finite."""
        self._average(self.means)
        self.gone[None], self.wind[None] = self.means.sum(axis=0).reshape(2, 3) / self.nv
        self._measure(self.peaks, self.restless)
        longest = self.peaks.max()
        if not np.isfinite(longest):
            raise StepFailure("positions or paths of the cloth are not finite")
        anew = self.known is None or self.restless.sum() > FEW * self.nv
        if longest > (SLOW if anew else LONG) * self.margin:
            return self._pairs(self._search(kept=False))
        if anew:
            self.restless.fill(1)
            self.gone.fill(0)
        if self.restless.any():
            self._see(self.restless)
            self.known = self._pairs(self._renewed(None if anew else self.known.key))
        near = np.empty(len(self.known), np.int32)
        self._choose(self.known.kind, self.known.corners, near)
        return self.known[near == 1]

    def _renewed(self, known: np.ndarray | None) -> np.ndarray:
        """Sorted keys of the pairs that may meet within their margins, of which those are ``known`` that have no
        restless corner."""
        if known is None:
            return self._search(kept=True)
        moved = self.restless[self.corners].any(axis=1)
        first, second = np.divmod(known, self.count)
        calm = known[~(moved[first] | moved[second])]
        return np.sort(np.concatenate([calm, self._search(kept=True, moved=moved)]))

    def _search(self, kept: bool, moved: np.ndarray | None = None) -> np.ndarray:
        """Sorted keys of all pairs on the paths or, where they are to be ``kept``, within their margins; only of pairs
        with a piece that has ``moved`` (count,), where that is given."""
        ids = np.arange(self.count, dtype=np.int32)
        who, whom = (ids[: self.lookers], ids[self.nv :]) if moved is None else (ids, ids[moved])
        self._box(whom if moved is not None and self.boxes_kept else ids, int(kept))
        self.boxes_kept = kept
        grid = self._grid()
        count = np.zeros(2 * int(np.prod(grid[4:])), np.int32)
        self._sort(*grid, whom, count, np.zeros(1, np.int32), 0)
        start = np.concatenate([[0], np.cumsum(count)]).astype(np.int32)
        items = np.empty(max(int(start[-1]), 1), np.int32)
        self._sort(*grid, whom, start[:-1].copy(), items, 1)
        number = np.zeros(len(who), np.int32)
        calm = np.zeros(self.count, np.int32) if moved is None else (~moved).astype(np.int32)
        while True:
            found = np.empty((len(who), self.slots), np.int32)
            self._look(*grid, who, calm, start, items, found, number, int(kept))
            if number.max() <= self.slots:
                break
            self.slots = 1 << int(number.max()).bit_length()
        rows = np.flatnonzero(number)
        one, other = np.repeat(who[rows], number[rows]), found[rows][np.arange(self.slots) < number[rows, None]]
        return np.sort(np.minimum(one, other) * np.int64(self.count) + np.maximum(one, other))

    def _pairs(self, key: np.ndarray) -> Pairs:
        first, second = np.divmod(key, self.count)
        a, b = self.corners[first], self.corners[second]
        edges = first >= self.nv
        corners = np.where(edges[:, None], np.hstack([a[:, :2], b[:, :2]]), np.hstack([a[:, :1], b]))
        kind = np.where(edges, EDGES, FACE).astype(np.int32)
        return Pairs(kind, np.ascontiguousarray(corners, np.int32), key)

    def _grid(self) -> tuple[float, float, float, float, int, int, int]:
        """Lowest corner, cells in a metre, and numbers of cells of a grid around all boxes."""
        self._bound(self.bounds)
        low, high = self.bounds[:, :3].min(axis=0), self.bounds[:, 3:].max(axis=0)
        size = self.cell
        while True:
            shape = np.floor((high - low) / size) + 1
            if shape.prod() <= CELLS:
                return (*low, 1 / size, *(int(n) for n in shape))
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
    def _average(self, means: ti.types.ndarray()):
        """Sums of how far each has gone since it was seen, and of the paths."""
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            gone, wind = ti.Vector.zero(ti.f64, 3), ti.Vector.zero(ti.f64, 3)
            for i in range(low, high):
                gone += ti.cast(self.x[i] - self.seen[i], ti.f64)
                wind += ti.cast(self.path[i], ti.f64)
            for k in ti.static(range(3)):
                means[chunk, k], means[chunk, 3 + k] = gone[k], wind[k]

    @ti.kernel
    def _measure(self, peaks: ti.types.ndarray(), restless: ti.types.ndarray()):
        """The longest path in a frame that moves along, infinite where there is none; whose leaves the margin."""
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            longest = ti.cast(0.0, ti.f64)
            for i in range(low, high):
                away, path = self.x[i] - self.seen[i] - self.gone[None], self.path[i] - self.wind[None]
                far = ti.max(away.norm(), (away + path).norm())
                # what is not a number must win over every number
                longest = ti.max(longest, ti.cast(path.norm(), ti.f64)) if far < ti.math.inf else ti.math.inf
                restless[i] = ti.cast(far > self.around[i], ti.i32)
            peaks[chunk, 0] = longest

    @ti.kernel
    def _see(self, restless: ti.types.ndarray()):
        """Lay a margin around the paths of those that are ``restless``."""
        for i in range(self.nv):
            if restless[i] == 1:
                half = 0.5 * (self.path[i] - self.wind[None])
                self.seen[i], self.around[i] = self.x[i] - self.gone[None] + half, half.norm() + self.margin

    @ti.kernel
    def _choose(self, kind: ti.types.ndarray(), corners: ti.types.ndarray(), near: ti.types.ndarray()):
        for p in range(kind.shape[0]):
            i = ti.Vector([corners[p, 0], corners[p, 1], corners[p, 2], corners[p, 3]])
            near[p] = ti.cast(self._may_meet(kind[p], i), ti.i32)

    @ti.kernel
    @shared_if_many
    def _box(self, which: ti.types.ndarray(), kept: int):
        """Boxes and balls around the paths, or where pairs are ``kept`` around the margins."""
        for m in range(which.shape[0]):
            b = which[m]
            i = self.corner[b]
            low, high = ti.Vector([ti.math.inf] * 3), ti.Vector([-ti.math.inf] * 3)
            middle, travel = ti.Vector([0.0] * 3), ti.Vector([0.0] * 3)
            for k in range(3):
                at, path, wide = self._place(i[k], kept)
                low, high = ti.min(low, at - wide, at + path - wide), ti.max(high, at + wide, at + path + wide)
                middle, travel = middle + at / 3, travel + path / 3
            radius, spread = ti.cast(0.0, float), ti.cast(0.0, float)
            for k in range(3):
                at, path, wide = self._place(i[k], kept)
                radius = ti.max(radius, (at - middle).norm() + wide)
                spread = ti.max(spread, (path - travel).norm())
            self.low[b], self.high[b] = low, high
            self.middle[b], self.travel[b], self.extent[b] = middle, travel, radius + spread

    @ti.func
    def _place(self, i: int, kept: int):
        """Where vertex i is, its path in a frame that moves along, and what it needs around that."""
        at, path, wide = self.x[i], self.path[i] - self.wind[None], ti.cast(0.5 * self.distance, float)
        if kept == 1:
            at, path, wide = self.seen[i], ti.Vector.zero(float, 3), wide + self.around[i]
        return at, path, wide

    @ti.kernel
    @shared_if_many
    def _sort(
        self, x: float, y: float, z: float, per_cell: float, nx: int, ny: int, nz: int,
        whom: ti.types.ndarray(), place: ti.types.ndarray(), items: ti.types.ndarray(), write: int,
    ):  # fmt: skip
        """Count what lies in each cell, edges and all else apart; then ``write`` it there, ``place`` being the next
        free place of each cell."""
        for m in range(whom.shape[0]):
            b = whom[m]
            origin = ti.Vector([x, y, z])
            a = ti.cast((self.low[b] - origin) * per_cell, ti.i32)
            e = ti.cast((self.high[b] - origin) * per_cell, ti.i32)
            for i, j, k in ti.ndrange((a[0], e[0] + 1), (a[1], e[1] + 1), (a[2], e[2] + 1)):
                n = ti.atomic_add(place[2 * ((i * ny + j) * nz + k) + ti.cast(self._kind(b) == FACE, ti.i32)], 1)
                if write == 1:
                    items[n] = b

    @ti.func
    def _kind(self, b: int):
        """The kind of pairs that b can be of."""
        return EDGES if self.nv <= b < self.lookers else FACE

    @ti.kernel
    @shared_if_many
    def _look(
        self, x: float, y: float, z: float, per_cell: float, nx: int, ny: int, nz: int,
        who: ti.types.ndarray(), calm: ti.types.ndarray(), start: ti.types.ndarray(), items: ti.types.ndarray(),
        found: ti.types.ndarray(), number: ti.types.ndarray(), kept: int,
    ):  # fmt: skip
        for m in range(who.shape[0]):
            q = who[m]
            origin = ti.Vector([x, y, z])
            low, high = self.low[q], self.high[q]
            a = ti.cast((low - origin) * per_cell, ti.i32)
            e = ti.cast((high - origin) * per_cell, ti.i32)
            kind, rest, count = self._kind(q), calm[q], 0
            # read once, which no compiler does by itself
            middle, travel, extent = self.middle[q], self.travel[q], self.extent[q]
            for i, j, k in ti.ndrange((a[0], e[0] + 1), (a[1], e[1] + 1), (a[2], e[2] + 1)):
                cell = 2 * ((i * ny + j) * nz + k) + ti.cast(kind == FACE, ti.i32)
                for n in range(start[cell], start[cell + 1]):
                    b = items[n]
                    # those that both look are met twice, and boxes in every cell that they share: once is enough
                    if (b > q or rest == 1) and self._overlap(b, low, high, middle, travel, extent):
                        at = ti.cast((ti.max(low, self.low[b]) - origin) * per_cell, ti.i32)
                        if at[0] == i and at[1] == j and at[2] == k and self._near(kind, q, b, kept):
                            if count < found.shape[1]:
                                found[m, count] = b
                            count += 1
            number[m] = count

    @ti.func
    def _overlap(self, b: int, low, high, middle, travel, extent):
        """Whether b's box overlaps another, and balls around the two in a frame that moves along with one of them."""
        result = False
        if (low <= self.high[b]).all() and (self.low[b] <= high).all():
            apart = (middle - self.middle[b]).norm()
            result = apart <= extent + self.extent[b] + (travel - self.travel[b]).norm()
        return result

    @ti.func
    def _near(self, kind: int, q: int, b: int, kept: int):
        """Whether the two are a pair, share no corner and may meet."""
        p, r = self.corner[ti.min(q, b)], self.corner[ti.max(q, b)]
        i = ti.Vector([p[0], r[0], r[1], r[2]])
        apart = p[0] != r[0] and p[0] != r[1] and p[0] != r[2]
        if kind == EDGES:
            i = ti.Vector([p[0], p[1], r[0], r[1]])
            apart = apart and p[1] != r[0] and p[1] != r[1]
        elif (q < self.nv) == (b < self.nv):
            apart = False
        near = False
        if apart:
            near = self._might_meet(kind, i) if kept == 1 else self._may_meet(kind, i)
        return near

    @ti.func
    def _may_meet(self, kind: int, i):
        """Whether a pair can come nearer than ``distance`` on its paths."""
        now = distance(kind, self.x[i[0]], self.x[i[1]], self.x[i[2]], self.x[i[3]])
        return now < self.distance + reach(kind, self.path[i[0]], self.path[i[1]], self.path[i[2]], self.path[i[3]])

    @ti.func
    def _might_meet(self, kind: int, i):
        """Whether a pair can come nearer than ``distance`` within its margins."""
        now = distance(kind, self.seen[i[0]], self.seen[i[1]], self.seen[i[2]], self.seen[i[3]])
        a, b, c, d = self.around[i[0]], self.around[i[1]], self.around[i[2]], self.around[i[3]]
        gone = a + ti.max(b, c, d)
        if kind == EDGES:
            gone = ti.max(a, b) + ti.max(c, d)
        return now < self.distance + gone
