import numpy as np
import pytest

from taichi_tryon.errors import PatternError
from taichi_tryon.mesh.topology import Topology

TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]


def grid(n: int) -> np.ndarray:
    """Triangles of n x n squares, vertices numbered by rows."""
    i, j = (x.ravel() for x in np.mgrid[:n, :n])
    a = i * (n + 1) + j
    return np.concatenate([np.stack([a, a + 1, a + n + 2], 1), np.stack([a, a + n + 2, a + n + 1], 1)])


def test_two_triangles_by_hand():
    topology = Topology.of(np.array([[0, 1, 2], [2, 1, 3]]), 4)
    assert topology.edges.tolist() == [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]
    assert topology.edge_triangles.tolist() == [[0, -1], [-1, 0], [0, 1], [1, -1], [-1, 1]]
    assert topology.opposite.tolist() == [[2, -1], [-1, 1], [0, 3], [2, -1], [-1, 1]]
    assert topology.triangle_edges.tolist() == [[0, 2, 1], [2, 3, 4]]
    assert topology.is_boundary.tolist() == [True, True, False, True, True]
    assert [topology.vertex_triangles[v].tolist() for v in range(4)] == [[0], [0, 1], [0, 1], [1]]
    assert [topology.vertex_corners[v].tolist() for v in range(4)] == [[0], [1, 4], [2, 3], [5]]
    assert [topology.vertex_neighbours[v].tolist() for v in range(4)] == [[1, 2], [0, 2, 3], [0, 1, 3], [1, 2]]
    assert [topology.vertex_edges[v].tolist() for v in range(4)] == [[0, 1], [0, 2, 3], [1, 2, 4], [3, 4]]


def test_a_grid_is_a_disk_with_one_rim_on_the_left_of_which_lies_the_cloth():
    topology = Topology.of(grid(5), 36)
    assert topology.euler_characteristic == 1 and topology.component_count == 1
    (loop,) = topology.boundary_loops()
    assert len(loop) == 20
    y, x = np.divmod(loop, 6)
    assert (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2 == 25  # counter-clockwise, as the triangles
    assert topology.vertex_neighbours.longest == 6


def test_a_closed_surface_has_no_rim():
    topology = Topology.of(np.array(TETRAHEDRON), 4)
    assert topology.boundary_loops() == [] and topology.euler_characteristic == 2
    assert (topology.edge_triangles >= 0).all()


def test_vertices_of_no_triangle_count_for_nothing():
    topology = Topology.of(np.array([[0, 1, 2], [4, 5, 6]]), 9)
    assert topology.component_count == 2 and topology.euler_characteristic == 2
    assert topology.vertex_triangles[3].size == 0


@pytest.mark.parametrize(
    ("triangles", "message"),
    [
        ([[0, 1, 2], [3, 4, 3]], r"two corners that are sewn together \(back\)"),
        ([[0, 1, 2], [1, 0, 3], [0, 1, 4]], r"more than two triangles share an edge \(front, back\)"),
        ([[0, 1, 2], [0, 1, 3]], r"face opposite ways \(front, back\)"),
    ],
)
def test_what_is_not_a_cloth_is_refused_and_named(triangles, message):
    with pytest.raises(PatternError, match=message):
        Topology.of(np.array(triangles), 5, ["front", "back", "back"])


def test_rims_that_touch_in_a_point():
    bow_tie = Topology.of(np.array([[0, 1, 2], [0, 3, 4]]), 5)
    with pytest.raises(PatternError, match="touch in one point"):
        bow_tie.boundary_loops()
