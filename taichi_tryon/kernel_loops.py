"""Lets the loops of kernels run on the thread that launches them.

Taichi hands every loop to a pool of threads and sleeps until they are through, even where the pool is one thread: on a
machine that has nothing else to do, 0.1 ms until a core is awake, as long as a loop over thousands of vertices takes.
Here a kernel's loops stay on the thread that launches it, unless they are marked as worth being handed over. What comes
out is the same, to the bit: no loop's result depends on who does what.
"""

from __future__ import annotations

import functools

from taichi.lang.ast.ast_transformer import ASTTransformer

# a cloth of fewer vertices is dealt with faster by one thread than by several
FEW = 2200


class _State:
    """What kernels that are compiled from now on hand over: everything, as a GPU needs; else what is marked, to threads
    if there are ``several``, and if there are ``many`` vertices."""

    everything, several, many = True, True, True


def shared(kernel):
    """Marks a function that becomes a kernel: its loops are worth being handed to all threads."""
    kernel.shared = True
    return kernel


def shared_if_many(kernel):
    """The same, where the cloth has many vertices."""
    kernel.shared_if_many = True
    return kernel


def started(everything: bool, threads: int) -> None:
    """Taichi has been started with so many threads; ``everything`` is handed over."""
    _State.everything, _State.several, _State.many = everything, threads > 1, True


def compile_for(vertices: int) -> None:
    """Kernels that are compiled from now on deal with a cloth of so many vertices."""
    _State.many = vertices >= FEW


def several_threads() -> bool:
    """Whether what is shared if there are many vertices is, from now on."""
    return _State.everything or (_State.several and _State.many)


@functools.cache
def stay_on_the_thread() -> None:
    """Teach Taichi; more than once does no harm."""
    for kind in ("build_range_for", "build_ndrange_for"):
        setattr(ASTTransformer, kind, staticmethod(_staying(getattr(ASTTransformer, kind))))


def _staying(build):
    def build_loop(context, node):
        outermost = context.is_kernel and all(scope.is_static for scope in context.loop_scopes[:-1])
        if outermost and not _handed_over(context.func.func):
            context.ast_builder.strictly_serialize()
        return build(context, node)

    return build_loop


def _handed_over(kernel) -> bool:
    if _State.everything or not _State.several:
        return _State.everything
    return hasattr(kernel, "shared") or (_State.many and hasattr(kernel, "shared_if_many"))
