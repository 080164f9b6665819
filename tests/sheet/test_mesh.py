"""Meshes of plain sheets: shape, grain, families, tubes."""

import math

import numpy as np
import pytest

from taichi_tryon.errors import PatternError
from taichi_tryon.sheet.mesh import PANEL, sheet_mesh
from taichi_tryon.sheet.spec import SheetSpec

KINDS = ["delaunay", "regular", "alternating", "jittered"]


def mesh_of(edge=0.01, **keys):
    return sheet_mesh(SheetSpec(**keys), edge, "strip")


@pytest.mark.parametrize("kind", KINDS)
def test_a_rectangle_is_filled_and_its_sides_are_found(kind):
    mesh = mesh_of(size_cm=[6, 4], mesh=kind)
    assert mesh.areas.sum() == pytest.approx(24e-4, rel=1e-12) and mesh.areas.min() > 0
    assert mesh.topology.euler_characteristic == 1 and mesh.topology.component_count == 1
    for side, axis, at, count in (("bottom", 1, 0, 7), ("right", 0, 0.06, 5), ("top", 1, 0.04, 7), ("left", 0, 0, 5)):
        points = mesh.pattern_points[mesh.edge_points[PANEL, side]]
        assert len(points) == count and points[:, axis] == pytest.approx(at, abs=1e-12)


def test_the_families_differ_as_they_say():
    regular, alternating, jittered = (mesh_of(size_cm=[6, 4], mesh=kind) for kind in KINDS[1:])
    inner = np.setdiff1d(np.arange(35), np.concatenate([*regular.edge_points.values()]))
    valence = {m: np.diff(m.topology.vertex_edges.offsets)[inner] for m in (regular, alternating)}
    assert set(valence[regular]) == {6} and set(valence[alternating]) == {4, 8}
    assert np.array_equal(jittered.triangles, regular.triangles)
    away = np.abs(jittered.pattern_points - regular.pattern_points).max(axis=1)
    assert 1e-4 < away[inner].min() and away.max() <= 0.25 * 0.01
    assert np.array_equal(np.flatnonzero(away), inner)


def test_a_disk_and_a_polygon():
    disk = mesh_of(diameter_cm=30)
    assert disk.areas.sum() == pytest.approx(math.pi * 0.15**2, rel=1e-3)
    triangle = mesh_of(outline_cm=[[0, 0], [6, 0], [0, 4]])
    assert triangle.areas.sum() == pytest.approx(12e-4, rel=1e-12)
    assert (PANEL, "side_2") in triangle.edge_points


def test_the_mesh_of_a_disk_follows_a_circle():
    disk = mesh_of(edge=0.012, diameter_cm=30, inner_diameter_cm=18)
    assert disk.topology.euler_characteristic == 1 and len(disk.topology.boundary_loops()) == 1
    rim = disk.pattern_points[disk.edge_points[PANEL, "rim"]]
    assert np.linalg.norm(rim, axis=1) == pytest.approx(0.15, abs=1e-9)
    radius = np.linalg.norm(disk.pattern_points, axis=1)
    inner = (radius <= 0.09 + 1e-9)[disk.point_triangles].all(axis=1)
    on_circle = np.abs(radius - 0.09) < 1e-9
    assert on_circle.sum() == 48
    polygon = 48 / 2 * 0.09**2 * math.sin(2 * math.pi / 48)
    assert disk.areas[inner].sum() == pytest.approx(polygon, rel=1e-9)


def test_the_mesh_follows_lines():
    mesh = mesh_of(edge=0.007, size_cm=[6, 4], lines_cm=[1, 2.7])
    assert mesh.areas.sum() == pytest.approx(24e-4, rel=1e-12) and mesh.topology.euler_characteristic == 1
    corners = mesh.pattern_points[mesh.point_triangles][..., 0]
    for x in (0.01, 0.027):
        assert (np.abs(mesh.pattern_points[:, 0] - x) < 1e-9).sum() == 7
        assert not ((corners.min(axis=1) < x - 1e-6) & (corners.max(axis=1) > x + 1e-6)).any()
    jittered = mesh_of(size_cm=[6, 4], lines_cm=[2], mesh="jittered")
    assert (np.abs(jittered.pattern_points[:, 0] - 0.02) < 1e-9).sum() == 5
    with pytest.raises(PatternError, match="sheet 'strip': no square ends at lines_cm 2.5"):
        mesh_of(size_cm=[6, 4], lines_cm=[2.5], mesh="regular")
    with pytest.raises(ValueError, match="must rise"):
        mesh_of(size_cm=[6, 4], lines_cm=[1, 7])


@pytest.mark.parametrize("degrees", [0, 45, 90, 200])
def test_warp_runs_along_the_grain(degrees):
    mesh = mesh_of(size_cm=[6, 4], grain_degree=degrees)
    warp = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
    corners = mesh.pattern_points[mesh.point_triangles]
    assert mesh.rest[..., 0] == pytest.approx(corners @ warp, abs=1e-12)
    assert mesh.areas.min() > 0  # not mirrored


@pytest.mark.parametrize("kind", ["delaunay", "regular"])
def test_a_tube_is_closed(kind):
    mesh = mesh_of(size_cm=[20, 4], mesh=kind, tube_radius_cm=4)
    assert mesh.topology.euler_characteristic == 0 and len(mesh.topology.boundary_loops()) == 2
    assert mesh.areas.sum() == pytest.approx(80e-4, rel=1e-12)
    left, right = (mesh.edge_vertices(PANEL, side) for side in ("left", "right"))
    assert set(left) == set(right)
