"""The product of the step's matrix with a vector, against what the machine's memory can do.

Reference: a triad a = b + s c over fields far larger than the cache, in the same Taichi (McCalpin 1995, "Memory
bandwidth and machine balance in current high performance computers"). The product's bytes are counted once each: blocks
and their columns, the diagonal, and of each vertex the vector, the product and its freedom. The limit is our own.
"""

import time
from collections.abc import Iterator

import taichi as ti

from taichi_tryon import runtime
from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.pareto.hang import problem
from taichi_tryon.bench.pareto.ours import Setting, scene_of
from taichi_tryon.bench.record import Record, at_least, told
from taichi_tryon.kernel_loops import shared
from taichi_tryon.setup import prepare
from taichi_tryon.simulation import Simulation
from taichi_tryon.timing import Stopwatch

COUNT, QUICK_COUNT = 200, 100
LENGTH = 1 << 24
"""Numbers in each field of the triad."""
SHARE = 60.0
REPEATS = 100
BLOCK, INDEX, VECTOR = 9 * 4, 4, 3 * 8
"""Bytes of a 3x3 block in single precision, of a column, of a vector in double precision."""


def records(quick: bool) -> Iterator[Record]:
    """The triad, the product, and their ratio."""
    yield from apart(measured, QUICK_COUNT if quick else COUNT, LENGTH)


def measured(count: int, length: int) -> list[Record]:
    """Start Taichi, and measure both."""
    runtime.start("cpu")
    return list(of(count, length))


def of(count: int, length: int) -> Iterator[Record]:
    """The same; Taichi runs already."""
    memory = 3 * 8 * length / shortest(triad(length))
    scene = scene_of(problem(count, "table1", 10.0), Setting(""))
    clock = Stopwatch()
    matrix = Simulation(prepare(scene, clock), clock).stepper.potential.matrix
    seconds = shortest(product(matrix))
    blocks, vertices = matrix.block.shape[0], matrix.nv
    moved = blocks * (BLOCK + INDEX) + vertices * (BLOCK + INDEX + 3 * VECTOR)
    operations = 2 * 9 * (blocks + vertices)
    where = {"vertices": vertices}
    yield told("bandwidth", {"numbers": length}, "triad", "GB/s", memory / 1e9, seconds)
    yield told("bandwidth", where, "product_time", "ms", 1e3 * seconds, seconds)
    yield told("bandwidth", where, "product_bytes", "MB", moved / 1e6, seconds)
    yield told("bandwidth", where, "product_operations", "Gflop/s", operations / seconds / 1e9, seconds)
    yield told("bandwidth", where, "product_bandwidth", "GB/s", moved / seconds / 1e9, seconds)
    share = 100 * moved / seconds / memory
    yield at_least("bandwidth", where, "share_of_triad", "%", share, SHARE, seconds)


def shortest(run) -> float:
    """Seconds of the shortest of REPEATS runs, after one that compiles."""
    run()
    times = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        run()
        ti.sync()
        times.append(time.perf_counter() - begin)
    return min(times)


def triad(length: int):
    """A kernel that reads two fields of so many numbers and writes a third."""
    a, b, c = (ti.field(ti.f64, shape=length) for _ in range(3))

    @ti.kernel
    @shared
    def run():
        for i in range(length):
            a[i] = b[i] + 3.0 * c[i]

    return run


def product(matrix):
    """A kernel that multiplies a vector with the matrix once."""
    x, y = (ti.Vector.field(4, ti.f32, shape=matrix.nv) for _ in range(2))

    @ti.kernel
    @shared
    def run():
        for i in range(matrix.nv):
            y[i] = matrix.row_product(i, x)

    return run
