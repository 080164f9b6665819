from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from taichi_tryon.body.density import gap
from taichi_tryon.dressing.check import body_gaps, crossings
from taichi_tryon.dressing.disks import disk_frame
from taichi_tryon.dressing.flatten import signed_areas
from taichi_tryon.dressing.layers import heights
from taichi_tryon.dressing.panel_map import map_panel
from taichi_tryon.dressing.place import dress
from taichi_tryon.errors import DressingError
from taichi_tryon.mesh.garment import build

GARMENTS = ("top_9AR", "top_dart_9AR", "trousers_9AR", "jumpsuit_9AR")
POSES = ("standing", "arms_raised_45", "step_forward_right")


@pytest.mark.parametrize("name", GARMENTS)
def test_maps_are_one_to_one_within_the_rectangle(name, garment):
    pattern, mesh, spec = garment(name)
    for panel in pattern.panels:
        m = map_panel(spec, pattern, mesh, panel)
        assert m.u.min() == 0 and m.u.max() == len(m.disks) - 1
        assert m.t.min() == 0 and m.t.max() == 1
        areas = signed_areas(m.triangles, np.stack([m.t, -m.u], axis=1))
        assert (
            areas.min() > -1e-12
        )  # three points on one side of the rectangle make a flat triangle, none is turned over
        assert (areas > 1e-9).mean() > 0.97
        assert np.isclose(areas.sum(), len(m.disks) - 1)


def test_inner_lines_lie_on_their_disks(garment):
    pattern, mesh, spec = garment("top_9AR")
    m = map_panel(spec, pattern, mesh, "front_l")
    points = np.flatnonzero(mesh.point_panel == mesh.panel_names.index("front_l"))
    y = np.full(mesh.vertex_count, np.nan)
    y[mesh.point_vertex[points]] = mesh.pattern_points[points, 1]
    y = y[m.vertices]
    for level, u in ((0.147, 2.0), (0.0, 3.0)):
        assert np.abs(m.u[np.abs(y - level) < 1e-3] - u).max(initial=0) < 0.02
        assert (m.u[y > level + 0.002] < u).all() and (m.u[y < level - 0.002] > u).all()


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("name", [*GARMENTS, "skirt_9AR"])
def test_start_is_outside_the_body_and_free_of_crossings(name, pose, garment, body, transforms, dressed):
    _, mesh, _ = garment(name)
    start = dressed(name, pose)
    balls = body.posed(transforms(pose))
    assert body_gaps(start.positions, mesh.triangles, balls).min() >= 1e-3
    pairs = crossings(start.positions, mesh.triangles)
    if name.startswith("top"):
        assert len(pairs) == 0 and start.notes == ()
    else:
        assert (len(pairs) > 0) == bool(start.notes)
        assert all("crotch" in note for note in start.notes)


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("name", GARMENTS)
def test_start_is_only_moderately_stretched(name, pose, garment, dressed):
    _, mesh, _ = garment(name)
    x = dressed(name, pose).positions
    edges = mesh.topology.edges
    stretch = np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1) / mesh.edge_lengths
    assert 0.95 < np.median(stretch) < 1.05
    assert stretch.max() < 1.6


@pytest.mark.parametrize("name, pose", [("top_9AR", "standing"), ("trousers_9AR", "step_forward_right")])
def test_warp_runs_along_the_limbs_and_the_right_side_is_out(name, pose, garment, body, transforms, dressed):
    _, mesh, spec = garment(name)
    x = dressed(name, pose).positions
    balls = body.posed(transforms(pose))
    corners = x[mesh.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    middle = corners.mean(axis=1)
    outside = gap(balls, middle + 2e-3 * normal) >= gap(balls, middle - 2e-3 * normal)  # equal where it is far
    assert outside.mean() > 0.98
    flat = np.stack([mesh.rest[:, 1] - mesh.rest[:, 0], mesh.rest[:, 2] - mesh.rest[:, 0]], axis=2)
    sides = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    warp = (sides @ np.linalg.inv(flat))[:, :, 0]
    for number, panel in enumerate(mesh.panel_names):
        own = mesh.panel == number
        up = np.average(warp[own], axis=0, weights=mesh.areas[own])
        names = spec.disks_of(panel)
        (top, _), (low, _) = (disk_frame(spec, n, body, transforms(pose)) for n in (names[0], names[-1]))
        cosine = up @ (top - low) / np.linalg.norm(up) / np.linalg.norm(top - low)
        assert cosine > 0.8, panel


@pytest.mark.parametrize("name", ["top_9AR", "trousers_9AR"])
@pytest.mark.parametrize("pose", POSES)
def test_openings_lie_at_their_disks(name, pose, garment, body, transforms, dressed):
    _, _, spec = garment(name)
    start = dressed(name, pose)
    assert {line.name for line in start.lines} == set(spec.lines)
    for line in start.lines:
        point, normal = disk_frame(spec, line.disk, body, transforms(pose))
        assert np.abs((start.positions[line.vertices] - point) @ normal).max() < 0.015, line.name
        assert line.bone == spec.disks[line.disk].turns_with


def test_second_layer_lies_further_out(garment, body, transforms, dressed):
    pattern, mesh, spec = garment("top_9AR")
    balls = body.posed(transforms("arms_raised_45"))
    first = dressed("top_9AR", "arms_raised_45").positions
    upper = dress(pattern, mesh, spec, body, transforms("arms_raised_45"), ((first, mesh.triangles),)).positions
    assert gap(balls, upper).min() > gap(balls, first).min() + 1.5e-3
    height, _, at_rim = heights(upper, (first, mesh.triangles), np.inf)
    assert height[~at_rim].min() > 1e-3 and np.median(height[~at_rim]) < 8e-3


def changed(spec, disk: str, **update):
    return spec.model_copy(update={"disks": spec.disks | {disk: spec.disks[disk].model_copy(update=update)}})


@pytest.fixture
def refused(garment, body, transforms):
    def check(spec, match: str):
        pattern, mesh, _ = garment("top_9AR")
        with pytest.raises(DressingError, match=match):
            dress(pattern, mesh, spec, body, transforms("arms_raised_45"))

    return check


def test_disks_in_the_wrong_order_name_panel_and_disk(garment, refused):
    _, _, spec = garment("top_9AR")
    above = changed(spec, "waist", at="bust_line", offset_cm=[0.0, 5.0, 0.0])
    refused(above, "panel 'front_l': disk 'waist' does not lie beyond disk 'bust'")


def test_surface_through_the_body_names_panel_and_disk(garment, refused):
    _, _, spec = garment("top_9AR")
    other_side = changed(
        spec, "wrist_l", at="hand_r", turns_with="lowerarm_r", normal=[-1.0, -1.0, 0.124], groups=["arm_r"]
    )
    refused(other_side, "panel '.*' .*disk '.*'")


def test_missing_panel_is_named(garment, refused):
    _, _, spec = garment("top_9AR")
    refused(spec.model_copy(update={"panels": {k: v for k, v in spec.panels.items() if k != "back"}}), "'back'")


def test_edge_that_the_panel_lacks_is_named(garment, refused):
    _, _, spec = garment("top_9AR")
    panel = spec.panels["front_l"].model_copy(update={"top": ["collar"]})
    refused(spec.model_copy(update={"panels": spec.panels | {"front_l": panel}}), "panel 'front_l'.*'collar'")


def test_row_off_the_panel_is_named(garment, refused):
    _, _, spec = garment("top_9AR")
    panel = spec.panels["front_l"]
    panel = panel.model_copy(update={"rows": panel.rows | {"waist": -30.0}})
    refused(spec.model_copy(update={"panels": spec.panels | {"front_l": panel}}), "panel 'front_l'.*disk 'waist'")


@pytest.mark.parametrize("end", [0.14, 0.5])
def test_the_sides_of_an_open_closure_start_apart(end, garment, body, transforms):
    """Laid on one line, they would cross, and layers that cross at the start can never be parted."""
    pattern, _, spec = garment("top_9AR")
    seams = tuple(replace(s, openings=((0.0, end),)) if s.name == "centre_front" else s for s in pattern.seams)
    pattern = replace(pattern, seams=seams)
    mesh = build(pattern, 0.025, "top")
    start = dress(pattern, mesh, spec, body, transforms("standing"))
    assert len(crossings(start.positions, mesh.triangles)) == 0
    left, right = (mesh.edge_vertices(panel, "centre_front") for panel in ("front_l", "front_r"))
    left, right = (np.intersect1d(side, mesh.opened) for side in (left, right))
    apart = np.linalg.norm(start.positions[left][:, None] - start.positions[right], axis=2)
    assert apart.min() > 2e-3
