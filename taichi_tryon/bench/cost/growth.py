"""How time a step, iterations of the linear solver and memory grow with the vertices of the hanging sheet.

Time: the exponent of the power of the number of vertices that fits best. Memory: resident size beyond that of Taichi
without the scene, and what a further vertex takes between the smallest and the largest sheet: compiling, which all
sizes have alike, is no memory of vertices. Limits are our own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.cost.step import StepCost, measure
from taichi_tryon.bench.record import Record, absolute, told

COUNTS = (50, 100, 200, 400)
EXPONENT, ITERATIONS, MEMORY = 1.15, 2.0, 4.0
# between the first and the last of which iterations may grow so much [vertices]
FROM, TO = 2_500, 40_000


def records(quick: bool) -> Iterator[Record]:
    """Each size, and how they compare."""
    yield from of([apart(measure, count) for count in ((25, 50, 100) if quick else COUNTS)])


def of(costs: Sequence[StepCost]) -> Iterator[Record]:
    """Records of steps on ever larger sheets."""
    for cost in costs:
        where = {"vertices": cost.vertices}
        for name, unit, value in (
            ("wall_time", "ms a step", 1000 * cost.wall_s),
            ("cpu_time", "ms a step", 1000 * cost.cpu_s),
            ("newton_iterations", "a step", cost.newton_iterations),
            ("linear_iterations", "a Newton iteration", cost.linear_iterations),
            ("memory", "kB a vertex", cost.memory / cost.vertices / 1000),
        ):
            yield told("growth", where, name, unit, value, cost.wall_s)
    first, last = costs[0], costs[-1]
    where, wall = {"from": first.vertices, "to": last.vertices}, sum(cost.wall_s for cost in costs)
    exponent = np.polyfit(*np.log([(cost.vertices, cost.wall_s) for cost in costs]).T, 1)[0]
    yield absolute("growth", where, "exponent_of_time", "1", exponent, 0.0, EXPONENT, wall)
    further = (last.memory - first.memory) / (last.vertices - first.vertices) / 1000
    yield absolute("growth", where, "memory_of_a_further_vertex", "kB", further, 0.0, MEMORY, wall)
    few, many = (min(costs, key=lambda cost: abs(cost.vertices - size)) for size in (FROM, TO))
    where = {"from": few.vertices, "to": many.vertices}
    times = many.linear_iterations / few.linear_iterations
    yield absolute("growth", where, "linear_iterations_times", "1", times, 0.0, ITERATIONS, wall)
