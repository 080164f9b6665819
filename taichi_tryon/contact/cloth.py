"""Contact of cloth with cloth: from a start free of crossings, no two triangles ever pass through each other.

Pairs of a vertex and a triangle and pairs of two edges that are nearer than the thickness t push each other apart along
the line of their closest points, by a barrier (see ``barrier``) that no step overcomes; and no step goes further than
every pair can go without meeting (see ``passage``). The Hessian of a pair is its barrier's curvature along that line;
that the line turns is left out. Across it pairs rub (see ``rubbing``).
"""

import numpy as np
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.contact import barrier
from taichi_tryon.contact.distance import FACE, weights_of
from taichi_tryon.contact.passage import free_part
from taichi_tryon.contact.proximity import Pairs, Proximity
from taichi_tryon.contact.rubbing import Rubbing
from taichi_tryon.errors import StepFailure

# pairs that can touch at once, for each vertex
PAIRS_PER_VERTEX = 16
# a vertex belongs to triangles on both sides, edges cross edges besides: this part of its area counts for a pair
SHARE = 0.25
# how often paths are shortened one by one before all of them are
ROUNDS = 6


@ti.data_oriented
class ClothContact:
    """Contact of the cloth at ``x``, on its way along ``path``, with itself. stiffness k [N/m^3], thickness t [m]: the
    pressure is about 3 k (t - d)^2 / t at a distance d little below t. ``rubbing`` is the friction, None without any.

    First ``look_ahead``, then ``evaluate`` as often as positions on that way are tried, then ``bind``. Of the first
    ``count`` pairs, bound ones and then guards, ``load`` is the force along their weights [N], ``hold`` the Hessian of
    their distance vector [N/m].
    """

    def __init__(self, cloth: Cloth, x, path, stiffness: float, thickness: float, friction=0.0, x_start=None, v=None):
        """friction: its coefficient, with which x_start and v are those of ``Rubbing``."""
        self.nv, self.x, self.path = cloth.vertex_count, x, path
        self.edge_length = float(np.sqrt(4 / np.sqrt(3) * cloth.areas.mean()))
        self.proximity = Proximity(cloth, x, path, thickness, self.edge_length)
        self.stiffness, self.thickness = (ti.field(float, shape=()) for _ in range(2))
        self.stiffness[None], self.thickness[None] = stiffness, thickness
        of_edge = np.bincount(cloth.triangle_edges.ravel(), np.repeat(cloth.areas / 3, 3), len(cloth.hinges))
        # of every vertex and edge, in the order of the proximity's lookers
        self.areas = SHARE * np.concatenate([cloth.vertex_areas, of_edge])
        self.capacity = PAIRS_PER_VERTEX * self.nv
        self.corner = ti.Vector.field(4, ti.i32, shape=self.capacity)
        self.weight = ti.Vector.field(4, float, shape=self.capacity)
        self.load = ti.Vector.field(3, float, shape=self.capacity)
        self.hold = ti.Matrix.field(3, 3, float, shape=self.capacity)
        self.start = ti.field(ti.i32, shape=self.nv + 1)
        self.entry = ti.field(ti.i32, shape=4 * self.capacity)
        self.rubbing: Rubbing | None = None
        if friction > 0.0:
            self.rubbing = Rubbing(x, x_start, v, self.corner, self.weight, self.load, self.hold, friction)
        self.pairs: Pairs | None = None
        self.pair_area, self.free, self.touching = np.zeros(0), np.zeros(0), np.zeros(0, bool)
        self.squeezed, self.count = 0.0, 0
        self.guards: list[tuple[Pairs, np.ndarray]] = []

    def compile(self, b) -> None:
        """Compile the kernels that are first needed when pieces meet, where none are looked at; b: see ``push``."""
        none = self.pairs[:0]
        self._free_parts(none.kind, none.corners, self.free[:0])
        self._guard(0, none.kind, self.free[:0], 0.0)
        self.push(b, self.capacity)
        if self.rubbing:
            self.rubbing.compile()

    # -- the way ahead --------------------------------------------------------------------------------------------

    def look_ahead(self) -> None:
        """Find the pairs that may touch on the way along ``path``, both ends included."""
        pairs = self.proximity.find()
        first, second = np.divmod(pairs.key, self.proximity.count)
        area = self.areas[first]
        edges = pairs.kind != FACE
        area[edges] = 0.5 * (area[edges] + self.areas[second[edges]])
        self.pairs, self.pair_area = pairs, area
        self.free = np.empty(len(pairs))

    def would_meet(self) -> np.ndarray:
        """(k,) which pairs would meet on the path; ``free`` (k,) is the part of it that each can go."""
        self._free_parts(self.pairs.kind, self.pairs.corners, self.free)
        return self.free < 1.0

    def guard(self, stiffness: float) -> bool:
        """Let a spring of a ``stiffness`` [N/m] stand between pieces that would meet on the path, until ``bind``;
        whether there are any that find a place: those that would meet first do."""
        short = np.flatnonzero(self.would_meet())
        short = np.sort(short[np.argsort(self.free[short], kind="stable")[: self.capacity - self.count]])
        if not len(short):
            return False
        self.guards.append((self.pairs[short], self.free[short]))
        self._bind_all(stiffness)
        return True

    def keep_apart(self, alike: bool = False) -> float:
        """Shorten ``path`` where pieces would meet; the least part of it that is left anywhere.

        First only the corners of the pairs in question go less far; should that bring others together too often, or
        where it is to be ``alike`` for all, all do.
        """
        if not len(self.pairs):
            return 1.0
        whole = self.path.to_numpy()
        part = np.ones(self.nv)
        for _ in range(0 if alike else ROUNDS):
            short = self.would_meet()
            if not short.any():
                return float(part.min())
            less = np.ones(self.nv)
            np.minimum.at(less, self.pairs.corners[short], self.free[short, None])
            part *= less
            fields.upload(self.path, whole * part[:, None])
            # what moved along together no longer does where only one has been shortened
            self.look_ahead()
        self.would_meet()
        part *= self.free.min(initial=1.0)
        fields.upload(self.path, whole * part[:, None])
        return float(part.min())

    @ti.kernel
    def _free_parts(self, kind: ti.types.ndarray(), corners: ti.types.ndarray(), free: ti.types.ndarray()):
        for p in range(kind.shape[0]):
            i = ti.Vector([corners[p, 0], corners[p, 1], corners[p, 2], corners[p, 3]])
            a, b, c, d = self.x[i[0]], self.x[i[1]], self.x[i[2]], self.x[i[3]]
            da, db, dc, dd = self.path[i[0]], self.path[i[1]], self.path[i[2]], self.path[i[3]]
            free[p] = free_part(kind[p], a, b, c, d, da, db, dc, dd)

    # -- energy, forces, Hessian ----------------------------------------------------------------------------------

    def evaluate(self) -> None:
        """Which pairs touch at the present positions, which lie on the paths last looked along, and the energy [J]
        with which they are ``squeezed``."""
        energies = np.empty(len(self.pairs))
        self._measure(self.pairs.kind, self.pairs.corners, self.pair_area, energies)
        self.touching = energies > 0
        # only those that touch: the sum's order must not depend on what else was looked at
        self.squeezed = float(energies[self.touching].sum())

    @property
    def stored(self) -> float:
        """Energy [J] of the pairs as last evaluated, and of the friction of those that were bound before."""
        return self.squeezed + (self.rubbing.energy() if self.rubbing else 0.0)

    @ti.kernel
    def _measure(
        self, kind: ti.types.ndarray(), corners: ti.types.ndarray(), area: ti.types.ndarray(),
        energies: ti.types.ndarray(),
    ):  # fmt: skip
        for p in range(kind.shape[0]):
            i = ti.Vector([corners[p, 0], corners[p, 1], corners[p, 2], corners[p, 3]])
            s, _n, _w = self._closeness(kind[p], i)
            t = self.thickness[None]
            energies[p] = area[p] * self.stiffness[None] * t * t * barrier.energy(s) if s > 0.0 else 0.0

    @ti.func
    def _closeness(self, kind: int, i):
        """1 - d / t, direction and weights of a pair."""
        a, b, c, d = self.x[i[0]], self.x[i[1]], self.x[i[2]], self.x[i[3]]
        w = weights_of(kind, a, b, c, d)
        away = self._between(self.x, i, w)
        length = ti.max(away.norm(), 1e-12)
        return 1.0 - length / self.thickness[None], away / length, w

    def bind(self, first: bool = False, ahead: float = 0.0) -> None:
        """Forces and Hessian of the pairs that touch, as last evaluated, without guards; ``first`` and ``ahead`` as in
        ``BodyContact.bind``. Raises StepFailure where there are more of them than can be held."""
        self.bound, self.bound_area = self.pairs[self.touching], self.pair_area[self.touching]
        self.guards = []
        self._bind_all(0.0)
        if self.rubbing:
            self.rubbing.bind(self.bound.key, first, ahead)

    def _bind_all(self, stiffness: float) -> None:
        corners = np.concatenate([self.bound.corners, *(pairs.corners for pairs, _ in self.guards)])
        if len(corners) > self.capacity:
            raise StepFailure(f"cloth lies on cloth in {len(corners)} places at once, {self.capacity} can be held")
        start, order = fields.group(corners.ravel(), self.nv)
        self._enter(corners, start, order)
        self.count = len(corners)
        if self.guards:
            pairs, free = self.guards[-1]
            self._guard(len(corners) - len(pairs), pairs.kind, free, stiffness)
        else:
            self._bind(self.bound.kind, self.bound_area)

    @ti.kernel
    def _enter(self, corners: ti.types.ndarray(), start: ti.types.ndarray(), order: ti.types.ndarray()):
        for i in range(self.nv + 1):
            self.start[i] = start[i]
        for n in range(order.shape[0]):
            self.entry[n] = order[n]
        for p in range(corners.shape[0]):
            self.corner[p] = ti.Vector([corners[p, 0], corners[p, 1], corners[p, 2], corners[p, 3]])

    @ti.kernel
    def _bind(self, kind: ti.types.ndarray(), area: ti.types.ndarray()):
        for p in range(kind.shape[0]):
            s, n, w = self._closeness(kind[p], self.corner[p])
            stiffness = area[p] * self.stiffness[None]
            self.weight[p] = w
            self.load[p] = stiffness * self.thickness[None] * barrier.slope(s) * n
            self.hold[p] = stiffness * barrier.curvature(s) * n.outer_product(n)

    @ti.kernel
    def _guard(self, first: int, kind: ti.types.ndarray(), free: ti.types.ndarray(), stiffness: float):
        """A spring along the line on which the pieces would meet; at rest where they have come to half the thickness,
        or where they are nearer already."""
        for k in range(kind.shape[0]):
            p = first + k
            i = self.corner[p]
            a, b = self._ahead(i[0], free[k]), self._ahead(i[1], free[k])
            c, d = self._ahead(i[2], free[k]), self._ahead(i[3], free[k])
            w = weights_of(kind[k], a, b, c, d)
            n = (w[0] * a + w[1] * b + w[2] * c + w[3] * d).normalized(1e-12)
            gap = n.dot(self._between(self.x, i, w))
            self.weight[p] = w
            self.hold[p] = stiffness * n.outer_product(n)
            self.load[p] = -stiffness * ti.max(gap - 0.5 * self.thickness[None], 0.0) * n

    @ti.func
    def _between(self, vector: ti.template(), i, w):
        """The vector field's weighted sum over the corners i."""
        return w[0] * vector[i[0]] + w[1] * vector[i[1]] + w[2] * vector[i[2]] + w[3] * vector[i[3]]

    @ti.func
    def _ahead(self, i: int, part: float):
        return self.x[i] + part * self.path[i]

    @ti.kernel
    def push(self, b: ti.template(), first: int):
        """Add the springs' forces from pair ``first`` on to a right-hand side."""
        for i in range(self.nv):
            for n in range(self.start[i], self.start[i + 1]):
                p, k = self.entry[n] // 4, self.entry[n] % 4
                if p >= first:
                    b[i] += self.weight[p][k] * self.load[p]

    @ti.func
    def force(self, i: int):
        """Force of cloth on cloth on vertex i [N]."""
        total = ti.Vector([0.0, 0.0, 0.0])
        for n in range(self.start[i], self.start[i + 1]):
            p, k = self.entry[n] // 4, self.entry[n] % 4
            total += self.weight[p][k] * self.load[p]
        return total

    @ti.func
    def own(self, i: int):
        """Hessian block of vertex i with itself."""
        total = ti.Matrix.zero(float, 3, 3)
        for n in range(self.start[i], self.start[i + 1]):
            p, k = self.entry[n] // 4, self.entry[n] % 4
            total += self.weight[p][k] * self.weight[p][k] * self.hold[p]
        return total

    @ti.func
    def product(self, i: int, vector: ti.template()):
        """Row i of the Hessian times a field of vectors, of which the first three entries count."""
        total = ti.Vector([0.0, 0.0, 0.0])
        for n in range(self.start[i], self.start[i + 1]):
            p, k = self.entry[n] // 4, self.entry[n] % 4
            between = self._between(vector, self.corner[p], self.weight[p])
            total += self.weight[p][k] * (self.hold[p] @ ti.Vector([between[0], between[1], between[2]]))
        return total
