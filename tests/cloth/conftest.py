"""A small sheet of the paper's fabric."""

import pytest

from taichi_tryon.cloth.model import Cloth


@pytest.fixture(scope="session")
def sheet(make_sheet):
    return make_sheet(0.12, 0.1, 0.012)


@pytest.fixture(scope="session")
def cloth(sheet, moduli):
    return Cloth.join([(sheet, moduli)])
