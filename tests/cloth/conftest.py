"""A small sheet of the paper's fabric."""

import pytest
import taichi as ti

from taichi_tryon.cloth.elastic import Elastic


@pytest.fixture(scope="session")
def elastic(cloth):
    """The laws of the sheet, compiled once; tests set its positions ``x`` and sweep its edge rotations as they need."""
    return Elastic(cloth, ti.Vector.field(3, float, shape=cloth.vertex_count))
