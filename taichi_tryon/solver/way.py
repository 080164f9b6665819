"""The way that the cloth goes at a time: short enough that nothing jumps through a limb, or cloth through cloth."""

import numpy as np
import taichi as ti

from taichi_tryon import fields

HUGE = 1e300


@ti.func
def longer(length, vector) -> ti.f64:
    """The greater of a length and that of a vector; one that is not finite wins over every number."""
    size = ti.cast(vector.norm(), ti.f64)
    if not size < HUGE:
        size = HUGE
    return ti.max(length, size)


@ti.data_oriented
class Way:
    """Moves the cloth ``x`` from a ``base`` along ``path``. ``contact``, a BodyContact, knows how far the body is;
    ``layers``, a ClothContact over the same path or None, shortens it where cloth would meet cloth, which the ``clock``
    counts to contact."""

    def __init__(self, x, path, contact, layers, clock):
        self.x, self.path, self.contact, self.layers, self.clock, self.nv = x, path, contact, layers, clock, x.shape[0]
        self.base = ti.Vector.field(3, float, shape=self.nv)
        if layers is not None:
            self.goal = ti.Vector.field(3, float, shape=self.nv)
        # the part of the path at which the cloth was left, None where nobody has looked along it; whether it was there
        # when others began to move it
        self.part: float | None = None
        self.waited = False
        self.sums = fields.sums(1)

    def start(self) -> None:
        """From here on the cloth is moved by others."""
        if self.layers is not None:
            self.waited = self.part is not None and self._strayed() == 0.0
            self._keep_base()

    def arrive(self) -> None:
        """Let the cloth be where it was moved to since ``start``, or as near to it as its layers let it."""
        if self.layers is not None:
            self._aim_at_here()
            if self.waited and self.peak(self.path) == 0.0:
                # who may touch here has been looked for on the way to here
                self.part = 0.0
                return
            # its layers look along the path from where the cloth is
            self.go(0.0)
            self._look_ahead()
            self.keep_apart()
            self._arrive()
            self.part = None

    def gone_from(self, start) -> float:
        """Farthest that any vertex is [m] from where it was at ``start``, infinite where that is not finite."""
        self._measure(start, 0.0, self.sums)
        return self._longest()

    def aim(self, direction, longest_move: float, times: float = 1.0) -> bool:
        """Start along so many ``times`` a ``direction``, which may be the path that has been gone, no vertex that is
        near the body further than ``longest_move`` [m], and look who may meet there; whether the direction is
        finite."""
        share = self._share(direction, longest_move, times)
        if share == 0.0:
            return False
        self._aim(share, direction)
        if self.layers is not None:
            self._look_ahead()
        return True

    def toward(self, goal, free, longest_move: float) -> float:
        """Start to a ``goal`` along what is ``free``; the share of the way in which no vertex that is near the body
        goes further than ``longest_move`` [m], 0 where the goal is not finite."""
        self._toward(goal, free)
        share = self._share(self.path, longest_move)
        if self.layers is not None and share > 0.0:
            self._look_ahead()
            self.keep_apart()
        return share

    def _share(self, vectors, longest_move: float, most: float = 1.0) -> float:
        """The share of a field of vectors that may be gone at once, 0 where one is not finite."""
        self._find_excess(vectors, self.sums, longest_move, self.contact.body.travelled)
        excess = float(self.sums.max())
        return min(most, 1.0 / max(excess, 1e-30)) if excess < HUGE else 0.0

    def _strayed(self) -> float:
        """How far the cloth is [m] from where ``go`` left it."""
        self._measure(self.base, self.part, self.sums)
        return self._longest()

    def keep_apart(self, alike: bool = False) -> None:
        """Shorten the path where cloth would meet cloth; see ``ClothContact.keep_apart``."""
        with self.clock("contact"):
            self.layers.keep_apart(alike)

    def _look_ahead(self) -> None:
        with self.clock("contact"):
            self.layers.look_ahead()

    def peak(self, vectors) -> float:
        """Length of the longest of a field of vectors, infinite where one is not finite."""
        self._peak(vectors, self.sums)
        return self._longest()

    def _longest(self) -> float:
        peak = float(self.sums.max())
        return peak if peak < HUGE else np.inf

    def along(self, force) -> float:
        """Sum of a field of forces [N] times the path [m]."""
        self._sum_along(force, self.sums)
        return float(self.sums.sum())

    @ti.kernel
    def _sum_along(self, force: ti.template(), sums: ti.types.ndarray()):
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            total = ti.cast(0.0, ti.f64)
            for i in range(low, high):
                total += ti.cast(force[i].dot(self.path[i]), ti.f64)
            sums[chunk, 0] = total

    @ti.kernel
    def _peak(self, vectors: ti.template(), peaks: ti.types.ndarray()):
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            peak = ti.cast(0.0, ti.f64)
            for i in range(low, high):
                peak = longer(peak, vectors[i])
            peaks[chunk, 0] = peak

    @ti.kernel
    def _measure(self, origin: ti.template(), part: float, peaks: ti.types.ndarray()):
        """How far the cloth is from a part of the path, were that from an ``origin``."""
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            peak = ti.cast(0.0, ti.f64)
            for i in range(low, high):
                peak = longer(peak, self.x[i] - (origin[i] + part * self.path[i]))
            peaks[chunk, 0] = peak

    @ti.kernel
    def _find_excess(self, vectors: ti.template(), excesses: ti.types.ndarray(), longest: float, travelled: float):
        """Lengths over those that may be gone."""
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.nv)
            peak = ti.cast(0.0, ti.f64)
            for i in range(low, high):
                room = ti.max(longest, self.contact.room(i, travelled))
                excess = ti.cast(vectors[i].norm() / room, ti.f64)
                if not excess < HUGE:
                    excess = HUGE
                peak = ti.max(peak, excess)
            excesses[chunk, 0] = peak

    @ti.kernel
    def _keep_base(self):
        for i in range(self.nv):
            self.base[i] = self.x[i]

    @ti.kernel
    def _aim_at_here(self):
        for i in range(self.nv):
            self.goal[i] = self.x[i]
            self.path[i] = self.x[i] - self.base[i]

    @ti.kernel
    def _arrive(self):
        for i in range(self.nv):
            # base + (goal - base) need not be the goal
            whole = (self.path[i] == self.goal[i] - self.base[i]).all()
            self.x[i] = self.goal[i] if whole else self.base[i] + self.path[i]

    @ti.kernel
    def _aim(self, share: float, direction: ti.template()):
        for i in range(self.nv):
            self.base[i], self.path[i] = self.x[i], share * direction[i]

    @ti.kernel
    def _toward(self, goal: ti.template(), free: ti.template()):
        for i in range(self.nv):
            self.base[i], self.path[i] = self.x[i], free[i] * (goal[i] - self.x[i])

    def go(self, part: float) -> None:
        """Be at a part of the path."""
        self._go(part)
        self.part = part

    @ti.kernel
    def _go(self, part: float):
        for i in range(self.nv):
            self.x[i] = self.base[i] + part * self.path[i]
