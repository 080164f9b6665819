"""Bending by mid-edge normals, with one rotation per edge that minimises the energy: see ``bending``. The potential of
dry friction is part of that energy."""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth.bending import stuck_stiffness
from taichi_tryon.cloth.bending_friction import BendingFriction
from taichi_tryon.cloth.hinges import Hinges
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.kernel_loops import shared_if_many

# Sweeps of the edge rotations' iteration an evaluation; it starts from the rotations of the last one. An even number
# ends in the first of the two buffers.
SWEEPS = 6


@ti.data_oriented
class MidEdge:
    """The energy of all triangles' edge angles at positions ``x``, in ``hinges``."""

    # nothing of it is the same at all positions: see ``constant``
    constant = False
    hinged = True

    def __init__(self, cloth: Cloth, x, tables: fields.Tables):
        self.nt, self.ne = len(cloth.triangles), len(cloth.hinges)
        stiffness = cloth.edge_stiffness
        self.hinges = Hinges(cloth, stiffness, x, tables)
        self.hinge_triangle = tables.vectors(cloth.hinge_triangles)
        self.triangle_edge = tables.vectors(seen(cloth.triangle_edges, cloth.edge_signs))
        self.stiffness = tables.matrices(stiffness)
        diagonal = np.bincount(cloth.triangle_edges.ravel(), np.einsum("tkk->tk", stiffness).ravel(), self.ne)
        self.friction = BendingFriction(cloth, tables)
        if self.friction.present:
            # a bound of the stiffness, whatever slips: with it the iteration for the rotations never diverges
            stuck = stuck_stiffness(cloth.gradients, cloth.areas, cloth.bend_friction)
            diagonal += np.bincount(cloth.triangle_edges.ravel(), np.einsum("tkk->tk", stuck).ravel(), self.ne)
        self.rotation_diagonal = tables.scalars(np.where(cloth.edge_clamps == 0, diagonal, np.inf))
        around, by_rotation, by_spread = _couplings(cloth, stiffness)
        self.around = tables.vectors(around)
        self.by_rotation, self.by_spread = tables.vectors(by_rotation), tables.scalars(by_spread)
        self.load = ti.field(float, shape=self.ne)
        self.rotation = ti.field(float, shape=(2, self.ne))
        self.rotation_step = ti.field(float, shape=self.ne)
        self._chebyshev(cloth.edge_rate)

    def _chebyshev(self, rate: tuple[float, float]):
        """Coefficients of the Chebyshev iteration for a spectrum within ``rate`` (Saad, Iterative Methods, 12.1)."""
        centre, half = (rate[1] + rate[0]) / 2, (rate[1] - rate[0]) / 2
        sigma = centre / half
        rho = 1 / sigma
        keep, add = [0.0], [1 / centre]
        for _ in range(SWEEPS - 1):
            following = 1 / (2 * sigma - rho)
            keep.append(following * rho)
            add.append(2 * following / half)
            rho = following
        self.keep, self.add = keep, add

    def begin_step(self):
        """Remember how far the hinges spread."""
        self.hinges.begin_step()

    @ti.kernel
    @shared_if_many
    def end_step(self):
        """Dry friction slips."""
        for t in range(self.nt):
            self.friction.drag(t, self._leans(t, 0))

    def begin_stage(self, v, ahead: float, beyond: float):
        """Count the rates of the hinges as ``Elastic.begin_stage`` says."""
        self.hinges.begin_stage(v, ahead, beyond)

    @ti.kernel
    @shared_if_many
    def evaluate(self, inverse_dt: float):
        """Spreads, edge rotations and moments at the present positions."""
        for e in range(self.ne):
            self._measure(e)
        for e in range(self.ne):
            self._load(e)
        for sweep in ti.static(range(SWEEPS)):
            for e in range(self.ne):
                self._turn(e, self.keep[sweep], self.add[sweep], sweep % 2)
        for e in range(self.ne):
            self._evaluate_moment(e, inverse_dt)

    @ti.func
    def _leans(self, t: int, buffer: int):
        """alpha: how far the normals of the three edges lean outward from the normal of triangle t."""
        alpha = ti.Vector([0.0, 0.0, 0.0])
        for k in ti.static(range(3)):
            e, sign = edge_and_sign(self.triangle_edge[t][k])
            alpha[k] = 0.5 * self.hinges.spread[e] + sign * self.rotation[buffer, e]
        return alpha

    @ti.func
    def _edge_moment(self, t: int, e: int):
        """Derivative of triangle t's energy with respect to its angle at edge e."""
        alpha = self._leans(t, 0)
        m = self.stiffness[t] @ alpha
        moment = ti.cast(0.0, float)
        for k in ti.static(range(3)):
            if edge_and_sign(self.triangle_edge[t][k])[0] == e:
                moment = m[k]
        if ti.static(self.friction.present):
            moment += self.friction.at_edge(t, e, alpha)[0]
        return moment

    @ti.func
    def _measure(self, e: int):
        if self.hinges.inner(e):
            self.hinges.measure(e)
            if self.hinges.clamp[e] != 0:
                # the edge's normal is that of the clamped triangle
                for buffer in range(2):
                    self.rotation[buffer, e] = -0.5 * self.hinges.clamp[e] * self.hinges.spread[e]

    @ti.func
    def _load(self, e: int):
        """The part of the energy's derivative with respect to rotation e that the spreads make."""
        total = self.by_spread[e] * self.hinges.spread[e]
        for k in ti.static(range(4)):
            other, sign = edge_and_sign(self.around[e][k])
            # half a spread leans outward on both sides
            total += 0.5 * sign * self.by_rotation[e][1 + k] * self.hinges.spread[other]
        self.load[e] = total

    @ti.func
    def _turn(self, e: int, keep: float, add: float, source: int):
        """One Chebyshev sweep on edge rotation e, from buffer ``source`` to the other one."""
        slope = self.load[e] + self.by_rotation[e][0] * self.rotation[source, e]
        for k in ti.static(range(4)):
            slope += self.by_rotation[e][1 + k] * self.rotation[source, edge_and_sign(self.around[e][k])[0]]
        if ti.static(self.friction.present):
            for side in range(2):
                t = self.hinge_triangle[e][side]
                if t >= 0:
                    sign = 0
                    for k in ti.static(range(3)):
                        other, side_sign = edge_and_sign(self.triangle_edge[t][k])
                        if other == e:
                            sign = side_sign
                    slope += sign * self.friction.at_edge(t, e, self._leans(t, source))[0]
        step = keep * self.rotation_step[e] - add * slope / self.rotation_diagonal[e]
        self.rotation_step[e] = step
        self.rotation[1 - source, e] = self.rotation[source, e] + step

    @ti.func
    def _evaluate_moment(self, e: int, inverse_dt: float):
        if self.hinges.inner(e):
            total = self.hinges.drag(e, inverse_dt)
            for side in range(2):
                total += self.hinges.share(e) * self._edge_moment(self.hinge_triangle[e][side], e)
            self.hinges.moment[e] = total
            if ti.static(self.friction.present):
                stuck = ti.cast(0.0, float)
                for side in range(2):
                    t = self.hinge_triangle[e][side]
                    stuck += self.friction.at_edge(t, e, self._leans(t, 0))[1]
                self.friction.stuck[e] = self.hinges.share(e) ** 2 * stuck

    @ti.func
    def force(self, i: int):
        """Force [N] on vertex i, at the positions last evaluated."""
        return self.hinges.force(i)

    @ti.func
    def block(self, e: int, i: int, j: int, inverse_dt: float):
        """Hessian block of hinge e between its roles i and j, edge rotations held (Gauss-Newton)."""
        stiffness = self.hinges.stiffness[e]
        if ti.static(self.hinges.damped):
            stiffness *= 1.0 + self.hinges.tau[e] * inverse_dt
        if ti.static(self.friction.present):
            stiffness += self.friction.stuck[e]
        return self.hinges.block(e, i, j, stiffness)

    @ti.func
    def energy(self, chunk: int, first: int, last: int):
        """A chunk's share of the energy [J] of the triangles from ``first`` to before ``last``."""
        total = ti.cast(0.0, ti.f64)
        low, high = fields.chunk_bounds(chunk, last - first)
        for t in range(first + low, first + high):
            alpha = self._leans(t, 0)
            total += 0.5 * alpha.dot(self.stiffness[t] @ alpha)
            if ti.static(self.friction.present):
                total += self.friction.potential(t, alpha)
        return total

    @ti.func
    def drag_energy(self, chunk: int, inverse_dt: float, first: int, last: int):
        """A chunk's share of what internal friction does [J] in the triangles from ``first`` to before ``last``."""
        return self.hinges.drag_energy(chunk, inverse_dt, first, last)

    def state(self) -> dict[str, np.ndarray]:
        """What an evaluation starts from."""
        return {"rotation": self.rotation.to_numpy(), **self.friction.state()}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``."""
        fields.upload(self.rotation, state["rotation"])
        self.friction.restore(state)


def seen(edges: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """Edges, and the signs with which a triangle sees their rotations, in one number each."""
    return 2 * edges + (signs < 0)


@ti.func
def edge_and_sign(number: int):
    """What ``seen`` made one number of."""
    return number >> 1, 1 - 2 * (number & 1)


def _couplings(cloth: Cloth, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Around each edge the four others (ne, 4) of its triangles as these see them, itself where there are fewer; what
    rotations of itself and of those (ne, 5) add to the derivative of the energy with respect to its rotation [N m]; and
    what its own spread (ne,) does. The others' spreads do half of what their rotations do as the triangle sees them.
    """
    ne = len(cloth.hinges)
    around = np.repeat(2 * np.arange(ne, dtype=np.int32)[:, None], 4, axis=1)
    by_rotation, by_spread, signs = np.zeros((ne, 5)), np.zeros(ne), cloth.edge_signs
    for side in range(2):
        e = np.flatnonzero(cloth.hinge_triangles[:, side] >= 0)
        t = cloth.hinge_triangles[e, side]
        own = np.argmax(cloth.triangle_edges[t] == e[:, None], axis=1)
        for turn in range(3):
            other = (own + turn) % 3
            lean = signs[t, own] * stiffness[t, own, other]
            place = 2 * side + turn if turn else 0
            by_rotation[e, place] += lean * signs[t, other]
            if turn:
                around[e, place - 1] = seen(cloth.triangle_edges[t, other], signs[t, other])
            else:
                by_spread[e] += 0.5 * lean
    return around, by_rotation, by_spread
