"""Where sheets start."""

import numpy as np
import pytest

from taichi_tryon.sheet.mesh import sheet_mesh
from taichi_tryon.sheet.place import place, waves
from taichi_tryon.sheet.spec import SheetSpec, WavesSpec


def placed(**keys):
    spec = SheetSpec(**keys)
    mesh = sheet_mesh(spec, 0.01, "strip")
    return mesh, *place(spec, mesh)


def normals(mesh, positions):
    a, b, c = (positions[mesh.triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a), axis=1)[:, None]


def test_it_is_turned_and_shifted():
    mesh, positions, velocities = placed(size_cm=[6, 4], origin_cm=[1, 100, 0], rotation_degree=[-90, 0, 0])
    assert positions[:, 1] == pytest.approx(1.0)
    assert normals(mesh, positions) == pytest.approx(np.tile([0.0, 1.0, 0.0], (len(mesh.triangles), 1)))
    assert positions.min(axis=0) == pytest.approx([0.01, 1.0, -0.04]) and positions.max(axis=0)[0] == pytest.approx(
        0.07
    )
    assert not velocities.any()


def test_a_tube_lies_on_its_cylinder_outside_out():
    mesh, positions, _ = placed(size_cm=[20, 4], tube_radius_cm=4, rotation_degree=[90, 0, 0], origin_cm=[0, 0, 1])
    assert np.hypot(positions[:, 0], positions[:, 1]) == pytest.approx(0.04)
    assert sorted({*positions[:, 2].round(9)})[0] == pytest.approx(0.01)
    middle = positions[mesh.triangles].mean(axis=1)
    outward = middle[:, :2] / np.linalg.norm(middle[:, :2], axis=1)[:, None]
    assert (normals(mesh, positions)[:, :2] * outward).sum(axis=1).min() > 0.98


def test_it_flies_and_spins_about_its_centre():
    keys = {"size_cm": [6, 4], "origin_cm": [5, 5, 5], "velocity_m_s": [1, 2, 3], "spin_rad_s": [0, 0, 2]}
    _, positions, velocities = placed(**keys)
    centre = np.array([0.08, 0.07, 0.05])
    expected = np.array([1, 2, 3]) + np.cross([0, 0, 2], positions - centre)
    assert velocities == pytest.approx(expected, abs=1e-9)


def test_waves_are_the_same_on_every_mesh_and_differ_by_seed():
    spec = {"height_mm": 0.5, "length_cm": 3}
    points = np.random.default_rng(1).uniform(-5, 5, (40000, 2))
    height = waves(WavesSpec(**spec), points)
    assert np.sqrt((height**2).mean()) == pytest.approx(5e-4, rel=0.1)
    assert np.array_equal(waves(WavesSpec(**spec), points[::-1])[::-1], height)
    assert np.abs(waves(WavesSpec(**spec, seed=1), points) - height).max() > 5e-4
    mesh, positions, _ = placed(size_cm=[6, 4], waves=spec, rotation_degree=[-90, 0, 0])
    flat = mesh.pattern_points[np.unique(mesh.point_vertex, return_index=True)[1]]
    assert positions[:, 1] == pytest.approx(waves(WavesSpec(**spec), flat))


def test_folds_stand_around_the_rim():
    spec = WavesSpec(height_mm=0.5, folds=8)
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    rim = 0.15 * np.column_stack([np.cos(angle), np.sin(angle)])
    height = waves(spec, np.concatenate([rim, 0.5 * rim]))
    assert np.sqrt((height[:400] ** 2).mean()) == pytest.approx(0.5e-3)
    assert np.abs(np.fft.rfft(height[:400])).argmax() == 8
    assert np.abs(height[400:]).max() < 0.1 * np.abs(height[:400]).max()


@pytest.mark.parametrize("keys", [{}, {"length_cm": 3, "folds": 8}])
def test_waves_are_of_one_kind(keys):
    with pytest.raises(ValueError, match="give one of length_cm, folds"):
        WavesSpec(height_mm=1, **keys)
