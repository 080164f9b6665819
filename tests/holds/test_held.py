"""What holds choose, where they lead it, and how they share the forces."""

import numpy as np
import pytest

from taichi_tryon.errors import InputError
from taichi_tryon.holds.held import Hold, Holds
from taichi_tryon.holds.spec import HoldSpec
from taichi_tryon.sheet.mesh import sheet_mesh
from taichi_tryon.sheet.place import place
from taichi_tryon.sheet.spec import SheetSpec

SHEET = SheetSpec(size_cm=[6, 4], mesh="regular")


@pytest.fixture(scope="module")
def mesh():
    return sheet_mesh(SHEET, 0.01, "strip")


@pytest.fixture(scope="module")
def start(mesh):
    return place(SHEET, mesh)[0]


def hold(mesh, name="clamp", **keys):
    return Hold.from_spec(name, HoldSpec(**keys), mesh)


def test_points_edges_and_areas(mesh, start):
    assert start[hold(mesh, points_cm=[[0, 0], [6.2, 4.1]]).vertices, :2] == pytest.approx(
        np.array([[0, 0], [6, 4]]) / 100
    )
    assert start[hold(mesh, edge="right").vertices, 0] == pytest.approx(0.06)
    disk = hold(mesh, disk_cm=[3, 2, 2]).vertices
    assert len(disk) == 5 and np.linalg.norm(start[disk, :2] - [0.03, 0.02], axis=1).max() == pytest.approx(0.01)
    area = hold(mesh, area_cm=[[1, 4], [0, 0]]).vertices
    assert len(area) == 10 and start[area, 0].max() == pytest.approx(0.01)
    assert (
        hold(mesh, edge="top").vertices.max() + 7 == Hold.from_spec("n", HoldSpec(edge="top"), mesh, 7).vertices.max()
    )


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"edge": "rim"}, "hold clamp: panel sheet has no edge rim; edges: bottom, right, top, left"),
        ({"edge": "top", "panel": "front"}, "hold clamp: strip has no panel front; panels: sheet"),
        ({"area_cm": [[1.2, 1.2], [1.8, 1.8]]}, "hold clamp: no vertex of panel sheet lies in area_cm"),
        ({"disk_cm": [1.5, 1.5, 1]}, "hold clamp: no vertex of panel sheet lies in disk_cm"),
    ],
)
def test_what_is_not_there_is_told(mesh, keys, message):
    with pytest.raises(InputError, match=message):
        hold(mesh, **keys)


def test_a_path_turns_and_shifts_and_comes_to_rest(mesh, start):
    path = [{"duration_s": 1.0, "translation_cm": [0, 0, 2], "rotation_degree": [0, 0, 90]}]
    led = Holds.of([hold(mesh, edge="left", about_cm=[0, 4, 0], path=path)], start)
    assert led.end_time == 1.0
    assert np.array_equal(led.targets(0.0), start)
    left = ~led.free.all(axis=1)
    expected = np.column_stack([0.04 - start[left, 1], np.full(left.sum(), 0.04), np.full(left.sum(), 0.02)])
    assert led.targets(1.0)[left] == pytest.approx(expected, abs=1e-12)
    assert np.array_equal(led.targets(1.0)[~left], start[~left])
    assert np.array_equal(led.targets(2.0), led.targets(1.0))
    assert led.targets(0.5)[left, 2] == pytest.approx(0.01)
    assert np.abs(led.targets(1e-3) - start).max() < 1e-6  # it starts from rest


def test_held_along_some_axes_it_slides_along_the_others_and_the_first_hold_leads(mesh, start):
    corner = hold(mesh, "corner", points_cm=[[0, 0]])
    left = hold(mesh, "left", edge="left", axes=["x"], path=[{"duration_s": 1.0, "translation_cm": [1, 5, 0]}])
    holds = Holds.of([corner, left], start)
    assert holds.free.sum() == 3 * len(start) - 3 - 4
    moved = holds.targets(1.0) - start
    assert np.abs(moved[:, 1:]).max() == 0 and sorted(moved[:, 0])[-4:] == pytest.approx([0.01] * 4)
    assert moved[corner.vertices] == pytest.approx(0)
    reactions = holds.reactions(np.tile([1.0, 2.0, 3.0], (len(start), 1)))
    assert reactions["corner"] == pytest.approx([-1, -2, -3]) and reactions["left"] == pytest.approx([-4, 0, 0])


def test_without_holds_all_is_free(start):
    none = Holds.of([], start)
    assert none.free.all() and none.end_time == 0.0 and none.reactions(start) == {}
    assert np.array_equal(none.targets(1.0), start)
