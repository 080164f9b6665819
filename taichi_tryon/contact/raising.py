"""How much further off than the contact thickness samples are held, that the flat triangles between them stay outside.

By the skin's curvature, where it bulges; and where cloth is found in the body all the same, by what is found.
"""

import taichi as ti

from taichi_tryon.kernel_loops import shared_if_many

# where the skin bulges, samples are held further off than the contact thickness, by so many times that at most
HIGHEST = 1.0
# ... and by this [m] where it does not, which tells that from what is not known
KNOWN = 1e-12
# where cloth is found in the body all the same, further off still, so far that at most [m]
FURTHER = 1.5e-3
# how far apart [m] it is looked for; how far outside it is to come, and may be before samples are let down again
LOOK, SPARE, CLEAR = 2e-3, 1e-4, 2e-4


class Raising:
    """What a ``BodyContact`` does so; all fields are its own."""

    def lift(self, most: float, lets_down: bool = True) -> float:
        """From the next step, or stage of one, on hold the samples further off by as much as the triangles around them
        are in the body, by a dense look, where that is not more than ``most`` [m]; and less far, where that
        ``lets_down``, by what they are clear of it. How deep [m] any of the cloth is so in the body, 0 where none is.
        """
        if not self.triangles:
            return 0.0
        self._find()
        return self._lift(most, int(lets_down))

    @ti.func
    def _reach(self, s: int) -> float:
        """How far off the skin sample s feels it at most."""
        return (1.0 + HIGHEST) * self.thickness[None] + ti.max(self.further[s], self.kept[s])

    @ti.func
    def _raised(self, s: int) -> float:
        """How much further off than the contact thickness sample s is held."""
        return self.bulge[s] + self.further[s]

    @ti.func
    def _arch(self, s: int, point, begins: int):
        """How much the skin bulges between sample s and those around it; known where a step ``begins``, or it first
        comes near, and the same for the rest of the step, also where a way that is tried leaves the skin."""
        if self.gap[s] <= self._reach(s) and (begins == 1 or self.bulge[s] == 0.0):
            bulge = self.span[s] * self.body.curvature(point - self.gap[s] * self.normal[s], self.winner[s])
            self.bulge[s] = ti.math.clamp(bulge, KNOWN, HIGHEST * self.thickness[None])

    @ti.kernel
    @shared_if_many
    def _raise(self, moves: int, begins: int):
        """From now on hold the samples as much further off as when the cloth was last looked for; feel the change."""
        for s in range(self.count):
            if self.gap[s] <= self._reach(s):
                if self.further[s] != self.kept[s]:
                    self.further[s] = self.kept[s]
                    self._press(s)
                    if self.depth[s] > 0.0:
                        if ti.static(self.rubs):
                            self._drag(s, self._at(self.x, s), moves)
                        self._respond(s)
            elif begins == 1:
                self.bulge[s] = self.further[s] = self.kept[s] = 0.0

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
                held = self.bulge[s] >= highest or self.further[s] > 0.0
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
    def _lift(self, most: float, lets_down: int) -> float:
        deepest = ti.cast(0.0, float)
        for s in range(self.count):
            found, further = self.found[s], self.further[s]
            if self.gap[s] <= self._reach(s) and found <= most:
                change = ti.cast(0.0, float)
                if found > 0.0:
                    change = found + SPARE
                elif lets_down == 1:
                    change = ti.min(found + CLEAR, 0.0)
                self.kept[s] = ti.math.clamp(further + change, 0.0, FURTHER)
                ti.atomic_max(deepest, found)
        return deepest
