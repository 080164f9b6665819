"""Friction between layers of cloth: every pair that touches holds its two closest points together, and slips.

Springs as stiff as the barrier is there, and slipping, as on the body (see ``friction``). Stiffness, greatest force,
the line between the closest points and their weights are those of the last iterate; a spring lasts as long as its pair
touches at the end of every step.
"""

import numpy as np
import taichi as ti

from taichi_tryon.contact import friction


@ti.data_oriented
class Rubbing:
    """Friction of pairs of cloth at ``x`` with the velocity ``v``, moving from ``x_start`` in this step; they have each
    four ``corner``s with a ``weight``, and their normal ``load`` [N] and ``hold`` [N/m], to which friction is added."""

    def __init__(self, x, x_start, v, corner, weight, load, hold, coefficient: float):
        self.x, self.x_start, self.v = x, x_start, v
        self.corner, self.weight, self.load, self.hold = corner, weight, load, hold
        self.coefficient = ti.field(float, shape=())
        self.coefficient[None] = coefficient
        room = corner.shape[0]
        self.normal, self.slip = (ti.Vector.field(3, float, shape=room) for _ in range(2))
        # as in BodyContact
        self.stick, self.limit, self.along = (ti.field(float, shape=room) for _ in range(3))
        # pairs that touched at the end of the last step, by their keys in rising order, how far their springs were
        # stretched [m], and whether they slipped
        self.keys, self.slips, self.slipped = np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0, np.int32)
        # those that are bound now
        self.bound = self.keys

    def compile(self) -> None:
        """Compile every kernel, on no pair."""
        self._bind(self.slips[:0], self.slipped[:0], 0.0)
        self._measure(np.zeros(0))
        self._end_step(self.slips[:0], self.slipped[:0])

    def bind(self, keys: np.ndarray, first: bool, ahead: float) -> None:
        """Add friction to the first pairs, whose rising ``keys`` (k,) say which they are, as their normal load is now;
        see ``BodyContact.bind``."""
        self.bound = keys
        if not len(keys):
            return
        slips, slipped = np.zeros((len(keys), 3)), np.zeros(len(keys), np.int32)
        place = np.searchsorted(self.keys, keys)
        known = np.flatnonzero(place < len(self.keys))
        known = known[self.keys[place[known]] == keys[known]]
        slips[known] = self.slips[place[known]]
        if first:
            slipped[known] = self.slipped[place[known]]
        self._bind(slips, slipped, ahead)

    @ti.kernel
    def _bind(self, slips: ti.types.ndarray(), slipped: ti.types.ndarray(), ahead: float):
        for p in range(slipped.shape[0]):
            force, mu = self.load[p].norm(), self.coefficient[None]
            n = self.load[p] / ti.max(force, 1e-30)
            self.normal[p] = n
            for k in ti.static(range(3)):
                self.slip[p][k] = ti.cast(slips[p, k], float)
            # without friction there is no spring, not even where nothing has slipped yet
            stick, limit = self.hold[p].trace() if mu > 0.0 else 0.0, mu * force
            drag, along = self._drag(p), ti.cast(1.0, float)
            v = self._between(self.v, p)
            if slipped[p] == 1 or friction.slips(stick, limit, drag + ahead * (v - n * n.dot(v))):
                along = friction.ALONG
            self.stick[p], self.limit[p], self.along[p] = stick, limit, along
            bond = friction.bond_of(stick, limit, drag.norm())
            self.load[p] -= bond * drag
            self.hold[p] += friction.tangent(bond, along, drag, n.outer_product(n))

    @ti.func
    def _between(self, vector: ti.template(), p: int):
        i, w = self.corner[p], self.weight[p]
        return w[0] * vector[i[0]] + w[1] * vector[i[1]] + w[2] * vector[i[2]] + w[3] * vector[i[3]]

    @ti.func
    def _drag(self, p: int):
        """Tangential way of the two points of pair p past each other, since they stuck."""
        n = self.normal[p]
        way = self.slip[p] + self._between(self.x, p) - self._between(self.x_start, p)
        return way - n * n.dot(way)

    def energy(self) -> float:
        """Energy [J] of the springs of the pairs that are bound."""
        if not len(self.bound):
            return 0.0
        energies = np.empty(len(self.bound))
        self._measure(energies)
        return float(energies.sum())

    @ti.kernel
    def _measure(self, energies: ti.types.ndarray()):
        for p in range(energies.shape[0]):
            energies[p] = friction.stored(self.stick[p], self.limit[p], self._drag(p).norm())

    def end_step(self) -> None:
        """Keep the springs' extension, cut to what friction can hold; what has parted forgets its spring."""
        count = len(self.bound)
        self.keys, self.slips, self.slipped = self.bound, np.zeros((count, 3)), np.zeros(count, np.int32)
        if count:
            self._end_step(self.slips, self.slipped)

    @ti.kernel
    def _end_step(self, slips: ti.types.ndarray(), slipped: ti.types.ndarray()):
        for p in range(slipped.shape[0]):
            reach = self.limit[p] / self.stick[p] if self.stick[p] > 0.0 else 0.0
            slip = friction.kept(self._drag(p), reach)
            for k in ti.static(range(3)):
                slips[p, k] = slip[k]
            slipped[p] = ti.cast(self.along[p] < 1.0, ti.i32)

    def state(self) -> dict[str, np.ndarray]:
        """What the next step depends on."""
        return {"layer_pairs": self.keys, "layer_slips": self.slips, "layer_slipped": self.slipped}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``."""
        self.keys, self.slips, self.slipped = (state[name] for name in ("layer_pairs", "layer_slips", "layer_slipped"))
