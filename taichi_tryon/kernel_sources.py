"""Remembers what Taichi reads of the kernels' sources.

At every call of a ti.func Taichi looks up its source again, and words each expression's place in it, for errors that
never come: without a memory that is half of a warm start. The words stay the same.
"""

from __future__ import annotations

import functools

from taichi.lang import kernel_impl
from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext


@functools.cache
def remember() -> None:
    """Give Taichi its memory; more than once does no harm."""
    for name in ("getsourcefile", "getsourcelines"):
        setattr(kernel_impl, name, functools.cache(getattr(kernel_impl, name)))
    ASTTransformerContext.get_pos_info = _remembering(ASTTransformerContext.get_pos_info)


def _remembering(describe):
    texts: dict[tuple, str] = {}

    def get_pos_info(self, node):
        first, last = (node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset)
        key = (self.file, self.lineno_offset, type(node), first, last)
        text = texts.get(key)
        if text is None:
            text = texts[key] = describe(self, node)
        return text

    return get_pos_info
