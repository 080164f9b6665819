"""Contact and friction between the cloth and the body.

Normal: the samples are held off the skin by the contact thickness t, by a one-sided potential of the depth below that
offset whose pressure grows without bound towards the skin; see ``offset``. The paper's force -k grad W (eq. 3) jumps at
the skin and is four times stiffer in one place than in another.

Where limbs meet, cloth is held off both, each sample off the group that it is nearest to and off the next one, too, as
if each were alone; see ``between`` for where that leaves no room. Friction: see ``sticking``.
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.contact import between, offset
from taichi_tryon.contact import friction as dry
from taichi_tryon.contact.raising import Raising
from taichi_tryon.contact.samples import Samples
from taichi_tryon.contact.sticking import Sticking
from taichi_tryon.contact.webs import Webs
from taichi_tryon.kernel_loops import shared_if_many

# further off than this from the contact offset [m], a sample's gap need not be exact
BAND = 2e-3
# what goes into a checkpoint
KEPT = ("slip", "along", "seen", "until", "kept")
# cloth further off the body than this is not carried along with it [m]
CARRIED = 0.04


@ti.data_oriented
class BodyContact(Raising, Sticking, Webs):
    """Contact of samples of the cloth at ``x`` (moving from ``x_start`` in this step) with a body field.

    stiffness [N/m^3], thickness [m] (the samples are held that far off the skin), friction coefficient; sleeps False:
    samples far off are looked at every time. Without friction nothing of it is compiled. In all ``evaluations``, each
    sample was ``looked`` at so often, and so often ``known`` from before, the body and it being still where they were.
    """

    def __init__(
        self, samples: Samples, body, x, x_start, v, stiffness: float, thickness: float, friction: float, sleeps=True
    ):
        self.samples, self.sleeps, self.rubs = samples, sleeps, friction > 0.0
        self.count, self.nv = len(samples.areas), x.shape[0]
        self.body, self.x, self.x_start, self.v = body, x, x_start, v
        room = max(self.count, 1)
        tables = fields.Tables()
        self.vertex = tables.vectors(samples.vertices)
        self.weight = tables.vectors(samples.weights)
        self.area = tables.scalars(samples.areas)
        self.span = tables.scalars(samples.spans)
        self.stiffness, self.thickness, self.friction, self.last = (ti.field(float, shape=()) for _ in range(4))
        self.stiffness[None], self.thickness[None], self.friction[None] = stiffness, thickness, friction
        self.evaluations, self._placed = 0, -1
        self.firm()
        # of the friction spring: stiffness [N/m], greatest force [N], and the part of stiffness along the way it slips
        self.stick, self.limit, self.along = (ti.field(float, shape=room) for _ in range(3))
        self.gap, self.depth = (ti.field(float, shape=room) for _ in range(2))
        # how much further off than the thickness it is held: since the skin bulges (0: not known yet); since
        # cloth was found in the body, now; and from the next stage of a step on
        self.bulge, self.further, self.kept, self.found = (ti.field(float, shape=room) for _ in range(4))
        self.triangles = len(samples.of_triangle)
        self.of_triangle = tables.vectors(samples.of_triangle) if self.triangles else None
        self.normal, self.drag, self.slip, self.load = (ti.Vector.field(3, float, shape=room) for _ in range(4))
        # of the group that comes next, where that is near; else beyond all offsets
        self.gap_beside = ti.field(float, shape=room)
        self.normal_beside = ti.Vector.field(3, float, shape=room)
        # where a sample was last looked at, and how far it and the body together may go until it is looked at again
        self.seen = ti.Vector.field(3, float, shape=room)
        self.until = ti.field(float, shape=room)
        self.until.fill(-1.0)
        # in a web, the slope that gaps are measured by, else 0; and the slope now over that one
        self.web, self.yields = (ti.field(float, shape=room) for _ in range(2))
        # whether no stage of the step has been bound yet
        self._begins = True
        self.winner, self.looked, self.known = (ti.field(ti.i32, shape=room) for _ in range(3))
        entries = samples.weights.ravel().nonzero()[0]
        start, order = fields.group(samples.vertices.ravel()[entries], self.nv)
        self.entry_start, self.entry = tables.scalars(start), tables.scalars(entries[order])
        tables.fill()
        self.sums, self.corners = fields.sums(2), np.empty((fields.CHUNKS, 6))
        # how deep [m] a sample is in the body where the energy was last asked for, at most
        self.inside = 0.0

    @ti.func
    def _at(self, field: ti.template(), s: int):
        """Value of a vertex field at a sample."""
        i, w = self.vertex[s], self.weight[s]
        return field[i[0]] * w[0] + field[i[1]] * w[1] + field[i[2]] * w[2]

    @ti.func
    def _pressure(self, depth: float) -> float:
        """Normal pressure [Pa] at a depth."""
        return offset.pressure(self.stiffness[None], self.thickness[None], depth, self.last[None])

    @ti.func
    def _steepness(self, depth: float) -> float:
        """Derivative of the pressure with respect to the depth [N/m^3]."""
        return offset.steepness(self.stiffness[None], self.thickness[None], depth, self.last[None])

    @ti.func
    def _stored(self, depth: float) -> float:
        """Integral of the pressure over the depth [J/m^2]."""
        return offset.stored(self.stiffness[None], self.thickness[None], depth, self.last[None])

    def firm(self, yet: bool = True):
        """Let the pressure grow so much that the skin is not reached; not ``yet``: give way to what is forced."""
        last = offset.FIRM if yet else offset.YIELDING
        if self.last[None] != last:
            # all must be looked at again, also what lies still
            self.last[None], self._placed = last, -1

    def cover(self):
        """Tell a body that leaves out what is out of reach where it is asked for: where the cloth is."""
        if not self.body.everywhere:
            self._measure(self.corners)
            self.body.cover(np.fmin.reduce(self.corners[:, :3]), np.fmax.reduce(self.corners[:, 3:]))

    @ti.func
    def _beside(self, s: int):
        """Depth of sample s below the offset of the next group, and how much that faces the nearest, 0 to 1."""
        depth, share = ti.max(self.thickness[None] + self._raised(s) - self.gap_beside[s], 0.0), ti.cast(0.0, float)
        if depth > 0.0:
            share = between.facing(self.normal[s], self.normal_beside[s])
        return depth, share

    @ti.func
    def _pushes(self, s: int):
        """Depths of sample s below the offsets of the nearest group and of the next that count, and which way [1] each
        pushes."""
        other, share = self._beside(s)
        one, push, beside = self.depth[s], self.normal[s], self.normal_beside[s]
        if self.web[s] > 0.0:
            push *= self.yields[s]
        if share > 0.0:
            common, by_one, by_other = share * between.relief(one, other, self.thickness[None])
            one, other = one - common, ti.max(other - common, 0.0)
            push, beside = (1.0 - by_one) * push - by_other * beside, (1.0 - by_other) * beside - by_one * push
        return one, other, push, beside

    @ti.func
    def _respond(self, s: int):
        """Force on sample s [N], from depth, normal and drag."""
        one, other, push, beside = self._pushes(s)
        load = (self._pressure(one) * push + self._pressure(other) * beside) * self.area[s]
        if ti.static(self.rubs):
            load -= self._bond(s) * self.drag[s]
        self.load[s] = load

    @ti.func
    def _hold(self, s: int):
        """Hessian of sample s [N/m], which few enough feel to make it where it is asked for."""
        one, other, push, beside = self._pushes(s)
        hold = self._steepness(one) * self.area[s] * push.outer_product(push)
        hold += self._steepness(other) * self.area[s] * beside.outer_product(beside)
        if ti.static(self.rubs):
            n = self._across(s)
            hold += dry.tangent(self._bond(s), self.along[s], self.drag[s], n.outer_product(n))
        return hold

    @ti.kernel
    def _measure(self, corners: ti.types.ndarray()):
        """Least and greatest coordinates of the vertices, between which all samples are."""
        for chunk in range(fields.CHUNKS):
            first, last = fields.chunk_bounds(chunk, self.nv)
            none = ti.Vector([ti.math.inf, ti.math.inf, ti.math.inf], ti.f64)
            low, high = none, -none
            for i in range(first, last):
                low, high = ti.min(low, ti.cast(self.x[i], ti.f64)), ti.max(high, ti.cast(self.x[i], ti.f64))
            for k in ti.static(range(3)):
                corners[chunk, k], corners[chunk, 3 + k] = low[k], high[k]

    def carry(self, part: float):
        """Take the cloth along with a body that has moved (by ``part`` of its motion since the start of the step), the
        less the further it is off: from there Newton's method finds contact and friction as they were, instead of a
        body that has run into the cloth."""
        self.cover()
        self._carry(part)

    @ti.kernel
    @shared_if_many
    def _carry(self, part: float):
        for i in range(self.nv):
            gap, _normal, winner, _density = self.body.gap_within(self.x[i], 0.0, -1)
            share = part * ti.math.clamp(1.0 - gap / CARRIED, 0.0, 1.0)
            if share > 0.0:
                self.x[i] += share * self.body.motion(self.x[i], winner)

    def evaluate(self):
        """Depth, normal and tangential displacement of every sample at the present positions, and its force.

        What is far off sleeps: it is not looked at until it, or the body, could have come near. What is where it was
        last, the body too, keeps depth and normal.
        """
        if self.count == 0:
            return
        self.cover()
        body = self.body
        still = body.rests and body.placed == self._placed
        self._evaluate(body.travelled, int(still), int(body.moves), int(self._begins))
        self.evaluations, self._placed = self.evaluations + 1, body.placed

    @ti.kernel
    @shared_if_many
    def _evaluate(self, travelled: float, still: int, moves: int, begins: int):
        for s in range(self.count):
            point = self._at(self.x, s)
            away = point - self.seen[s]
            # what is not a number is not asleep
            awake = not away.norm() + travelled < self.until[s]
            if awake or ti.static(not self.sleeps):
                # what may be in a web is looked at again where a step begins
                settled = begins == 0 or (self.web[s] == 0.0 and self.gap[s] >= 0.0)
                if still == 1 and (away == 0.0).all() and settled:
                    self.known[s] += 1
                else:
                    self._look(s, point, travelled, awake, begins)
                self._arch(s, point, begins)
                self._press(s)
                if self.depth[s] > 0.0:
                    if ti.static(self.rubs):
                        self._drag(s, point, moves)
                    self._respond(s)

    @ti.func
    def _look(self, s: int, point, travelled: float, awake, begins: int):
        """Depth and normal of sample s, and how long it may sleep from here, where it does not."""
        reach = self._reach(s)
        gap, normal, winner, density = self._nearest(s, point, reach)
        alone = self.gap_beside[s] >= reach
        gap, normal, winner = self._in_web(s, point, gap, normal, winner, begins, alone)
        self.gap[s], self.normal[s], self.winner[s] = gap, normal, winner
        self.looked[s] += 1
        if awake:
            self.seen[s], self.until[s] = point, -1.0
        if gap > reach and awake:
            self.until[s], self.web[s] = travelled + self.body.clearance(density) - reach, 0.0

    @ti.func
    def _nearest(self, s: int, point, reach: float):
        """Gap, normal and group of the skin nearest to sample s, and W there. Where two groups are near, each counts as
        if it were alone, and the farther presses on the sample, too; reach: how far off the sample feels it at most."""
        only, other = -1, -1
        gap, normal, winner, density = ti.cast(0.0, float), ti.Vector.zero(float, 3), 0, ti.cast(0.0, float)
        self.gap_beside[s] = reach
        for turn in range(3):  # with one place that looks at the body, since a compiler takes each by itself
            found, outward, group, value = self.body.gap_within(point, reach + BAND, only)
            if turn == 0:
                gap, normal, winner, density = found, outward, group, value
                other, value = self.body.beside(point, group)
                # while it is forced on, cloth deep in two limbs goes out of the nearer one
                if self.last[None] < offset.FIRM or value == 0.0 or self.body.clearance(value) >= reach:
                    break
                only = group
            elif turn == 1:
                gap, normal, only = found, outward, other
            else:
                if found < gap:
                    gap, found, normal, outward, winner = found, gap, outward, normal, other
                self.gap_beside[s], self.normal_beside[s] = found, outward
        return gap, normal, winner, density

    @ti.func
    def _press(self, s: int):
        """Depth of sample s below where it is held."""
        self.depth[s] = ti.max(self.thickness[None] + self._raised(s) - self.gap[s], 0.0)
        if self.depth[s] == 0.0:
            self.load[s] = ti.Vector([0.0, 0.0, 0.0])

    @ti.func
    def room(self, i: int, travelled: float) -> float:
        """How far vertex i may go at least [m] before it could touch the body; 0 where that is not known."""
        free = ti.cast(ti.math.inf, float)
        if ti.static(self.count > 0):  # the first samples are the vertices
            free = ti.max(0.0, self.until[i] - travelled - (self.x[i] - self.seen[i]).norm())
        return free

    def bind(self, first: int, ahead: float):
        """Set friction's stiffness and limit from the present normal forces, and which samples slip; for the ``first``
        time in a stage also how far off the samples are held.

        Those whose spring is beyond its limit slip; for the ``first`` time in a step also those that slipped at the end
        of the last one, and those that will, ``ahead`` seconds along the velocity.
        """
        if self.count == 0:
            return
        if first:
            self._raise(int(self.body.moves), int(self._begins))
            self._begins = False
        if self.rubs:
            self._bind(first, ahead)

    def state(self) -> dict[str, np.ndarray]:
        """What the next step depends on; also what sleeps, and until when, since that bounds how far it may go."""
        held = {name: getattr(self, name).to_numpy() for name in KEPT}
        return {**held, "travelled": np.array(self.body.travelled)}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``, the body being where it was."""
        for name in KEPT:
            fields.upload(getattr(self, name), state[name])
        self.body.travelled = float(state["travelled"])
        # what is awake is looked at before it is asked for
        self._part()
        self._placed, self._begins = -1, True

    @ti.kernel
    def _part(self):
        """Let no sample be anywhere near the body."""
        for s in range(self.count):
            self.gap[s], self.bulge[s], self.depth[s], self.web[s] = ti.math.inf, 0.0, 0.0, 0.0
            self.load[s] = ti.Vector([0.0, 0.0, 0.0])

    def end_step(self):
        """Keep the springs' extension, cut to what friction can hold; what has left the body forgets its spring."""
        self._begins = True
        if self.count > 0 and self.rubs:
            self._end_step()

    @ti.func
    def force(self, i: int):
        """Contact and friction force on vertex i [N]."""
        total = ti.Vector([0.0, 0.0, 0.0])
        for n in range(self.entry_start[i], self.entry_start[i + 1]):
            s, k = self.entry[n] // 3, self.entry[n] % 3
            if self.depth[s] > 0.0:
                total += self.weight[s][k] * self.load[s]
        return total

    @ti.func
    def block(self, s: int, a: int, b: int):
        """Hessian block of sample s between its corners a and b."""
        result = ti.Matrix.zero(float, 3, 3)
        if self.depth[s] > 0.0:
            result = self.weight[s][a] * self.weight[s][b] * self._hold(s)
        return result

    @ti.func
    def row_sum(self, i: int):
        """Sum of the Hessian blocks in row i (the samples' weights sum to one), and the block on the diagonal."""
        total, own = ti.Matrix.zero(float, 3, 3), ti.Matrix.zero(float, 3, 3)
        for n in range(self.entry_start[i], self.entry_start[i + 1]):
            s, k = self.entry[n] // 3, self.entry[n] % 3
            if self.depth[s] > 0.0:
                part = self.weight[s][k] * self._hold(s)
                total += part
                own += self.weight[s][k] * part
        return total, own

    @ti.kernel
    def _sum_energy(self, sums: ti.types.ndarray()):
        for chunk in range(fields.CHUNKS):
            low, high = fields.chunk_bounds(chunk, self.count)
            total, deepest = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
            for s in range(low, high):
                if self.depth[s] > 0.0:
                    one, other, _push, _beside = self._pushes(s)
                    deepest = ti.max(deepest, ti.cast(one - self._raised(s) - self.thickness[None], ti.f64))
                    total += (self._stored(one) + self._stored(other)) * self.area[s]
                    if ti.static(self.rubs):
                        total += dry.stored(self.stick[s], self.limit[s], self.drag[s].norm())
            sums[chunk, 0], sums[chunk, 1] = total, deepest

    def energy(self) -> float:
        """Energy [J] of contact and of the friction springs."""
        if self.count == 0:
            return 0.0
        self._sum_energy(self.sums)
        self.inside = float(self.sums[:, 1].max())
        return float(self.sums[:, 0].sum())

    def pressures(self) -> np.ndarray:
        """Normal pressure on each sample (ns,) [Pa] as last evaluated; 0 out of contact."""
        result = np.zeros(self.count)
        if self.count > 0:
            self._tell_pressures(result)
        return result

    @ti.kernel
    def _tell_pressures(self, result: ti.types.ndarray()):
        for s in range(self.count):
            if self.depth[s] > 0.0:
                depth, _other, _push, _beside = self._pushes(s)
                result[s] = self._pressure(depth)
