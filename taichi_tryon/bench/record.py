"""One figure of a suite, held against its reference."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Record:
    """A ``quantity`` in its ``unit`` that came out as ``value`` where ``reference`` is right.

    ``limit`` bounds ``error_percent`` where there is one, else |value - reference| in the unit; without a reference the
    value shall reach it. None: not judged.
    """

    case: str
    parameters: Mapping[str, float | str]
    quantity: str
    unit: str
    value: float
    reference: float | None
    error_percent: float | None
    limit: float | None
    passes: bool
    wall_s: float


def relative(case, parameters, quantity, unit, value, reference, limit, wall_s) -> Record:
    """A value whose error is a share of the reference; ``limit`` [%]."""
    error = 100 * (value / reference - 1)
    passes = limit is None or abs(error) <= limit
    return Record(case, parameters, quantity, unit, float(value), float(reference), float(error), limit, bool(passes),
                  wall_s)  # fmt: skip


def absolute(case, parameters, quantity, unit, value, reference, limit, wall_s) -> Record:
    """A value that may differ from the reference by ``limit`` in its unit."""
    passes = limit is None or abs(value - reference) <= limit
    return Record(case, parameters, quantity, unit, float(value), float(reference), None, limit, bool(passes), wall_s)


def at_least(case, parameters, quantity, unit, value, limit, wall_s) -> Record:
    """A value that shall reach ``limit``."""
    return Record(case, parameters, quantity, unit, float(value), None, None, limit, bool(value >= limit), wall_s)


def told(case, parameters, quantity, unit, value, wall_s) -> Record:
    """A value that is not judged."""
    return Record(case, parameters, quantity, unit, float(value), None, None, None, True, wall_s)


def counted(case, counts, none_of, wall_s) -> Iterator[Record]:
    """What was counted, of which there shall be ``none_of`` some."""
    for quantity, count in counts.items():
        if quantity in none_of:
            yield absolute(case, {}, quantity, "1", count, 0, 0, wall_s)
        else:
            yield told(case, {}, quantity, "1", count, wall_s)
