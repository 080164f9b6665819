"""Assembling again what never changes, to measure what it saves that a run does not."""

import taichi as ti

from taichi_tryon.kernel_loops import shared_if_many


@ti.data_oriented
class ConstantBlocks:
    """The blocks of a Matrix that a constant bending law alone has; they are filled when it is made."""

    def __init__(self, matrix):
        self.matrix, self.bending = matrix, matrix.bending

    def assemble(self):
        """Fill them from the law."""
        if self.bending.constant:
            self._assemble()

    @ti.kernel
    @shared_if_many
    def _assemble(self):
        for i in range(self.matrix.nv):
            for n in range(self.matrix.far_start[i], self.matrix.far_start[i + 1]):
                for m in range(self.bending.row_start[i], self.bending.row_start[i + 1]):
                    if self.bending.column[m] == self.matrix.far_column[n]:
                        self.matrix.far_value[n] = self.bending.value[m]
