"""Forces of the cloth on a surface: kept, even where even, and on the limb that is touched."""

import numpy as np
import pytest

from taichi_tryon.output.imprint import imprint, surface_vectors


def plane(count: int, spacing: float, height: float, up: bool):
    """A square of ``count`` by ``count`` squares, facing +y or -y: vertices, triangles."""
    i, j = (index.ravel() for index in np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij"))
    vertices = np.column_stack([i * spacing, np.full(len(i), height), j * spacing])
    a = np.arange(len(i)).reshape(count + 1, count + 1)[:-1, :-1].ravel()
    b, c, d = a + 1, a + count + 2, a + count + 1
    triangles = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return vertices, triangles if up else triangles[:, ::-1]


@pytest.fixture(scope="module")
def limbs():
    """Two surfaces 6 mm apart that face each other: the lower one first."""
    lower, upper = plane(30, 0.01, 0.0, up=True), plane(30, 0.01, 0.006, up=False)
    count = len(lower[0])
    return np.concatenate([lower[0], upper[0]]), np.concatenate([lower[1], upper[1] + count]), count


def test_areas_and_normals(limbs):
    areas, vectors = surface_vectors(*limbs[:2])
    assert areas.sum() == pytest.approx(2 * 0.3**2)
    np.testing.assert_allclose(vectors[: limbs[2]].sum(axis=0), [0, 0.09, 0], atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), areas)


def test_an_even_pressure_stays_even_and_on_the_side_that_is_touched(limbs):
    vertices, triangles, count = limbs
    rng = np.random.default_rng(0)
    spacing = 0.004
    grid = np.stack(np.meshgrid(np.arange(0.05, 0.25, spacing), np.arange(0.05, 0.25, spacing)), axis=-1).reshape(-1, 2)
    points = np.column_stack([grid[:, 0], np.full(len(grid), 0.003), grid[:, 1]])
    points[:, ::2] += rng.uniform(-2e-4, 2e-4, (len(points), 2))
    found = imprint(points, np.full(len(points), 700 * spacing**2), np.tile([0.0, 1, 0], (len(points), 1)),
                    vertices, triangles, 0.015)  # fmt: skip
    assert (found[count:] == 0).all()
    inside = ((vertices[:, [0, 2]] > 0.075) & (vertices[:, [0, 2]] < 0.225)).all(axis=1)[:count]
    assert found[:count][inside] == pytest.approx(np.full(inside.sum(), 700), rel=0.03)
    assert found @ surface_vectors(vertices, triangles)[0] == pytest.approx(700 * spacing**2 * len(points), rel=1e-12)


def test_what_is_far_off_presses_where_the_surface_is_nearest(limbs):
    vertices, triangles, _ = limbs
    found = imprint(np.array([[0.1, 0.5, 0.1]]), np.array([2.0]), np.array([[0.0, 1, 0]]), vertices, triangles, 0.015)
    (at,) = np.flatnonzero(found)
    np.testing.assert_allclose(vertices[at], [0.1, 0.006, 0.1])
    assert found[at] * surface_vectors(vertices, triangles)[0][at] == pytest.approx(2.0)


def test_without_contact_or_body_there_is_no_pressure(limbs):
    none = np.zeros((0, 3))
    assert not imprint(none, np.zeros(0), none, *limbs[:2], 0.015).any()
    points = np.zeros((4, 3))
    assert not imprint(points, np.zeros(4), points, *limbs[:2], 0.015).any()
    assert imprint(none, np.zeros(0), none, none, np.zeros((0, 3), int), 0.015).shape == (0,)
