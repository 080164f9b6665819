"""A small sheet of the paper's fabric."""

import pytest
import taichi as ti

from taichi_tryon.cloth.elastic import Elastic
from taichi_tryon.cloth.model import Cloth


@pytest.fixture(scope="session")
def sheet(make_sheet):
    return make_sheet(0.12, 0.1, 0.012)


@pytest.fixture(scope="session")
def cloth(sheet, moduli):
    return Cloth.join([(sheet, moduli)])


@pytest.fixture(scope="session")
def elastic(cloth):
    """The laws of the sheet, compiled once; tests set its positions ``x`` and sweep its edge rotations as they need."""
    return Elastic(cloth, ti.Vector.field(3, float, shape=cloth.vertex_count))
