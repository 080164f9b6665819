"""Which balls of a body can matter to the cloth: those that reach into a box around it.

A ball whose density ends outside the box adds nothing to any sum within: leaving it out changes no bit of an answer.
The box holds all points where the body has been asked for, and grows before it is asked elsewhere.
"""

from __future__ import annotations

import numpy as np

from taichi_tryon.body.model import Balls

SPARE = 0.05
"""The box grows by so much more [m] than it must, so that it grows rarely."""


class Reach:
    """A box from ``low`` to ``high`` (3,) [m] that only grows; empty at first, or without bounds where ``everywhere``.

    ``walk`` [m]: an answer for a point asks the body no further from it.
    """

    def __init__(self, walk: float, everywhere: bool = False):
        self.walk = walk
        self.high = np.full(3, np.inf if everywhere else -np.inf)
        self.low = -self.high

    def hold(self, low: np.ndarray, high: np.ndarray) -> bool:
        """Hold all that is asked from ``low`` to ``high`` (3,) [m]; whether the box has grown."""
        if (low - self.walk >= self.low).all() and (high + self.walk <= self.high).all():
            return False
        more = self.walk + SPARE
        # what is not a number is nowhere
        self.low, self.high = np.fmin(self.low, low - more), np.fmax(self.high, high + more)
        return True

    def meets(self, balls: Balls) -> np.ndarray:
        """(n,) bool: the balls that may reach into the box."""
        low, high = balls.centers - balls.extents, balls.centers + balls.extents
        return ((low <= self.high) & (high >= self.low)).all(axis=1)
