"""What a step may cost and how exact it is, and how it went."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StepSettings:
    """What a step may cost and how exact it is.

    tolerance: out-of-balance force of the step relative to the weight, 2-norms. linear_tolerance: preconditioned
    residual of the linear solve. longest_move [m]: no vertex goes further in one Newton iteration, so that nothing
    jumps through a limb. tolerated: part of the stored energy by which the potential may rise where it jumps.
    max_newton_inside: iterations at most while cloth is in the body, if they are more.
    """

    tolerance: float
    max_newton_iterations: int
    linear_tolerance: float
    max_linear_iterations: int
    longest_move: float
    preconditioner: str = "coarse"
    scheme: str = "backward_euler"
    tolerated: float = 0.01
    max_newton_inside: int = 0

    @property
    def puts_out(self) -> bool:
        """Whether what a step would leave in the body, between the samples of contact, too, is put out at its end."""
        return self.max_newton_inside > self.max_newton_iterations


@dataclass(frozen=True)
class StepResult:
    """How a step went. ``residual`` is the out-of-balance force over the weight that was left; ``moved`` [m] the
    farthest that any vertex went; ``error`` [m] the estimated local error, where it was limited, and ``change``
    the factor to the length of the step that is advised for the next one, or for another attempt; ``reason`` says why
    it failed, where it is more than that no positions of less energy were found."""

    accepted: bool
    newton_iterations: int
    linear_iterations: int
    residual: float
    moved: float
    error: float
    change: float
    reason: str = ""
