"""How deep cloth is in a web: where a body is hardly body, between thicker parts that have fused, as in an armpit.

There the skin is no more than a few millimetres off on several sides, and which of them Newton steps find jumps from
one place to the next; contact that follows can get stuck, since no step lowers its energy. So what a step begins with
in a web is as deep, for this step, as W^(1/3) tells, by the slope that it has there: a depth whose gradient is the
normal times the slope now over the slope then. Not while a garment is forced on, deep in the body at first.
"""

import taichi as ti

from taichi_tryon.contact import offset

# in a web W^(1/3) changes by less than this [1/m], and the skin is nearer than that [m], to first order with a slope of
# LEAST [1/m] at least
GENTLE, DEEPEST, LEAST = 15.0, 0.01, 2.0


class Webs:
    """What a ``BodyContact`` does there; all fields are its own."""

    @ti.func
    def _in_web(self, s: int, point, gap: float, normal, winner: int, begins: int, alone):
        """Gap, normal and group of sample s: those given unless it is in a web, which is found out where a step
        ``begins``, and only where the group is ``alone``, as between two cloth is held off both."""
        if begins == 1:
            self.web[s] = 0.0
        entered = begins == 1 and alone and gap < 0.0 and self.last[None] >= offset.FIRM
        if entered or self.web[s] > 0.0:
            density, gradient, group = self.body.query(point)
            root, steepness = ti.max(density, 0.0) ** (1.0 / 3.0), gradient.norm()
            slope = steepness / (3.0 * ti.max(root * root, LEAST / GENTLE))
            least = ti.max(slope, LEAST)
            if entered and slope < GENTLE and root - 1.0 < DEEPEST * least:
                self.web[s] = least
            if self.web[s] > 0.0:
                gap, winner = (1.0 - root) / self.web[s], group
                self.yields[s] = slope / self.web[s]
                if steepness > 0.0:
                    normal = -gradient / steepness
        return gap, normal, winner
