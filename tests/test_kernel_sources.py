"""Taichi's memory of the kernels' sources: errors still say where."""

import pytest
import taichi as ti


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
        assert f'File "{__file__}", line 9, in lean' in str(caught.value)
