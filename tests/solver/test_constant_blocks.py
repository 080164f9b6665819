"""Assembling what never changes puts there what was there."""

import numpy as np

from taichi_tryon.cloth.model import Cloth
from taichi_tryon.solver.implicit import ImplicitStep
from taichi_tryon.timing import Stopwatch


def test_the_blocks_are_those_of_the_law(sheet, moduli, level, floor_and_ball_field, contact, settings):
    cloth = Cloth.join([(sheet, moduli)], "constant")
    laws = (contact.stiffness, contact.thickness, contact.friction)
    step = ImplicitStep(cloth, floor_and_ball_field, level(5.0), laws, np.zeros(3), settings, Stopwatch())
    matrix = step.potential.matrix
    before = matrix.far_value.to_numpy()
    assert np.abs(before).min() > 0 and len(before) == len(matrix.far_rows)
    step.elastic.evaluate(0.0)
    matrix.far_value.fill(0.0)
    step.potential.assemble(exact=False)
    assert not matrix.far_value.to_numpy().any()
    step.potential.assemble_all()
    step.potential.assemble(exact=False)
    assert np.array_equal(matrix.far_value.to_numpy(), before)
