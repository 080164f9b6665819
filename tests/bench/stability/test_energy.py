"""How growth of energy is counted."""

import pytest

from taichi_tryon.bench.stability.energy import Growth


@pytest.mark.parametrize(
    ("energies", "grew", "fell"),
    [((5, 4, 3), 0, 2), ((5, 6, 4), 1, 1), ((5, 2, 4, 1, 1.5), 2, 4), ((5,), 0, 0)],
)
def test_growth_is_over_the_least_before(energies, grew, fell):
    growth = Growth.since(energies[0])
    for energy in energies[1:]:
        growth.add(energy)
    assert (growth.grew, growth.fell) == (grew, fell)
