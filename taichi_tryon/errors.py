"""Errors a user can make or meet: each is one clear line per fault, and carries the exit code of the command line."""

from __future__ import annotations


class TryonError(Exception):
    """Anything the user should read as a plain message, never as a traceback."""

    exit_code = 3


class InputError(TryonError):
    """The input is at fault: nothing has been computed or written.

    ``faults`` holds one line each, ``file:line:column: field: what is wrong and what is allowed`` where the place
    is known.
    """

    exit_code = 2

    def __init__(self, *faults: str):
        super().__init__("\n".join(faults))
        self.faults = faults


class PatternError(InputError):
    """A pattern cannot be sewn or meshed; the message names pattern, panel and edge or seam."""


class DressingError(InputError):
    """A garment cannot be laid around the body; the message names panel and disk."""


class RunError(TryonError):
    """The simulation could not go on; everything computed before is kept."""


class NoStep(RunError):
    """No step could be done, however short."""


class StepFailure(RunError):
    """A step could not be done; a shorter one may be."""


class Interrupted(TryonError):
    """The user stopped the run; it can be resumed."""

    exit_code = 130
