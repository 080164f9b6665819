"""What a step of the hanging sheet costs, measured in a process of its own."""

from __future__ import annotations

import time
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import taichi as ti

from taichi_tryon import runtime
from taichi_tryon.bench.pareto.hang import problem
from taichi_tryon.bench.pareto.ours import Setting, scene_of
from taichi_tryon.errors import RunError
from taichi_tryon.setup import prepare
from taichi_tryon.simulation import Simulation
from taichi_tryon.timing import Stopwatch

BEFORE, TIMED = 8, 5
"""Steps of 1/60 s in which the sheet begins to swing, and those that are timed."""


@dataclass(frozen=True)
class StepCost:
    """A step's mean: wall and CPU time [s], Newton iterations, and conjugate-gradient iterations of one of those.

    memory: greatest resident size [B] beyond that of Taichi without the scene. kernels: seconds in each, by
    ``module.Class.method``, where profiled.
    """

    vertices: int
    wall_s: float
    cpu_s: float
    newton_iterations: float
    linear_iterations: float
    memory: int
    kernels: dict[str, float]


def measure(count: int, timed: int = TIMED, profile: bool = False) -> StepCost:
    """Start Taichi, and let a sheet of ``count`` x ``count`` vertices swing."""
    runtime.start("cpu", profile=profile)
    return swing(count, timed, profile)


def swing(count: int, timed: int = TIMED, profile: bool = False) -> StepCost:
    """The same; Taichi runs already, with its profiler where that is asked for."""
    empty = resident()
    scene = scene_of(problem(count, "table1", 10.0), Setting(""))
    clock = Stopwatch()
    simulation = Simulation(prepare(scene, clock), clock)
    for _ in range(BEFORE):
        simulation.advance()
    p = simulation.progress
    newton, linear = p.newton_iterations, p.linear_iterations
    if profile:
        ti.profiler.clear_kernel_profiler_info()
    cpu_begin, begin = time.process_time(), time.perf_counter()
    for _ in range(timed):
        simulation.advance()
    wall, cpu = (time.perf_counter() - begin) / timed, (time.process_time() - cpu_begin) / timed
    newton, linear = p.newton_iterations - newton, p.linear_iterations - linear
    kernels = {name: seconds / timed for name, seconds in profiled().items()} if profile else {}
    return StepCost(count**2, wall, cpu, newton / timed, linear / newton, resident() - empty, kernels)


def profiled() -> dict[str, float]:
    """Seconds spent in each kernel since the profiler was last cleared, the longest first."""
    from taichi.profiler.kernel_profiler import get_default_kernel_profiler

    ti.sync()
    profiler = get_default_kernel_profiler()
    profiler._update_records()  # Taichi prints them, but does not hand them out
    # a task is called method_cNUMBER_...; several kernels have one method's name
    names = {
        f"{kernel.func.__name__}_c{kernel.kernel_counter}": f"{kernel.func.__module__}.{kernel.func.__qualname__}"
        for kernel in ti.lang.impl.get_runtime().kernels
    }
    seconds: dict[str, float] = defaultdict(float)
    for record in profiler._traced_records:
        method, _, rest = record.name.rpartition("_kernel_")[0].rpartition("_c")
        seconds[names.get(f"{method}_c{rest.split('_')[0]}", "taichi")] += record.kernel_time / 1000
    return dict(sorted(seconds.items(), key=lambda entry: -entry[1]))


def resident() -> int:
    """Greatest resident size [B] of this process so far. Raises RunError where the system has no /proc."""
    try:
        status = Path("/proc/self/status").read_text()
    except OSError as fault:
        raise RunError(f"memory is read from /proc/self/status: {fault.strerror}") from fault
    return 1024 * int(status.split("VmHWM:")[1].split()[0])
