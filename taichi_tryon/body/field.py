"""The body in Taichi: density, gradient, Hessian, gap and motion at any point, for the price of the few balls near.

Same definitions as ``density.py``. A query looks at the balls listed by its cell only (``cells.py``). A ball is stored
once, with its groups as bits, though it may add to several sums.
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.body.cells import BallCells
from taichi_tryon.body.density import FAR, LONGEST_STEP, SLIDE, SLIDE_BAND
from taichi_tryon.body.model import Balls, Body
from taichi_tryon.body.reach import Reach

NEWTON_BAND = 0.02
"""Outside the skin by more than this, to first order [m], the first-order gap is good enough: it only culls."""
NEWTON_STEPS = 5
DEEP_STEPS = 12
"""Newton steps for points deeper than LONGEST_STEP."""
WALK = DEEP_STEPS * LONGEST_STEP
"""For a point the body is asked no further from it [m]."""
FARTHEST = 1e3
"""No scene is wider [m]."""
TOLERANCE = 1e-5
"""A Newton step shorter than this [m] is the last; what is left is a third of it at most."""
ACROSS = 0.5
"""Cosine of the angle between the way to a foot of the perpendicular and the normal there, at least."""
SHORT = 0.1
"""How far from the skin, over the length of the way, a foot may still be when Newton steps end."""


@ti.data_oriented
class BodyField:
    """Taichi fields of one body. Make it once after Taichi has started, then ``set_pose`` as often as the body moves.

    ``margin`` [m] is how far around the balls' reach gaps are asked for; beyond the reach a gap is ``far``, at least
    ``margin``: a density with compact support knows no distance there. ``travelled`` [m] is how far the body has moved
    in all: between two moments no point of it has gone further than the difference. ``placed`` counts its poses, and
    ``moves`` says whether it moved in the last step. everywhere False: it may be asked only where it was told to
    ``cover``, and leaves out the balls that do not reach there; ``near`` (n,) are those that do, ``ever_near`` those
    that did in any pose. rests False: it is posed, and asked for its motion, even where it stands still.
    """

    present = True

    def __init__(self, body: Body, margin: float = 0.0, everywhere: bool = True, rests: bool = True):
        balls = body.balls
        self.body = body
        self.far = max(FAR, margin)
        self.groups = balls.membership.shape[1]
        self.count = len(balls.weights)

        # what a query reads of a ball lies together
        self.center = ti.Vector.field(3, float)
        self.quadratic = ti.Matrix.field(3, 3, float)  # Q of s = (x - c)^T Q (x - c)
        self.weight = ti.field(float)
        self.member = ti.field(ti.i32)  # bit g: adds to group g
        ti.root.dense(ti.i, self.count).place(self.center, self.quadratic, self.weight, self.member)
        self.shift = ti.Matrix.field(3, 4, float, self.count)  # bones' shifts, blended by the ball's shares
        self.cells = BallCells(self.count)

        tables = fields.Tables()
        tables.set(self.weight, balls.weights)
        tables.set(self.member, (balls.membership << np.arange(self.groups)).sum(axis=1))
        tables.fill()
        self.everywhere, self.reach = everywhere, Reach(WALK, everywhere)
        self.near, self.ever_near = np.zeros((2, self.count), bool)
        self.rests, self.moves, self.placed = rests, not rests, 0
        self.travelled = 0.0
        self.steepest = _steepest(balls)
        self._balls: Balls | None = None
        self._now: np.ndarray | None = None
        self._shifts: np.ndarray | None = None

    def set_pose(self, transforms: np.ndarray, previous_transforms: np.ndarray | None = None) -> None:
        """Put the bones at ``transforms`` (b, 4, 4); a step ago they stood at ``previous_transforms`` (None: the same).

        Costs next to nothing where neither has changed since the last call.
        """
        transforms = np.array(transforms, float)
        shifts = np.zeros((len(transforms), 3, 4))
        if previous_transforms is not None and not np.array_equal(previous_transforms, transforms):
            shifts = (np.eye(4) - previous_transforms @ np.linalg.inv(transforms))[:, :3]
        moved = not self.rests or self._now is None or not np.array_equal(self._now, transforms)
        if moved or not np.array_equal(self._shifts, shifts):
            balls = self.body.posed(transforms)
            shift = np.einsum("nb,nbij->nij", balls.bone_weights, shifts[balls.bones])
            parts = (balls.centers, balls.quadratics, shift)
            self._pose_balls(fields.cast(np.hstack([part.reshape(self.count, -1) for part in parts])))
            if moved:
                self.travelled += _travel(self._balls, balls)
                self.placed += 1
                self._balls = balls
                self._list_balls()
        self._now, self._shifts = transforms, shifts
        self.moves = not self.rests or bool(shifts.any())

    def cover(self, low: np.ndarray, high: np.ndarray) -> None:
        """It will be asked from ``low`` to ``high`` (3,) [m]. Costs next to nothing where it was told before."""
        if self.reach.hold(low, high) and self._balls is not None:
            self._list_balls()

    def _list_balls(self) -> None:
        self.near = self.reach.meets(self._balls)
        self.ever_near |= self.near
        self.cells.place(self._balls, self.near, self.reach.low, self.reach.high)

    @ti.kernel
    def _pose_balls(self, values: ti.types.ndarray()):
        """Take centre, quadratic and shift of each ball from its row."""
        for k in range(self.count):
            for i in range(3):
                self.center[k][i] = values[k, i]
                for j in range(3):
                    self.quadratic[k][i, j] = values[k, 3 + 3 * i + j]
                for j in range(4):
                    self.shift[k][i, j] = values[k, 12 + 4 * i + j]

    @ti.func
    def _sums(self, x, cell):
        """The groups' sums of densities (eq. 1)."""
        sums = ti.Vector.zero(float, self.groups)
        for e in range(self.cells.first[cell], self.cells.first[cell + 1]):
            k = self.cells.ball[e]
            r = x - self.center[k]
            rest = 1 - r.dot(self.quadratic[k] @ r)
            if rest > 0:
                f = self.weight[k] * rest * rest * rest
                for g in ti.static(range(self.groups)):
                    if self.member[k] >> g & 1:
                        sums[g] += f
        return sums

    @ti.func
    def density(self, x):
        """W (eq. 2)."""
        return self._sums(x, self.cells.at(x)).max()

    @ti.func
    def clearance(self, density):
        """Least distance [m] from the skin of any group, whichever wins, where W is the ``density``; 0 inside. Never
        overrated, unlike a gap, as W^(1/3) of no group changes by more than ``steepest`` a metre."""
        return ti.max(0.0, 1.0 - ti.max(density, 0.0) ** (1.0 / 3.0)) / self.steepest

    @ti.func
    def _slopes(self, x):
        """The groups' sums of densities, and -1/6 of their gradients [1/m], (groups, 3)."""
        cell = self.cells.at(x)
        sums = ti.Vector.zero(float, self.groups)
        inwards = ti.Matrix.zero(float, self.groups, 3)
        for e in range(self.cells.first[cell], self.cells.first[cell + 1]):
            k = self.cells.ball[e]
            r = x - self.center[k]
            inward = self.quadratic[k] @ r
            rest = 1 - r.dot(inward)
            if rest > 0:
                slope = self.weight[k] * rest * rest
                member = self.member[k]
                for g in ti.static(range(self.groups)):
                    if member >> g & 1:
                        sums[g] += slope * rest
                        for i in ti.static(range(3)):
                            inwards[g, i] += slope * inward[i]
        return sums, inwards

    @ti.func
    def query(self, x):
        """W, gradient [1/m] of the winning group's sum (it points inward), and the winner."""
        sums, inwards = self._slopes(x)
        winner = 0
        value = sums[0]
        gradient = -6 * inwards[0, :]
        for g in ti.static(range(1, self.groups)):
            if sums[g] > value:
                value = sums[g]
                gradient = -6 * inwards[g, :]
                winner = g
        return value, gradient, winner

    @ti.func
    def derivatives(self, x, winner):
        """Gradient [1/m] and Hessian [1/m^2] of a group's sum."""
        cell = self.cells.at(x)
        inwards, bend = ti.Vector.zero(float, 3), ti.Matrix.zero(float, 3, 3)
        for e in range(self.cells.first[cell], self.cells.first[cell + 1]):
            k = self.cells.ball[e]
            if self.member[k] >> winner & 1:
                r = x - self.center[k]
                inward = self.quadratic[k] @ r
                rest = 1 - r.dot(inward)
                if rest > 0:
                    slope = self.weight[k] * rest
                    inwards += slope * rest * inward
                    bend += slope * (rest * self.quadratic[k] - 4 * inward.outer_product(inward))
        return -6 * inwards, -6 * bend

    @ti.func
    def beside(self, x, group):
        """The group other than this one whose sum is greatest, and its sum; 0 where there is none."""
        sums, other, value = self._sums(x, self.cells.at(x)), group, ti.cast(0.0, float)
        for g in ti.static(range(self.groups)):
            if g != group and sums[g] > value:
                other, value = g, sums[g]
        return other, value

    @ti.func
    def _depth(self, x, only):
        """First-order depth [m] below the skin, outward unit normal, the group whose skin that is, steepness of its sum
        (0 where no ball reaches), W.

        Inside, that group is the winner; outside, the one nearest: not always the winner, since a thin limb's sum falls
        off faster than the trunk's. Taken from W^(1/3), which is quadratic along the radius of a ball where W has a
        flat tail: outside it does not overrate the distance, and Newton steps do not overshoot. Where ``only`` is a
        group, not -1: as if there were no other.
        """
        sums, inwards = self._slopes(x)
        depth, normal = -ti.cast(self.far, float), ti.Vector.zero(float, 3)
        group, steepness, value = 0, ti.cast(0.0, float), sums.max()
        if only >= 0:
            value = sums[ti.max(only, 0)]  # not -1 for any compiler
        for g in ti.static(range(self.groups)):
            steep = 6 * inwards[g, :].norm()
            if steep > 1e-9 and (g == only or (only < 0 and (value <= 1 or sums[g] == value))):
                root = sums[g] ** (1.0 / 3.0)
                below = 3 * root * root * (root - 1) / steep
                if below > depth or steepness == 0:
                    depth, normal, group, steepness = ti.max(below, depth), 6 * inwards[g, :] / steep, g, steep
        return depth, normal, group, steepness, value

    @ti.func
    def gap(self, x):
        """Signed distance [m] from the skin, positive outside; outward unit normal and winner at the nearest skin.

        As ``gap_within`` for NEWTON_BAND.
        """
        gap, normal, winner, _ = self.gap_within(x, NEWTON_BAND, -1)
        return gap, normal, winner

    @ti.func
    def gap_within(self, x, band, only):
        """The same, exact only inside and up to ``band`` [m] outside, and W at x; cheaper the narrower the band. Where
        ``only`` is a group, not -1: as if there were no other.

        Newton steps onto W = 1 along the gradient, each with the shift along the tangent plane that brings the foot of
        the perpendicular under x. Further out: to first order. Where no ball reaches: ``far`` and a zero normal.
        """
        y, normal, winner, depth = x, ti.Vector.zero(float, 3), 0, ti.cast(0.0, float)
        first = normal
        gap, density, deep, turn, turns = ti.cast(0.0, float), ti.cast(0.0, float), False, 0, 0
        while True:  # with one place that looks at the body, since a compiler takes each by itself
            depth, normal, winner, steepness, value = self._depth(y, only)
            if turn == 0:
                gap, density, deep, first = -depth, value, depth > LONGEST_STEP, normal
                if gap < band:
                    turns = DEEP_STEPS if deep else NEWTON_STEPS
            if turn == turns or steepness <= 1e-9:
                break
            offset = x - y
            step = ti.math.clamp(depth, -LONGEST_STEP, LONGEST_STEP) * normal
            if abs(depth) < SLIDE_BAND:
                step += SLIDE * (offset - offset.dot(normal) * normal)
            y += step
            turn += 1
            if step.norm() < TOLERANCE:
                break
        if turn > 0:
            offset, found = x - y, (x - y).dot(normal)
            short = turn == turns and abs(depth) > SHORT * offset.norm()
            if deep:  # the way out may be bent, or not ended yet
                gap = -offset.norm() - ti.math.clamp(depth, 0, LONGEST_STEP)
            elif offset.norm() > TOLERANCE and (short or found * ti.math.sign(gap) < ACROSS * offset.norm()):
                normal = first  # no foot below x, or another limb's skin, which faces the other way
            else:
                gap = found
        return gap, normal, winner, density

    @ti.func
    def curvature(self, x, winner):
        """Greatest principal curvature [1/m] of a group's level surface at x, positive where it bulges."""
        gradient, hessian = self.derivatives(x, winner)
        result, steepness = ti.cast(0.0, float), gradient.norm()
        if steepness > 1e-12:
            n = gradient / steepness
            across = ti.Matrix.identity(float, 3) - n.outer_product(n)
            shape = across @ hessian @ across / -steepness
            # of its eigenvalues 0, a, b: a + b and (a - b)^2
            mean, apart = shape.trace(), 2 * (shape * shape).sum() - shape.trace() ** 2
            result = 0.5 * (mean + ti.sqrt(ti.max(apart, 0.0)))
        return result

    @ti.func
    def motion(self, x, winner):
        """Displacement (3,) [m] over the last step of the body's material that is at x now.

        The winner's balls move with their bones, each counting by its density at x. Zero where nothing moved or
        nothing reaches.
        """
        cell = self.cells.at(x)
        total = ti.cast(0, float)
        blend = ti.Vector.zero(float, 3)
        for e in range(self.cells.first[cell], self.cells.first[cell + 1]):
            k = self.cells.ball[e]
            if self.member[k] >> winner & 1:
                r = x - self.center[k]
                rest = 1 - r.dot(self.quadratic[k] @ r)
                if rest > 0:
                    f = self.weight[k] * rest * rest * rest
                    total += f
                    shift = self.shift[k]
                    blend += f * (shift[:, :3] @ x + ti.Vector([shift[i, 3] for i in ti.static(range(3))]))
        result = ti.Vector.zero(float, 3)
        if total > 0:
            result = blend / total
        return result


def _travel(before: Balls | None, after: Balls) -> float:
    """Bound [m] of how far any point within the balls went."""
    if before is None:
        return 0.0
    turn = np.linalg.norm(after.axes - before.axes, axis=1)
    # what reaches to infinity goes far where it turns
    arc = np.where(turn > 0, turn * np.minimum(after.radii, FARTHEST), 0.0).sum(axis=1)
    return float((np.linalg.norm(after.centers - before.centers, axis=1) + arc).max())


def _steepest(balls: Balls) -> float:
    """Bound [1/m] of the gradient of any group's W^(1/3).

    That of one ball is u = w^(1/3) (1 - s), its slope at most l = 2 w^(1/3) / r, r the least radius. Of a sum of balls,
    W = sum u^3, it is sum u^2 |grad u| / W^(2/3), by Hoelder's inequality at most (sum l^3)^(1/3).
    """
    slopes = 2 * np.cbrt(np.abs(balls.weights)) / balls.radii.min(axis=1)
    return float(np.cbrt((slopes[:, None] ** 3 * balls.membership).sum(axis=0)).max())
