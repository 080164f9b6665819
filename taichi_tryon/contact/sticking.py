"""Friction of the cloth on the body: what sticks to the skin, and what slips.

Each sample holds to the skin by a tangential spring as stiff as the contact is there, which slips where its force
exceeds mu times the normal force (Coulomb): what sticks does not creep. Within a Newton iteration stiffness and limit
are those of the last iterate's normal force on the nearest group, which makes friction the gradient of a convex
potential, quadratic where it sticks and linear where it slips (see ``friction``); at convergence Coulomb's law holds
exactly.
"""

import taichi as ti

from taichi_tryon.contact import friction as dry
from taichi_tryon.kernel_loops import shared_if_many


class Sticking:
    """What a ``BodyContact`` does so; all fields are its own."""

    @ti.func
    def _across(self, s: int):
        """Unit normal of the plane in which sample s rubs: the nearest skin's, or one between both."""
        n = self.normal[s]
        other, share = self._beside(s)
        if share > 0.0:
            n = (self.depth[s] * n - share * other * self.normal_beside[s]).normalized()
        return n

    @ti.func
    def _bond(self, s: int) -> float:
        """Friction on sample s over its drag [N/m]."""
        return dry.bond_of(self.stick[s], self.limit[s], self.drag[s].norm())

    @ti.func
    def _drag(self, s: int, point, moves: int):
        """The tangential displacement of sample s, at a point, from what it sticks to."""
        path = self.slip[s] + point - self._at(self.x_start, s)
        if moves == 1:
            path -= self.body.motion(point, self.winner[s])
        n = self._across(s)
        self.drag[s] = path - n * n.dot(path)

    @ti.kernel
    @shared_if_many
    def _bind(self, first: int, ahead: float):
        for s in range(self.count):
            self._rub(s, first, ahead)

    @ti.func
    def _rub(self, s: int, first: int, ahead: float):
        """Set sample s's friction."""
        slipped = first == 1 and self.along[s] < 1.0
        self.stick[s], self.limit[s], self.along[s] = 0.0, 0.0, 1.0
        if self.depth[s] > 0.0:
            n, v = self._across(s), self._at(self.v, s)
            # without friction there is no spring, not even where nothing has slipped yet
            depth, _other, _push, _beside = self._pushes(s)
            self.stick[s] = self._steepness(depth) * self.area[s] if self.friction[None] > 0.0 else 0.0
            self.limit[s] = self.friction[None] * self._pressure(depth) * self.area[s]
            drag = self.drag[s] + ahead * (v - n * n.dot(v))
            if slipped or dry.slips(self.stick[s], self.limit[s], drag):
                self.along[s] = dry.ALONG
            self._respond(s)

    @ti.kernel
    def _end_step(self):
        for s in range(self.count):
            slip = ti.Vector([0.0, 0.0, 0.0])
            if self.depth[s] > 0.0:
                depth, _other, _push, _beside = self._pushes(s)
                slip = dry.kept(self.drag[s], self.friction[None] * self._pressure(depth) / self._steepness(depth))
            self.slip[s] = slip
