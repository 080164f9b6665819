"""Zips and buttons on the mesh: sewn where they are closed, two rims where they are open."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_tryon.mesh.garment import build

EDGE = 0.03


@pytest.fixture
def top(load):
    """Makes the top with its front closed otherwise: mesh, and the heights of its front's points on both sides."""

    def make(edge=EDGE, **changes):
        pattern = load("top_9AR")
        seams = tuple(replace(s, **changes) if s.name == "centre_front" else s for s in pattern.seams)
        mesh = build(replace(pattern, seams=seams), edge, "top")
        left, right = (mesh.edge_points[panel, "centre_front"] for panel in ("front_l", "front_r"))
        return mesh, left, right[::-1]

    return make


def meeting(mesh, left, right) -> np.ndarray:
    """Which points of both sides, from the neck down, are one vertex."""
    return mesh.point_vertex[left] == mesh.point_vertex[right]


def along(mesh, left) -> np.ndarray:
    """Distance of the points of the front from the neck [m]."""
    y = mesh.pattern_points[left, 1]
    return y[0] - y


def test_a_closed_zip_is_a_seam(top, load):
    mesh, left, right = top(openings=())
    plain = build(
        replace(load("top_9AR"), seams=tuple(replace(s, closure=None) for s in load("top_9AR").seams)), EDGE, "t"
    )
    assert meeting(mesh, left, right).all() and len(mesh.opened) == 0
    np.testing.assert_array_equal(mesh.triangles, plain.triangles)


def test_an_open_zip_leaves_two_rims(top):
    mesh, left, right = top(openings=((0.0, 0.5),))
    assert not meeting(mesh, left, right).any()
    assert set(mesh.opened) == set(mesh.point_vertex[np.concatenate([left, right])])
    assert len(mesh.topology.boundary_loops()) == 3  # one round neck, front and hem; two cuffs


@pytest.mark.parametrize(("begin", "end"), [(0.0, 0.14), (0.2, 0.5), (0.1, 0.25)])
def test_a_zip_opens_from_place_to_place(top, begin, end):
    mesh, left, right = top(openings=((begin, end),))
    sewn, place = meeting(mesh, left, right), along(mesh, left)
    inner = (place > begin + 1e-9) & (place < end - 1e-9)
    free = inner | ((place == 0) & (begin == 0)) | ((place == place[-1]) & (end >= place[-1]))
    np.testing.assert_array_equal(sewn, ~free)
    for stop in (begin, end):
        assert stop > place[-1] or np.abs(place - stop).min() < 1e-9  # a vertex where the slider is
    np.testing.assert_array_equal(mesh.opened, np.unique(mesh.point_vertex[np.concatenate([left[free], right[free]])]))
    assert mesh.edge_lengths.min() > 0.3 * EDGE


def test_a_slider_next_to_a_corner_makes_no_sliver(top):
    mesh, left, right = top(openings=((0.0, 0.002),))
    assert mesh.edge_lengths.min() > 0.5 * EDGE and meeting(mesh, left, right)[1:].all()


def test_buttons_hold_in_places_and_can_be_undone(top):
    places = (0.02, 0.1, 0.18, 0.26, 0.34, 0.42)
    mesh, left, right = top(edge=0.02, closure="buttons", buttons=places)
    np.testing.assert_allclose(along(mesh, left)[meeting(mesh, left, right)], places, atol=1e-9)
    mesh, left, right = top(edge=0.02, closure="buttons", buttons=places, openings=((0.0, 0.15), (0.4, 0.49)))
    np.testing.assert_allclose(along(mesh, left)[meeting(mesh, left, right)], places[2:5], atol=1e-9)
