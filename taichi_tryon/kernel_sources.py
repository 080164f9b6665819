"""Lets Taichi read the kernels' sources faster.

At every call of a ti.func Taichi looks up its source again, words each expression's place in it, for errors that never
come, and reads a file to know whether a kernel stands in a class: more than half of a warm start. Here sources are
looked up once, a place is a line, and a class is known by its frame.
"""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Callable

from taichi.lang import kernel_impl
from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext


@functools.cache
def read_faster() -> None:
    """Teach Taichi; more than once does no harm."""
    for name in ("getsourcefile", "getsourcelines"):
        setattr(kernel_impl, name, _once(getattr(kernel_impl, name)))
    ASTTransformerContext.get_pos_info = _place
    kernel_impl._inside_class = _inside_class


def _once(look_up: Callable) -> Callable:
    """A look-up that remembers what it found by a function's code, which unlike the function keeps no fields alive.

    Codes are equal wherever they stand at the same line, hence the file.
    """
    known = {}

    def found(function):
        code = inspect.unwrap(function).__code__
        key = code.co_filename, code
        if key not in known:
            known[key] = look_up(function)
        return known[key]

    return found


def _place(context, node) -> str:
    """File, line and source of a piece of a kernel, as errors quote them."""
    where = f'File "{context.file}", line {node.lineno + context.lineno_offset}, in {context.func.func.__name__}:'
    return f"{where}\n{context.src[node.lineno - 1]}\n"


def _inside_class(level_of_class_stackframe: int) -> bool:
    """Whether the frame below the one so many levels up is a class's body, which alone has a qualified name."""
    return "__qualname__" in sys._getframe(level_of_class_stackframe - 1).f_locals
