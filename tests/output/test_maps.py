"""Strain, shear, pressure and gap of cloth of which they are known."""

import numpy as np
import pytest

from taichi_tryon.cloth.model import hat_gradients
from taichi_tryon.output import maps

REST = np.array([[[0, 0], [0.01, 0], [0.002, 0.012]], [[0.01, 0], [0.013, 0.011], [0.002, 0.012]]])
TRIANGLES = np.array([[0, 1, 2], [1, 3, 2]])
POINTS = np.array([[0, 0], [0.01, 0], [0.002, 0.012], [0.013, 0.011]])


def turned(columns: np.ndarray) -> np.ndarray:
    """The sheet under a homogeneous deformation, turned anyhow in space and shifted."""
    q, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    return np.column_stack([POINTS @ columns.T, np.zeros(4)]) @ q.T + [1, 2, 3]


def green(positions: np.ndarray) -> np.ndarray:
    f = np.einsum("tik,tia->tak", positions[TRIANGLES], hat_gradients(REST))
    metric = np.einsum("tak,tbk->tab", f, f) - np.eye(2)
    return np.stack([metric[:, 0, 0] / 2, metric[:, 1, 1] / 2, metric[:, 0, 1]], axis=1)


@pytest.mark.parametrize(
    ("warp", "weft", "shear"), [(0, 0, 0), (3.0, -2.0, 0), (0.0, 0.0, 12.0), (1.5, 0.5, -30.0), (-90, 200, 5)]
)
def test_strains_of_a_homogeneous_deformation(warp, weft, shear):
    g = np.radians(shear)
    columns = np.array([[1 + warp / 100, (1 + weft / 100) * np.sin(g)], [0, (1 + weft / 100) * np.cos(g)]])
    found = maps.strains(green(turned(columns)))
    assert found["strain_warp_percent"] == pytest.approx([warp] * 2, abs=1e-9)
    assert found["strain_weft_percent"] == pytest.approx([weft] * 2, abs=1e-9)
    assert found["shear_degree"] == pytest.approx([shear] * 2, abs=1e-6)


def test_a_triangle_shrunk_to_a_point_has_finite_strains():
    found = maps.strains(green(np.zeros((4, 3))))
    assert found["strain_warp_percent"] == pytest.approx([-100] * 2)
    assert np.isfinite(found["shear_degree"]).all()


def test_pressure_at_vertices_is_a_mean_of_the_samples():
    vertices = np.array([[0, 0, 0], [0, 1, 1], [0, 1, 2]])
    weights = np.array([[1, 0, 0], [0.5, 0.5, 0], [1 / 3] * 3])
    areas = np.array([1.0, 2.0, 3.0])
    same = maps.vertex_pressure(np.full(3, 7.0), vertices, weights, areas, 4)
    assert same == pytest.approx([7, 7, 7, 0])
    found = maps.vertex_pressure(np.array([6.0, 0, 12]), vertices, weights, areas, 4)
    assert found == pytest.approx([(6 + 12) / 3, 12 / 2, 12, 0])
    shares = np.bincount(vertices.ravel(), (weights * areas[:, None]).ravel(), 4)
    assert shares @ found == pytest.approx(areas @ [6, 0, 12])  # the force is kept


def test_forces_at_vertices_add_up_to_those_of_the_samples():
    vertices, weights = np.array([[0, 0, 0], [0, 1, 1], [0, 1, 2]]), np.array([[1, 0, 0], [0.5, 0.5, 0], [1 / 3] * 3])
    forces = np.array([[1.0, 0, 0], [0, 2, 0], [0, 0, 3]])
    found = maps.vertex_forces(forces, vertices, weights, 4)
    assert found == pytest.approx(np.array([[1, 1, 1], [0, 1, 1], [0, 0, 1], [0, 0, 0]]))
    assert maps.vertex_forces(forces[:0], vertices[:0], weights[:0], 4).dtype == float


def test_gaps_far_out_are_distances_to_the_skin():
    skin = np.array([[0, 0, 0], [1.0, 0, 0]])
    positions = np.array([[0, 0.002, 0], [0, 0.5, 0], [1, 0, -0.001], [1, 0.011, 0]])
    near = np.array([0.002, 0.03, -0.001, 0.02])
    assert maps.gaps(positions, near, skin) == pytest.approx([0.002, 0.5, -0.001, 0.011])
    assert near == pytest.approx([0.002, 0.03, -0.001, 0.02])  # not changed


def test_percentiles_count_by_weight():
    values, weights = np.array([3.0, 1.0, 2.0]), np.array([1.0, 1.0, 1.0])
    assert maps.weighted_percentiles(values, weights, (0, 50, 100)) == [1, 2, 3]
    assert maps.weighted_percentiles(values, np.array([98.0, 1, 1]), (50,))[0] > 2.9
    assert maps.weighted_percentiles(np.array([]), np.array([]), (50, 100)) == [0, 0]
    assert maps.weighted_percentiles(values, np.zeros(3), (50,)) == [0]
