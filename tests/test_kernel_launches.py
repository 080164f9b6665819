"""The short way to a kernel ends where Taichi's own does, for every kind of argument, and is forgotten on a restart."""

import gc
import subprocess
import sys
import weakref

import numpy as np
import pytest
import taichi as ti
from taichi.lang.kernel_impl import Kernel


@ti.data_oriented
class Board:
    def __init__(self, size):
        self.x = ti.field(float, shape=size)
        self.size = size

    @ti.kernel
    def add(self, scale: float, shift: int):
        for i in range(self.size):
            self.x[i] = scale * i + shift

    @ti.kernel
    def write(self, values: ti.types.ndarray(), scale: float):
        for i in range(self.size):
            values[i] = scale * self.x[i]

    @ti.kernel
    def put(self, field: ti.template(), value: float):
        for i in field:
            field[i] = value

    @ti.kernel
    def total(self) -> float:
        result = 0.0
        for i in range(self.size):
            result += self.x[i]
        return result


@pytest.fixture
def board():
    return Board(5)


@pytest.fixture
def looked_up(monkeypatch):
    """How often Taichi looked up what a kernel's arguments ask for."""
    calls, real = [], Kernel.ensure_compiled
    monkeypatch.setattr(Kernel, "ensure_compiled", lambda kernel, *args: calls.append(kernel) or real(kernel, *args))
    return calls


def test_numbers_may_differ_from_launch_to_launch(board, looked_up):
    board.add(1.0, 2)
    looked_up.clear()
    for scale, shift in ((1.0, 2), (0.5, -7), (np.float64(3.0), np.int64(4)), (2, 0)):
        board.add(scale, shift)
        launches = len(looked_up)
        assert board.x.to_numpy() == pytest.approx(scale * np.arange(5) + shift)
        assert not any(kernel.func.__name__ == "add" for kernel in looked_up[:launches])


def test_arrays_may_differ_and_those_of_another_type_go_another_way(board, looked_up):
    board.add(1.0, 0)
    for dtype in (np.float64, np.float32, np.int32, np.float64, np.float32):
        values = np.zeros(5, dtype)
        board.write(values, 2.0)
        assert np.array_equal(values, 2 * np.arange(5))
    ways = [kernel for kernel in looked_up if kernel.func.__name__ == "write"]
    looked_up.clear()
    board.write(np.zeros(7), 1.0)
    assert len(ways) >= 3 and not looked_up


def test_an_array_that_is_not_contiguous_is_refused_every_time(board):
    board.write(np.zeros(5), 1.0)
    for _ in range(2):
        with pytest.raises(ValueError, match="contiguous"):
            board.write(np.zeros((5, 2))[:, 0], 1.0)


def test_each_object_and_field_has_its_own_way(board):
    other, third = Board(3), ti.field(float, shape=2)
    for value in (1.0, 2.0, 3.0):
        board.put(board.x, value)
        board.put(third, -value)
        other.add(0.0, 9)
        assert (board.x.to_numpy() == value).all() and (third.to_numpy() == -value).all()
        assert (other.x.to_numpy() == 9).all()


def test_a_kernel_that_returns_something_does_so_every_time(board):
    for shift in (0, 1, 2):
        board.add(0.0, shift)
        assert board.total() == 5 * shift


def test_an_object_is_not_kept_alive():
    board = Board(4)
    for _ in range(2):
        board.add(1.0, 1)
    alive = weakref.ref(board)
    del board
    gc.collect()
    assert alive() is None


def test_a_restart_forgets_every_way():
    code = (
        "import numpy as np, taichi as ti\n"
        "from taichi_tryon import runtime\n"
        "from tests.test_kernel_launches import Board\n"
        "for precision in ('f64', 'f32', 'f64'):\n"
        "    runtime.start('cpu', precision, 1, offline_cache=False)\n"
        "    board = Board(5)\n"
        "    for shift in (1, 2, 3):\n"
        "        board.add(1.0, shift)\n"
        "        print(board.x.to_numpy().sum())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert [float(line) for line in done.stdout.split()] == [15.0, 20.0, 25.0] * 3
