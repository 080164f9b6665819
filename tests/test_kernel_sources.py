"""Taichi's memory of the kernels' sources: errors still say where, and nothing is kept alive."""

import gc
import weakref

import pytest
import taichi as ti
from taichi.lang import kernel_impl


@ti.func
def lean(x):
    return x.no_such_thing


def test_an_error_in_a_kernel_names_its_line_every_time():
    @ti.kernel
    def fall():
        lean(1.0)

    for _ in range(2):
        with pytest.raises(ti.TaichiCompilationError) as caught:
            fall()
        assert "return x.no_such_thing\n" in str(caught.value)
        assert f'File "{__file__}", line 13, in lean' in str(caught.value)


def test_what_a_kernel_holds_is_let_go_with_it():
    class Held:
        """Stands for the fields that a kernel fills."""

    def make(held):
        def kernel():
            return held

        return kernel

    one, other = make(Held()), make(Held())
    held = weakref.ref(one())
    lines = kernel_impl.getsourcelines(one)
    assert lines[0][1].strip() == "return held"
    assert kernel_impl.getsourcelines(other) is lines  # read once
    assert kernel_impl.getsourcefile(one) == __file__
    del one
    gc.collect()
    assert held() is None
