"""How the cloth is divided: every vertex once, in patches that hang together and blocks that are small."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from taichi_tryon.cloth.model import Cloth
from taichi_tryon.solver.partition import blocks, patches


@pytest.fixture(scope="module")
def three(make_sheet, moduli):
    """Three sheets of 0.2 by 0.1 m, not joined."""
    return Cloth.join([(make_sheet(0.2, 0.1, 0.01), moduli)] * 3)


@pytest.mark.parametrize("count", [1, 3, 12, 60])
def test_there_are_as_many_patches_as_asked_for(three, count):
    patch = patches(three, count)
    assert np.array_equal(np.unique(patch), np.arange(max(count, 3)))


def test_a_patch_hangs_together(three):
    patch = patches(three, 12)
    i, j = three.hinges[:, :2].T
    inside = patch[i] == patch[j]
    nv = three.vertex_count
    graph = sp.csr_matrix((np.ones(inside.sum()), (i[inside], j[inside])), shape=(nv, nv))
    assert connected_components(graph, directed=False)[0] == 12
    sizes = np.bincount(patch)
    assert sizes.max() < 3 * sizes.min()


@pytest.mark.parametrize("most", [1, 8, 1000])
def test_blocks_are_small_and_full(three, most):
    patch = patches(three, 12)
    points = np.random.default_rng(0).normal(size=(three.vertex_count, 3))
    block = blocks(points, patch, most)
    sizes = np.bincount(block)
    assert sizes.min() >= 1 and sizes.max() <= most
    # as few as there can be
    assert len(sizes) == np.ceil(np.bincount(patch) / most).sum()
    for k in range(len(sizes)):
        assert len(np.unique(patch[block == k])) == 1


def test_a_block_is_compact(three):
    """A row of vertices is cut into pieces of neighbours."""
    x = np.random.default_rng(0).permutation(40)
    block = blocks(np.column_stack([x, 0 * x, 0 * x]), np.zeros(40, int), 8)
    for k in range(5):
        assert np.ptp(x[block == k]) == 7
