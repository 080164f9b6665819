"""The body of a scene that has none: nothing is near anywhere."""

import numpy as np
import taichi as ti

from taichi_tryon.body.density import FAR


@ti.data_oriented
class AbsentField:
    """Answers as ``BodyField`` does where no ball reaches."""

    present, everywhere = False, True
    rests, moves, placed, travelled = True, False, 0, 0.0

    def set_pose(self, transforms: np.ndarray, previous_transforms: np.ndarray | None = None) -> None:
        """There is nothing to move."""

    @ti.func
    def density(self, x) -> float:
        return 0.0

    @ti.func
    def gap(self, x):
        return ti.cast(FAR, float), ti.Vector.zero(float, 3), 0

    @ti.func
    def gap_within(self, x, band, only):
        return ti.cast(FAR, float), ti.Vector.zero(float, 3), 0, ti.cast(0.0, float)

    @ti.func
    def beside(self, x, group):
        return group, ti.cast(0.0, float)

    @ti.func
    def clearance(self, density) -> float:
        return ti.math.inf

    @ti.func
    def motion(self, x, winner):
        return ti.Vector.zero(float, 3)
