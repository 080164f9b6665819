"""Time integration schemes, each a row of stages of one form, so that every stage is an incremental potential.

A stage of the step from t_n to t_n + dt ends at t_n + end dt and solves

    x = x_ref + H v,   v = v_ref + H a,   M a = f(x, v),                                H   = h dt,
    x_ref = x_n + ahead dt v_n + beyond (x_s - x_n),    v_ref = v_n + ahead dt a_n + beyond (v_s - v_n),

s being the stage before; the last stage is the end of the step. Eliminated, that is the minimum of
|x - x_ref - H v_ref|_M^2 / (2 H^2) + E(x): a backward Euler step of length H from another start. Strain rates follow
the same formula, so internal friction is as exact as the motion. All schemes are L-stable and stiffly accurate.

The local error of a step is estimated by dt |sum_k error_k v_k| over the velocities v_n, v_s, v_(n+1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Stage:
    """One implicit solve; see the module for what the shares of dt mean."""

    h: float
    end: float = 1.0
    ahead: float = 0.0
    beyond: float = 0.0


@dataclass(frozen=True)
class Scheme:
    """Stages of a step, its order, and the weights of v_n, v_s, v_(n+1) in the estimate of the local error."""

    stages: tuple[Stage, ...]
    order: int
    error: tuple[float, float, float]

    @property
    def needs_acceleration(self) -> bool:
        """Whether a step begins with the acceleration at which the last one ended."""
        return self.stages[0].ahead > 0

    def change(self, error: float, limit: float) -> float:
        """Factor to the length of the step that leads from a local ``error`` to the ``limit``; infinite: to no limit
        (Hairer, Norsett, Wanner 1993, Solving Ordinary Differential Equations I, eq. II.4.13)."""
        exact = (limit / max(error, 1e-30)) ** (1 / (self.order + 1))
        return min(GROW, max(LEAST, SAFETY * exact))


# bounds of the change of a step's length, part of the exact length that is taken, and of one where no solution is found
LEAST, GROW, SAFETY, FAILED = 0.2, 1.5, 0.9, 0.5


def _second_difference(c: float, size: float) -> tuple[float, float, float]:
    """Weights at the times 0, c, 1 of ``size`` times the second divided difference."""
    return size / c, -size / (c * (1 - c)), size / (1 - c)


# first order: x_(n+1) - x_n - dt v_(n+1) = -dt^2 a / 2
BACKWARD_EULER = Scheme((Stage(1.0),), order=1, error=(-0.5, 0.0, 0.5))

# Trapezoidal rule to t_n + GAMMA dt, then BDF2 to the end. Bank, Coughran, Fichtner, Grosse, Rose, Smith 1985,
# "Transient simulation of silicon devices and circuits"; this GAMMA gives both stages the same H and L-stability, and
# K dt^3 x''' is the local error (their eq. 29; Hosea and Shampine 1996, "Analysis and implementation of TR-BDF2").
GAMMA = 2 - math.sqrt(2)
K = (3 * GAMMA**2 - 4 * GAMMA + 2) / (12 * (2 - GAMMA))
TR_BDF2 = Scheme(
    (
        Stage(h=GAMMA / 2, end=GAMMA, ahead=GAMMA / 2),
        Stage(h=GAMMA / 2, beyond=1 / (GAMMA * (2 - GAMMA))),
    ),
    order=2,
    error=_second_difference(GAMMA, 2 * K),
)

# A step that knows no acceleration to start with (the first one, or after steps without inertia) takes two backward
# Euler-like stages of the same H, with the same stability function: Alexander 1977, "Diagonally implicit Runge-Kutta
# methods for stiff ODEs". Its first stage is of order 1, hence the other size of the second difference.
_C = GAMMA / 2
STARTING = Scheme(
    (Stage(h=_C, end=_C), Stage(h=_C, beyond=(1 - _C) / _C)),
    order=2,
    error=_second_difference(_C, K * 2 * (1 - _C) / (1 - 2 * _C)),
)

SCHEMES = {"backward_euler": BACKWARD_EULER, "tr_bdf2": TR_BDF2}
