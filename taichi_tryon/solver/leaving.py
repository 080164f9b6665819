"""Whether a step goes on beyond its Newton iterations, since it would end with cloth in the body.

What is pressed hard on the skin may stay a little in it however long one goes on. Where that was so, the next steps do
not go on for what is as deep as that.
"""

import numpy as np

from taichi_tryon.solver.settings import StepSettings

# what is still this part as deep in the body has not come out
STUCK = 0.9
# iterations in which it comes out by as much, or is stuck
PATIENCE = 10
# so many times as deep as what is stuck: it is something else
DEEPER = 2.0
# what is deeper is not left to wait [m]
LITTLE = 1e-4
# steps, or stages of one, after which what was stuck is tried again
WAIT = 7


class Leaving:
    """How cloth leaves the body that a BodyContact ``contact`` is with."""

    def __init__(self, contact):
        self.contact = contact
        # depth [m] at which cloth is stuck, and for how many steps that is believed
        self.stuck, self.wait = 0.0, 0
        # how deep cloth was where the stage went on, the least it has been, and the last that was a way out with the
        # iteration at which it was found
        self._first, self._least, self._last, self._at = None, np.inf, np.inf, 0

    def begin(self) -> None:
        """A stage of a step begins."""
        self.wait = max(self.wait - 1, 0)
        if self.wait == 0:
            self.stuck = 0.0
        self._first, self._least, self._last, self._at = None, np.inf, np.inf, 0

    def goes_on(self, iterations: int, settings: StepSettings) -> bool:
        """Whether a stage that has taken so many iterations takes one more."""
        if iterations < settings.max_newton_iterations:
            return True
        inside = self.contact.inside
        goes = iterations < settings.max_newton_inside and inside > min(DEEPER * self.stuck, LITTLE)
        if goes and self._first is None:
            self._first = inside
        self._least = min(self._least, inside)
        if inside <= STUCK * self._last:
            self._last, self._at = inside, iterations
        return goes and iterations - self._at < PATIENCE

    def end(self) -> None:
        """The stage is over."""
        if self._first is not None and self._least > STUCK * self._first:
            self.stuck, self.wait = self._least, WAIT + 1

    def state(self) -> dict[str, np.ndarray]:
        """What the next step depends on."""
        return {"stuck": np.array(self.stuck), "stuck_waits": np.array(self.wait)}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a ``state``."""
        self.stuck, self.wait = float(state["stuck"]), int(state["stuck_waits"])
