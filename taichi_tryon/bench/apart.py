"""Calling a function in a process of its own, so that nothing an earlier one left behind counts."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import TypeVar

from taichi_tryon.errors import RunError

Result = TypeVar("Result")


def apart(function: Callable[..., Result], *arguments) -> Result:
    """``function(*arguments)`` in a fresh process: Taichi has not been started there, and its memory is its own.

    Function, arguments and result are pickled. What it raises is raised here; RunError where the process dies.
    """
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        try:
            return pool.submit(function, *arguments).result()
        except BrokenProcessPool as fault:
            raise RunError(f"{function.__qualname__}: its process ended without a result") from fault
