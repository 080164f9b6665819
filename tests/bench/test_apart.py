"""A function in a process of its own."""

import math
import os

import pytest

from taichi_tryon.bench.apart import apart
from taichi_tryon.errors import RunError


def test_it_runs_elsewhere_and_gives_its_result():
    assert apart(os.getpid) != os.getpid()


def test_what_it_raises_is_raised_here():
    with pytest.raises(ValueError, match="math domain"):
        apart(math.log, -1.0)


def test_a_process_that_dies_is_a_failed_run():
    with pytest.raises(RunError, match="_exit: its process ended without a result"):
        apart(os._exit, 1)
