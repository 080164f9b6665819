"""What contact of cloth with cloth costs: the time of a step with it over that of one without.

A sheet that falls on a ball, where no cloth meets cloth, and a skirt that is twirled, whose folds touch; both of about
10,000 vertices. Runs with and without take turns, each in a process of its own, and the shortest of each counts. Limits
are our own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.record import Record, absolute, told
from taichi_tryon.bench.skip.course import Course, run

REPEATS = 3


@dataclass(frozen=True)
class Case:
    """``steps`` steps of a scene after some ``before``, with an edge length [mm], and the ratio that is allowed."""

    scene: str
    edge_mm: float
    quick_edge_mm: float
    before: int
    steps: int
    limit: float


CASES = {
    "nothing touches": Case("validation/drop_on_sphere.yaml", 10.101, 20.408, before=2, steps=12, limit=1.3),
    "folds": Case("scenes/skirt_twirl.yaml", 10.5, 24, before=80, steps=12, limit=3.0),
}
WITH, WITHOUT = "contact.layers={}", "contact.layers=null"


def records(quick: bool) -> Iterator[Record]:
    """Both cases."""
    for name, case in CASES.items():
        edge = f"mesh.edge_length_mm={case.quick_edge_mm if quick else case.edge_mm}"
        found: dict[str, list[Course]] = {WITH: [], WITHOUT: []}
        for _ in range(1 if quick else REPEATS):
            for layers, courses in found.items():
                courses.append(apart(run, case.scene, (edge, layers), case.before, case.steps))
        yield from of(name, found[WITH], found[WITHOUT], case.limit)


def of(name: str, layered: list[Course], plain: list[Course], limit: float) -> Iterator[Record]:
    """Records of the runs with layers and without."""
    where = {"cloth": name, "vertices": len(plain[0].positions)}
    wall = sum(course.steps * course.seconds["step"] for course in (*layered, *plain))
    times = [min(course.seconds["step"] for course in courses) for courses in (layered, plain)]
    for which, courses, seconds in zip(("with", "without"), (layered, plain), times, strict=True):
        yield told("layers", where, f"step_{which}", "ms a step", 1000 * seconds, wall)
        yield told("layers", where, f"linear_iterations_{which}", "1", courses[0].linear_iterations, wall)
    yield absolute("layers", where, "with_over_without", "1", times[0] / times[1], 0.0, limit, wall)
