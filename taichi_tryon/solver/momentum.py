"""Pieces of cloth in free flight keep their momenta exactly, whatever the scheme and however roughly it is solved.

What neither the body touches nor a hold leads has gravity alone acting from outside: over a step its velocity changes
by dt g in the mean, and its angular momentum about the centre of mass not at all. No L-stable scheme knows that: only
those keep every quadratic invariant that damp nothing (Hairer, Lubich and Wanner 2006, Geometric Numerical Integration,
theorem IV.2.2). Backward Euler loses dt sum m v_n+1 x v_n of it every step. So the velocities are projected onto the
momenta that are known (ibid., section IV.4, "projection methods"), by the change of least kinetic energy, which is a
rigid motion of the piece,

    v <- v + (u - sum m v / sum m) + omega x r,     I omega = L - sum m r x v,

with the mean velocity u and the angular momentum L that there ought to be, r from the centre of mass, and I the tensor
of inertia. It strains nothing, and is as small as the scheme's local error, so that the order stays. Pieces that are
touched or held in a step are left alone: there contact and holds decide.

So are those that Newton's few iterations left short of where the step leads, as right before a body: with all of their
speed, but not all of the way that belongs to it, they would gain energy. Every scheme keeps u by itself, so that what
is missing of it tells: dt times the net force that is left, over the mass.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from taichi_tryon import fields
from taichi_tryon.cloth.model import Cloth


class FreeFlight:
    """Which pieces of a cloth fly freely, and the momenta with which they end a step.

    ``touched`` (pieces,) bool: those that the body touched at the end of the last step, a part of the next one's state.
    """

    def __init__(self, cloth: Cloth):
        self.masses = cloth.masses
        links = np.concatenate([cloth.triangles[:, :2], cloth.triangles[:, 1:], cloth.tapes])
        shape = (cloth.vertex_count, cloth.vertex_count)
        graph = sp.coo_matrix((np.ones(len(links)), tuple(links.T)), shape=shape)
        self.count, self.piece = connected_components(graph, directed=False)
        self.touched = np.zeros(self.count, bool)
        self._now, self._ever = self.touched, self.touched
        self._momenta, self._unsolved = [], 0.0

    def meet(self, contact, layers, first: bool) -> None:
        """A stage of a step has been solved, the ``first`` or another: note which pieces are touched at its end, by
        the body or by each other."""
        touching = np.flatnonzero(contact.depth.to_numpy() > 0)
        self._now = np.isin(np.arange(self.count), self.piece[contact.samples.vertices[touching, 0]])
        if layers is not None:
            pieces = self.piece[layers.bound.corners]
            self._now[np.unique(pieces[(pieces != pieces[:, :1]).any(axis=1)])] = True
        self._ever = self._now | (self.touched if first else self._ever)

    def leave(self, step, dt: float) -> None:
        """``step``, which takes ``dt`` [s], has found its positions but not yet its velocities: note the momenta that
        what flies freely must end with."""
        self.touched, self._momenta = self._now, []
        if dt == 0.0 or self._ever.all():
            return
        held = np.isin(np.arange(self.count), self.piece[(step.free.to_numpy() == 0).any(axis=1)])
        flying = np.flatnonzero(~self._ever & ~held)
        if len(flying):
            positions, velocities = _doubles(step.x_start), _doubles(step.v)
            fall = dt * step.gravity.to_numpy()
            # where each vertex is left with the force that is tolerated
            self._unsolved = dt * step.settings.tolerance * step.potential.weight / np.linalg.norm(self.masses)
        for number in flying:
            where = self.piece == number
            _, _, mean, angular = self._of(where, positions, velocities)
            self._momenta.append((where, mean + fall, angular))

    def keep(self, step) -> None:
        """Correct the velocities with which ``step`` ends."""
        if not self._momenta:
            return
        positions, velocities = _doubles(step.x), _doubles(step.v)
        for where, speed, angular in self._momenta:
            m, arms, mean, spin = self._of(where, positions, velocities)
            if np.linalg.norm(speed - mean) > self._unsolved:
                continue
            inertia = (m @ (arms**2).sum(axis=1)) * np.eye(3) - (arms.T * m) @ arms
            # a piece stretched to a line has no inertia about it, and no momentum
            turn = np.linalg.lstsq(inertia, angular - spin, rcond=1e-12)[0]
            velocities[where] += speed - mean + np.cross(turn, arms)
        fields.upload(step.v, velocities)

    def _of(self, where: np.ndarray, positions: np.ndarray, velocities: np.ndarray):
        """Masses of a piece, arms from its centre of mass, mean velocity, angular momentum about that centre."""
        m = self.masses[where]
        arms = positions[where] - m @ positions[where] / m.sum()
        return m, arms, m @ velocities[where] / m.sum(), m @ np.cross(arms, velocities[where])


def _doubles(field) -> np.ndarray:
    return field.to_numpy().astype(float)
