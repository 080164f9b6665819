"""Errors a user can make or meet: each is one clear line per fault, and carries the exit code of the command line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

LONGEST = 900
"""Characters of a message on input."""


class TryonError(Exception):
    """Anything the user should read as a plain message, never as a traceback."""

    exit_code = 3


class InputError(TryonError):
    """The input is at fault: nothing has been computed or written.

    ``faults`` holds one line each, ``file:line:column: field: what is wrong and what is allowed`` where the place
    is known. What was found only while building tells by the keys of ``at`` where in its part it stands; who read the
    files puts their names to it.
    """

    exit_code = 2

    def __init__(self, *faults: str, at: tuple[str | int, ...] = ()):
        self.faults, self.at = tuple(_one_line(fault) for fault in faults), at
        super().__init__("\n".join(self.faults))


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


def _one_line(text: str) -> str:
    """Names and values that messages quote may hold line breaks and commands to the terminal, and may be long."""
    text = text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."
    return text if text.isprintable() else "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


@contextmanager
def below(*keys: str | int) -> Iterator[None]:
    """Input at fault in here stands below these keys."""
    try:
        yield
    except InputError as error:
        error.at = (*keys, *error.at)
        raise
