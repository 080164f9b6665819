"""Sheets that start in the body: which of them contact would take out of it on one side."""

import numpy as np
import pytest

from taichi_tryon.sheet.clear import parted
from taichi_tryon.sheet.mesh import sheet_mesh
from taichi_tryon.sheet.place import place
from taichi_tryon.sheet.spec import SheetSpec


@pytest.fixture(scope="module")
def found(floor_and_ball):
    """Asks about a sheet in a ball of radius 10 cm around (0, 1, 0) m."""
    balls = floor_and_ball.posed(np.eye(4)[None])

    def ask(**keys):
        spec = SheetSpec(**keys)
        mesh = sheet_mesh(spec, 0.01, "sheet")
        positions, _ = place(spec, mesh)
        return positions[mesh.triangles].mean(axis=1), *parted(positions, mesh.triangles, balls)

    return ask


def level(height_cm: float) -> dict:
    return {"size_cm": [14, 12], "origin_cm": [-7, height_cm, 6], "rotation_degree": [-90, 0, 0]}


@pytest.mark.parametrize("depth_mm", [-5, 1, 10, 30, 60, 85])
def test_above_its_middle_a_sheet_leaves_a_ball_upwards(found, depth_mm):
    assert len(found(**level(110 - depth_mm / 10))[1]) == 0


@pytest.mark.parametrize("depth_mm", [10, 30, 60])
def test_a_tube_leaves_it_outwards_and_a_limb_between_two_layers_parts_neither(found, depth_mm):
    radius = 10 - depth_mm / 10
    tube = {"size_cm": [60, 6], "origin_cm": [0, 97, 0], "tube_radius_cm": radius, "mesh": "regular"}
    assert len(found(**tube)[1]) == 0
    assert len(found(**level(110 - depth_mm / 10))[1]) == len(found(**level(90 + depth_mm / 10))[1]) == 0


def test_through_its_middle_some_would_leave_it_upwards_and_some_downwards(found):
    middles, triangles, depths = found(**level(100.2))
    assert len(triangles) and np.abs(middles[triangles] - [0, 1, 0]).max() < 0.015
    assert depths[0] == pytest.approx(0.098, abs=2e-3) and (np.diff(depths) <= 0).all()


def test_a_sheet_with_a_limb_through_it_is_found_even_where_only_midpoints_are_inside(found, floor_and_ball):
    assert len(found(size_cm=[30, 30], origin_cm=[-14.3, 85.2, 0])[1])
    corners = np.array([[-0.11, 1, 0], [0.11, 1, 0], [0, 1.2, 0]])
    triangles, depths = parted(corners, np.array([[0, 1, 2]]), floor_and_ball.posed(np.eye(4)[None]))
    assert triangles.tolist() == [0] and depths[0] > 0.02


def test_off_the_body_nothing_is_asked(found):
    assert len(found(size_cm=[10, 10], origin_cm=[50, 100, 0])[1]) == 0
