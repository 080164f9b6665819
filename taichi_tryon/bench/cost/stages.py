"""Time of a step of the hanging sheet, by the module whose kernel runs, and by the kernel.

Taken by Taichi's kernel profiler, in a process of its own; what is left of the wall time is launches, Python and
LAPACK (the coarse space is inverted there). No reference: the greatest share says where to look.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.cost.step import StepCost, measure
from taichi_tryon.bench.record import Record, told

COUNTS = (50, 100)
LONGEST = 8


def records(quick: bool) -> Iterator[Record]:
    """Milliseconds a step: all of it, by module, the rest, and of the longest kernels."""
    for count in COUNTS[:1] if quick else COUNTS:
        yield from of(apart(measure, count, 5, True))


def of(cost: StepCost) -> Iterator[Record]:
    """Records of a profiled step."""
    where, wall = {"vertices": cost.vertices}, cost.wall_s

    def record(what: str, seconds: float) -> Record:
        return told("stages", {**where, "of": what}, "time", "ms a step", 1000 * seconds, wall)

    modules: dict[str, float] = defaultdict(float)
    for name, seconds in cost.kernels.items():
        modules[_module(name)] += seconds
    yield record("all", wall)
    for name, seconds in sorted(modules.items(), key=lambda entry: -entry[1]):
        yield record(name, seconds)
    yield record("launches, Python, LAPACK", wall - sum(modules.values()))
    for name, seconds in list(cost.kernels.items())[:LONGEST]:
        yield record(name.removeprefix("taichi_tryon."), seconds)


def _module(name: str) -> str:
    parts = name.split(".")
    return ".".join(parts[1:3]) if parts[0] == "taichi_tryon" else parts[0]
