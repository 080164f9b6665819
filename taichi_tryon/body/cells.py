"""Which balls may reach a point: a regular grid of cells, each with a list of the balls that meet it.

Cells are small against the balls, so that a list names few more balls than reach a point of its cell, however many
there are. The lists stand one after the other in one table: no cell keeps room that it does not need.
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.body.model import Balls

CELL_SHARE = 0.3
"""Edge of a cell in the balls' median radius; larger where that would be more than MAX_CELLS or MAX_ENTRIES."""
MAX_CELLS = 1 << 16
MAX_ENTRIES = 1 << 18
"""Balls in all lists together."""
SLACK = 1e-4
"""By so much of its size a cell is taken for larger: rounding may put a point into the next one."""


@ti.data_oriented
class BallCells:
    """Lists of up to ``count`` balls; the balls of cell c are ``ball[first[c]]`` to ``ball[first[c + 1] - 1]``.

    ``place`` makes them, in the balls' order, so that sums over a list come out the same bits in every run. One list
    more than cells is for points off the grid: the infinite balls.
    """

    def __init__(self, count: int):
        self.count = count
        self.room = max(MAX_ENTRIES, 2 * count)  # for all balls in a single cell, and off the grid
        self.first = ti.field(ti.i32, MAX_CELLS + 2)
        self.ball = ti.field(ti.i32, self.room)
        self.column_first = ti.field(ti.i32, MAX_CELLS + 1)
        self.size = ti.field(float, ())
        self.origin = ti.Vector.field(3, float, ())
        self.shape = ti.Vector.field(3, ti.i32, ())

    def place(self, balls: Balls, near: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
        """Lay a grid around the bounded balls that are ``near`` (n,), as far as points are asked for: from ``low`` to
        ``high`` (3,) [m]; and list the balls by its cells. What is not near must not reach there."""
        finite = np.isfinite(balls.radii).all(axis=1)
        bounded, endless = near & finite, near & ~finite
        size, corner, end = 1.0, np.zeros(3), np.zeros(3)
        if bounded.any():
            corner = np.maximum((balls.centers - balls.extents)[bounded].min(axis=0), low)
            end = np.minimum((balls.centers + balls.extents)[bounded].max(axis=0), high)
            size = CELL_SHARE * float(np.median(np.cbrt(balls.radii[bounded].prod(axis=1))))
        while True:
            shape = (np.floor((end - corner) / size) + 1).astype(int)
            if shape.prod() <= MAX_CELLS:
                self.size[None], self.origin[None], self.shape[None] = size, corner, shape
                tables = [fields.cast(table) for table in (*_in_cells(balls, corner, size, shape), endless)]
                if self._count(*tables) <= self.room:
                    break
            size *= 1.1
        self._fill(*tables)

    @ti.kernel
    def _count(self, own: ti.types.ndarray(), span: ti.types.ndarray(), endless: ti.types.ndarray()) -> ti.i32:
        """Each list's length, put where its end will stand, where each column's lists begin; the length of all."""
        shape = self.shape[None]
        for column in range(shape[0] * shape[2]):
            total = 0
            for y in range(shape[1]):
                self.first[column * shape[1] + y + 1] = 0
            for k in range(self.count):
                if self._in_column(k, column, span):
                    start, step, half = self._along_column(k, column, own)
                    for y in range(span[k, 1], span[k, 4] + 1):
                        if self._meets(start + y * step, half):
                            self.first[column * shape[1] + y + 1] += 1
                            total += 1
            self.column_first[column + 1] = total
        entries = 0
        ti.loop_config(serialize=True)
        for _ in range(1):
            self.column_first[0] = 0
            for column in range(shape[0] * shape[2]):
                entries += self.column_first[column + 1]
                self.column_first[column + 1] = entries
            for k in range(self.count):
                entries += endless[k]
        return entries

    @ti.kernel
    def _fill(self, own: ti.types.ndarray(), span: ti.types.ndarray(), endless: ti.types.ndarray()):
        """A list's end starts at its begin and moves on as balls are added."""
        shape = self.shape[None]
        for column in range(shape[0] * shape[2]):
            end = self.column_first[column]
            for y in range(shape[1]):
                cell = column * shape[1] + y
                begin = end
                end += self.first[cell + 1]
                self.first[cell + 1] = begin
            for k in range(self.count):
                if self._in_column(k, column, span):
                    start, step, half = self._along_column(k, column, own)
                    for y in range(span[k, 1], span[k, 4] + 1):
                        if self._meets(start + y * step, half):
                            cell = column * shape[1] + y
                            self.ball[self.first[cell + 1]] = k
                            self.first[cell + 1] += 1
        ti.loop_config(serialize=True)
        for _ in range(1):
            self.first[0] = 0
            end = self.column_first[shape[0] * shape[2]]
            for k in range(self.count):
                if endless[k] == 1:
                    self.ball[end] = k
                    end += 1
            self.first[shape[0] * shape[1] * shape[2] + 1] = end

    @ti.func
    def _in_column(self, k, column, span: ti.template()):
        x, z = column // self.shape[None][2], column % self.shape[None][2]
        return span[k, 0] <= x and x <= span[k, 3] and span[k, 2] <= z and z <= span[k, 5]

    @ti.func
    def _along_column(self, k, column, own: ti.template()):
        """Middle of a column's lowest cell, the step to the next one, and a cell's half size, as ball k sees them."""
        x, z = column // self.shape[None][2], column % self.shape[None][2]
        start, step, half = ti.Vector.zero(float, 3), ti.Vector.zero(float, 3), ti.Vector.zero(float, 3)
        for j in ti.static(range(3)):
            start[j] = own[k, 0, j] + x * own[k, 1, j] + z * own[k, 3, j]
            step[j] = own[k, 2, j]
            half[j] = own[k, 4, j]
        return start, step, half

    @ti.func
    def _meets(self, middle, half):
        """Whether a box meets the unit sphere, which a ball is in its own axes and radii."""
        return (ti.max(abs(middle) - half, 0.0) ** 2).sum() <= 1

    @ti.func
    def at(self, x):
        """The list of the cell that holds x."""
        index = ti.floor((x - self.origin[None]) / self.size[None], ti.i32)
        shape = self.shape[None]
        cell = shape[0] * shape[1] * shape[2]
        if (index >= 0).all() and (index < shape).all():
            cell = (index[0] * shape[2] + index[2]) * shape[1] + index[1]
        return cell


def _in_cells(balls: Balls, origin: np.ndarray, size: float, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How balls lie in a grid of cells of ``size`` from ``origin`` [m], ``shape`` of them along x, y, z.

    First (n, 5, 3), in each ball's own axes and radii: the middle of the first cell, the steps to the next ones along
    x, y, z, and half the box around a cell. Then (n, 6): the first and the last cells that its extents meet, the last
    before the first where they meet none.
    """
    scaled = balls.axes / balls.radii[:, None]
    middle = np.einsum("nij,ni->nj", scaled, origin + 0.5 * size - balls.centers)
    half = 0.5 * (size + SLACK * size) * np.abs(scaled).sum(axis=1)
    extents = balls.extents + SLACK * size
    ends = np.hstack((balls.centers - extents, balls.centers + extents)) - np.tile(origin, 2)
    span = np.clip(np.floor(ends / size), np.repeat([0, -1], 3), np.concatenate((shape, shape - 1))).astype(int)
    return np.concatenate((middle[:, None], size * scaled, half[:, None]), axis=1), span
