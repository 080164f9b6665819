"""Newton's method on the incremental potential Phi: (M / dt^2 + H) d = -grad Phi, and a line search along d.

H is made positive semi-definite block by block until Phi's slope is small. The search costs nothing where the full step
lowers Phi. Where cloth may touch cloth, d is turned aside and each vertex stopped before they meet.
"""

from dataclasses import dataclass

import numpy as np

from taichi_tryon.solver import guards
from taichi_tryon.solver.coarse import CoarseSpace, patch_count
from taichi_tryon.solver.conjugate_gradients import ConjugateGradients
from taichi_tryon.solver.leaving import Leaving
from taichi_tryon.solver.local import LocalBlocks
from taichi_tryon.solver.partition import blocks, patches
from taichi_tryon.solver.potential import Potential
from taichi_tryon.solver.settings import StepSettings
from taichi_tryon.solver.way import Way

# the line search tries no smaller share of a step
LEAST_SHARE = 1 / 64
# below this residual, where a step is to be solved further, the membrane's Hessian is taken as it is, compression and
# all: without it, wrinkles are stiffer in the matrix than in truth and take twice as many iterations
EXACT_BELOW = 1e-3
# vertices of a local block of the preconditioner
LOCAL_SIZE = 8
# steps, or stages of one, that do not try to coast after one to which it was of no use
WAIT = 7
# Newton iterations that share a coarse space
REFRESH = 2
# at rest, the part of the force along the way that is left at its end from which on it is gone further, how much
# further at a time at most, and how often
HARDLY_LESS, FURTHER, TIMES = 0.5, 8.0, 4


@dataclass
class Solution:
    """Whether Newton's method got anywhere, what it cost, and the ``residual``, |grad Phi| over the weight, that is
    left."""

    found: bool = False
    newton_iterations: int = 0
    linear_iterations: int = 0
    residual: float = np.inf


class Newton:
    """Moves the cloth to where a Potential is least; ``way`` is how it may go there."""

    def __init__(self, cloth, potential: Potential, way: Way, preconditioner: str, clock):
        self.potential, self.way, self.layers, self.clock = potential, way, potential.layers, clock
        self.linear = _linear(cloth, potential, preconditioner)
        # a smaller part of Phi is rounding
        self.rounding = max(1e-9, float(np.finfo(potential.x.to_numpy().dtype).eps))
        self.settings: StepSettings | None = None
        # steps until it is tried again whether the cloth coasts
        self.wait = 0
        self.leaving = Leaving(potential.contact)
        self.solution = Solution()
        self._exact = False

    def minimise(self, inverse_dt: float, ahead: float, settings: StepSettings) -> Solution:
        """Minimise Phi of a stage of 1 / inverse_dt [s], ``ahead`` [s] of which friction looks ahead. Raises
        StepFailure where it cannot be said what cloth does to cloth."""
        phi, self.settings = self.potential, settings
        s = self.solution = Solution()
        phi.begin(inverse_dt, ahead)
        self.leaving.begin()
        if ahead > 0.0:
            self._coast(ahead)
        s.residual, progress = self.slope()[0], False
        while True:
            before = phi.value()
            exact = max(s.residual, settings.tolerance) < EXACT_BELOW
            self._assemble(exact)
            self._solve(refresh=s.newton_iterations % REFRESH == 0)
            s.newton_iterations += 1
            if not self._descend(before):
                break
            progress = True
            force = self.way.along(self.linear.b)
            s.residual = self._arrived()
            if ahead == 0.0 and self.way.part == 1.0:
                self._go_further(force)
            if s.residual <= settings.tolerance or not self.leaving.goes_on(s.newton_iterations, settings):
                break
        self.leaving.end()
        s.found = bool(np.isfinite(s.residual) and (progress or s.residual <= settings.tolerance))
        return s

    def _arrived(self) -> float:
        """The residual where the cloth has gone, contact being as stiff as it is there."""
        self.potential.bind()
        return self.slope()[0]

    def _go_further(self, force: float) -> None:
        """Go on along the way, along which the ``force`` was so great [J], where it has hardly become less.

        Cloth that buckles has hardly any stiffness that way, or less than none, while the matrix is made positive:
        direction after direction is the same one and too short by tenfold. How far to go is where the force would be
        zero, were it to go on falling as it did, as far as Phi falls.
        """
        phi, s = self.potential, self.solution
        for _ in range(TIMES):
            left = self.way.along(self.linear.b) / force if force > 0.0 else 0.0
            if not left > HARDLY_LESS or s.residual <= self.settings.tolerance:
                return
            times = min(left / (1.0 - left), FURTHER) if left < 1.0 else FURTHER
            before = phi.value()
            if not self.way.aim(self.way.path, self.settings.longest_move, times):
                return
            if self.layers is not None:
                self.way.keep_apart()
            # all of it, or where it stretches on turning a quarter
            force = self.way.along(self.linear.b)
            went = self._look(1.0) <= before or self._look(0.25) <= before
            if not went:
                self._look(0.0)
            s.residual = self._arrived()
            if not went:
                return

    def state(self) -> dict[str, np.ndarray]:
        """What the next step depends on."""
        return {"coasting_waits": np.array(self.wait), **self.leaving.state()}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``."""
        self.wait = int(state["coasting_waits"])
        self.leaving.restore(state)

    def _coast(self, ahead: float) -> None:
        """Begin at x_hat, where the cloth goes if nothing pulls at it, if Phi is less there: what swings along turns
        so far in a step that the direction from its start leads astray. Where it was of no use, the next do not try."""
        if self.wait > 0:
            self.wait -= 1
            return
        here = self.potential.value()
        share = self.way.toward(self.potential.x_hat, self.potential.free, self.settings.longest_move)
        if share == 0.0:
            return
        if self._look(share) < here:
            self.potential.bind(ahead)
        else:
            self._look(0.0)
            self.wait = WAIT

    def slope(self) -> tuple[float, float]:
        """Take -grad Phi for the right-hand side; see ``Potential.gather``."""
        return self.potential.gather(self.linear.b)

    def compile(self) -> None:
        """Compile every kernel that Newton's method takes, where the cloth is at rest; it stays there."""
        self.potential.value()
        self.potential.assemble(exact=False)
        self.linear.solve(0.5, 1)
        if self.layers is not None:
            self.way.toward(self.potential.x_hat, self.potential.free, 1e-6)
        self.way.aim(self.linear.d, 1e-6)
        if self.layers is not None:
            self.layers.compile(self.linear.b)
        self.way.along(self.linear.b)
        self.way.aim(self.way.path, 1e-6)
        self.way.go(0.0)
        self.way.start()
        self.way.arrive()

    # -- the direction --------------------------------------------------------------------------------------------

    def _assemble(self, exact: bool) -> None:
        self._exact = exact
        self.potential.assemble(exact)

    def _solve(self, refresh: bool) -> None:
        """Newton's direction d from the matrix as it is, or where that is not positive definite from one that is."""
        s = self.settings
        iterations, _ = self.linear.solve(s.linear_tolerance, s.max_linear_iterations, refresh)
        self.solution.linear_iterations += iterations
        if self._exact and self.linear.indefinite[None] == 1:
            self._assemble(exact=False)
            self._solve(refresh=True)

    def _aim(self, longest: float, anew: bool = False) -> bool:
        """Aim along d, where ``anew`` that of the right-hand side as it is now; whether it is finite."""
        if anew:
            self._solve(refresh=True)
        return self.way.aim(self.linear.d, longest)

    # -- the way along it -----------------------------------------------------------------------------------------

    def _descend(self, before: float) -> bool:
        """Go along d from where Phi is ``before``; whether that leads anywhere."""
        longest = self.settings.longest_move
        if not self._aim(longest):
            return False
        if self.layers is None:
            return self._search(before, self.settings.tolerated)
        if guards.stay_apart(self.layers, self.linear, self.clock, longest, self._aim):
            self.way.keep_apart()
            if self._search(before, 0.0):
                return True
        return self._descend_alike(before)

    def _descend_alike(self, before: float) -> bool:
        """Go along Newton's own direction, all of it shortened alike: Phi falls along it, as it need not where each
        vertex has been stopped by itself."""
        with self.clock("contact"):
            # among the pairs on the way last aimed along, which are others
            self.layers.evaluate()
            self.layers.bind()
        self.slope()
        if not self._aim(self.settings.longest_move, anew=True):
            return False
        self.way.keep_apart(alike=True)
        return self._search(before, self.settings.tolerated)

    def _search(self, before: float, tolerated: float) -> bool:
        """Go along the way as far as Phi falls; where it does not at all, stay.

        Where two limbs meet, the body's gap jumps from the one to the other and Phi with it, while d is right for all
        the rest of the cloth: then the shortest share is gone if Phi rises by no more than a ``tolerated`` part of what
        is stored.
        """
        share = 1.0
        # halves, since a parabola through a barrier's wall lets too little be gone
        while not (rise := self._look(share) - before) <= self.rounding * abs(before):
            if share <= LEAST_SHARE:
                break
            share *= 0.5
        else:
            return True
        if rise <= tolerated * self.potential.stored():
            return True
        self._look(0.0)
        return False

    def _look(self, share: float) -> float:
        """Phi at a share of the way."""
        self.way.go(share)
        self.potential.evaluate()
        return self.potential.value()


def _linear(cloth, potential: Potential, preconditioner: str) -> ConjugateGradients:
    """The linear solver for a Cloth as it lies at the start."""
    matrix, nv = potential.matrix, cloth.vertex_count
    if preconditioner == "block_jacobi":
        return ConjugateGradients(matrix, LocalBlocks(matrix, np.arange(nv), 1))
    patch = patches(cloth, patch_count(nv))
    reach = float(np.sqrt(cloth.areas.sum() / (patch.max() + 1)))
    local = LocalBlocks(matrix, blocks(potential.x.to_numpy(), patch, LOCAL_SIZE), LOCAL_SIZE)
    return ConjugateGradients(matrix, local, CoarseSpace(matrix, potential.x, patch, reach))
