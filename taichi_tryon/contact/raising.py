"""How much further off than the contact thickness samples are held, that the flat triangles between them stay outside.

By the skin's curvature, where it bulges; and where cloth is found in the body all the same, by what is found.
"""

import taichi as ti

from taichi_tryon.kernel_loops import shared_if_many

# where the skin bulges, samples are held further off than the contact thickness, by so many times that at most
HIGHEST = 1.0
# where cloth is found in the body all the same, further off still, so far that at most [m]
FURTHER = 1.5e-3
# how far apart [m] it is looked for; how far outside it is to come, and may be before samples are let down again
LOOK, SPARE, CLEAR = 2e-3, 1e-4, 2e-4
# what rests deeper in the body than this [m] is held there, and would be so further off
SHALLOW = FURTHER


class Raising:
    """What a ``BodyContact`` does so; all fields are its own."""

    def pierced(self) -> bool:
        """Whether cloth that touches the body is in it somewhere, by a dense look, no deeper than ``SHALLOW``."""
        if not self.triangles:
            return False
        self._find()
        found = self.found.to_numpy()
        return bool(((found > 0.0) & (found <= SHALLOW)).any())

    @ti.func
    def _reach(self, s: int) -> float:
        """How far off the skin sample s feels it at most."""
        return (1.0 + HIGHEST) * self.thickness[None] + ti.max(self.further[s], self.kept[s])

    @ti.kernel
    @shared_if_many
    def _raise(self):
        """Hold the samples so far off that the flat triangles around them stay outside of where the skin bulges."""
        for s in range(self.count):
            self.further[s] = 0.0
            if self.gap[s] <= self._reach(s):
                t, foot = self.thickness[None], self._at(self.x, s) - self.gap[s] * self.normal[s]
                bulge = self.span[s] * self.body.curvature(foot, self.winner[s])
                self.further[s] = self.kept[s]
                self.raised[s] = ti.math.clamp(bulge, 0.0, HIGHEST * t) + self.further[s]
                self._press(s)

    @ti.kernel
    @shared_if_many
    def _find(self):
        """How deep the triangles around each sample are in the body: those that could be."""
        for s in range(self.count):
            self.found[s] = -ti.math.inf
        for t in range(self.triangles):
            near, caught, highest = False, False, HIGHEST * self.thickness[None]
            for k in ti.static(range(7)):
                s = self.of_triangle[t][k]
                held = self.raised[s] >= highest or self.further[s] > 0.0
                near |= self.depth[s] > 0.0 and (held or self.depth[s] > self.thickness[None])
                _, share = self._beside(s)
                caught |= share > 0.0
            # between limbs that leave it no room, it is not to be got out
            if near and not caught:
                deepest = self._deepest(t)
                for k in ti.static(range(7)):
                    ti.atomic_max(self.found[self.of_triangle[t][k]], deepest)

    @ti.func
    def _deepest(self, t: int) -> float:
        """Depth [m] of the deepest point of triangle t below the skin of the group that it is in, to first order: where
        another limb is beside it, the way out of both may be far longer."""
        corner = self.of_triangle[t]
        a, b, c = self.x[corner[0]], self.x[corner[1]], self.x[corner[2]]
        side = ti.sqrt(ti.max((b - a).norm_sqr(), (c - b).norm_sqr(), (a - c).norm_sqr()))
        n, deepest = ti.max(1, ti.cast(ti.ceil(side / LOOK), ti.i32)), -ti.cast(ti.math.inf, float)
        for i in range(n + 1):
            for j in range(n + 1 - i):
                point = a + (b - a) * (i / n) + (c - a) * (j / n)
                gap, _normal, _winner, _density = self.body.gap_within(point, -ti.math.inf, -1)
                deepest = ti.max(deepest, -gap)
        return deepest

    @ti.kernel
    @shared_if_many
    def _lift(self, most: float, moves: int):
        """Hold the samples further off by as much as the triangles around them are in the body, where that is not more
        than ``most`` [m], less far by what they are clear of it; feel the change."""
        for s in range(self.count):
            if self.gap[s] <= self._reach(s):
                found = self.found[s]
                change = found + SPARE if found > 0.0 else ti.min(found + CLEAR, 0.0)
                if 0.0 < most and found <= most and change != 0.0:
                    further = ti.math.clamp(self.further[s] + change, 0.0, FURTHER)
                    self.raised[s] += further - self.further[s]
                    self.further[s] = further
                    self._press(s)
                if self.depth[s] > 0.0:
                    if ti.static(self.rubs):
                        self._drag(s, self._at(self.x, s), moves)
                    self._respond(s)
