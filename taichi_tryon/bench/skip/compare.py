"""A scene with a skip and without it: time of each, and how far the two results lie apart."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.record import Record, absolute, told
from taichi_tryon.bench.skip.course import Course, run

REPEATS = 3
"""Runs of each, of which the shortest counts: in turn, as the machine's speed changes."""


@dataclass(frozen=True)
class Trial:
    """``steps`` steps of a scene after some ``before``, with a skip and ``without`` it.

    overrides: values set in both; fine: those that only the whole suite sets. limit_mm: how far any vertex may lie from
    where it lies without the skip. stage: the one in which the skip saves, beside the whole step.
    """

    case: str
    scene: str
    without: tuple[str, ...]
    overrides: tuple[str, ...] = ()
    fine: tuple[str, ...] = ()
    before: int = 2
    steps: int = 12
    limit_mm: float = 0.0
    stage: str = "contact"


def compared(trial: Trial, quick: bool) -> Iterator[Record]:
    """Run a trial both ways and say how they compare."""
    overrides = trial.overrides + (() if quick else trial.fine)
    found: dict[str, list[Course]] = {"with": [], "without": []}
    for _ in range(1 if quick else REPEATS):
        for name, more in (("with", ()), ("without", trial.without)):
            found[name].append(apart(run, trial.scene, overrides + more, trial.before, trial.steps))
    yield from of(trial, found["with"], found["without"])


def of(trial: Trial, skipping: list[Course], without: list[Course]) -> Iterator[Record]:
    """Records of the runs with and without the skip; of counts, those that differ."""
    one, other = skipping[0], without[0]
    where, wall = {"vertices": len(one.positions)}, sum(c.steps * c.seconds["step"] for c in (*skipping, *without))

    def record(quantity: str, unit: str, value: float) -> Record:
        return told(trial.case, where, quantity, unit, value, wall)

    for stage in ("step", trial.stage):
        times = [min(course.seconds[stage] for course in courses) for courses in (skipping, without)]
        yield record(f"{stage}_with", "ms a step", 1000 * times[0])
        yield record(f"{stage}_without", "ms a step", 1000 * times[1])
        yield record(f"{stage}_with_over_without", "1", times[0] / max(times[1], 1e-9))
    for quantity, unit, count in _COUNTS:
        if count(one) != count(other):
            yield record(f"{quantity}_with", unit, count(one))
            yield record(f"{quantity}_without", unit, count(other))
    distance = 1000 * np.linalg.norm(one.positions - other.positions, axis=1).max()
    yield absolute(trial.case, where, "distance_of_results", "mm", distance, 0.0, trial.limit_mm, wall)


_COUNTS: tuple[tuple[str, str, Callable[[Course], float]], ...] = (
    ("kernels", "1", lambda course: course.kernels),
    ("looks_at_the_body", "% of samples", lambda course: 100 * course.looks / max(course.chances, 1)),
    ("balls_listed", "1", lambda course: course.balls[0]),
    ("linear_iterations", "1", lambda course: course.linear_iterations),
)
