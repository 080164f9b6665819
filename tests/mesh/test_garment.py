from dataclasses import replace

import numpy as np
import pytest

from taichi_tryon.errors import PatternError
from taichi_tryon.mesh.garment import build
from taichi_tryon.mesh.triangulate import corner_angles, signed_areas
from taichi_tryon.pattern.panel import Pattern, Seam

OPENINGS = {"top_9AR": 4, "top_dart_9AR": 4, "trousers_9AR": 3, "jumpsuit_9AR": 5, "skirt_9AR": 2}
MESHES: dict = {}


@pytest.fixture(params=[(name, mm) for name in OPENINGS for mm in (25, 12)], ids=lambda p: f"{p[0]}-{p[1]}mm")
def garment(request, load):
    """A shipped pattern and its mesh."""
    name, mm = request.param
    pattern = load(name)
    if request.param not in MESHES:
        MESHES[request.param] = build(pattern, mm / 1000, name)
    return pattern, MESHES[request.param], mm / 1000


def sharp_corners(pattern, mesh) -> set[int]:
    """Pattern points at corners of outlines sharper than 60 degrees."""
    found = set()
    for panel in pattern.panels.values():
        for edge, following in zip(panel.edges, (*panel.edges[1:], panel.edges[0]), strict=True):
            back, ahead = -edge.tangent(1.0), following.tangent(0.0)
            if back @ ahead > 0.5:
                found.add(int(mesh.edge_points[panel.name, following.name][0]))
    return found


def test_openings_pieces_and_euler_characteristic(garment):
    pattern, mesh, _ = garment
    openings = OPENINGS[pattern.name]
    assert len(mesh.topology.boundary_loops()) == openings
    assert mesh.topology.euler_characteristic == 2 - openings
    assert mesh.topology.component_count == 1
    assert np.array_equal(np.unique(mesh.triangles), np.arange(mesh.vertex_count))


def test_angles_away_from_sharp_corners(garment):
    pattern, mesh, _ = garment
    sharp = np.isin(mesh.point_triangles, list(sharp_corners(pattern, mesh))).any(axis=1)
    angles = np.degrees(corner_angles(mesh.rest)).min(axis=1)
    assert angles[~sharp].min() >= 25
    assert np.percentile(angles, 1) >= 35
    assert mesh.min_angle_deg == pytest.approx(angles.min())


def test_areas_are_those_of_the_sampled_outlines_and_nearly_of_the_pattern(garment):
    pattern, mesh, edge_length = garment
    assert mesh.areas.min() > 0
    for number, panel in enumerate(pattern.panels.values()):
        boundary = np.concatenate([mesh.edge_points[panel.name, edge.name][:-1] for edge in panel.edges])
        x, y = mesh.pattern_points[boundary].T
        polygon = (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2
        area = mesh.areas[mesh.panel == number].sum()
        assert area == pytest.approx(polygon, rel=1e-12)
        # a chord of a curve of radius r leaves h^2 / 8 r on average two thirds of it: small for curves of 5 cm or more
        assert area == pytest.approx(panel.area, abs=edge_length**2 / 8 / 0.05 * 0.5)


def test_edges_are_about_as_long_as_asked(garment):
    _, mesh, edge_length = garment
    assert mesh.edge_lengths.shape == (len(mesh.topology.edges),)
    assert 0.9 * edge_length < mesh.edge_lengths.mean() < 1.1 * edge_length
    assert 0.5 * edge_length < mesh.edge_lengths.min() and mesh.edge_lengths.max() < 2 * edge_length


def test_every_edge_of_the_pattern_is_there_from_end_to_end(garment):
    pattern, mesh, _ = garment
    sides = np.sort(mesh.topology.edges, axis=1)
    sides = set(map(tuple, sides.tolist()))
    for (panel, edge), points in mesh.edge_points.items():
        flat = mesh.pattern_points[points]
        exact = pattern.edge((panel, edge))
        assert np.array_equal(flat[0], exact.start) and flat[-1] == pytest.approx(exact.end, abs=1e-5)
        steps = np.linalg.norm(np.diff(flat, axis=0), axis=1)
        assert steps.sum() == pytest.approx(exact.length, rel=0.01)
        vertices = mesh.edge_vertices(panel, edge).tolist()
        assert all((min(i, j), max(i, j)) in sides for i, j in zip(vertices, vertices[1:], strict=False))


def test_seams_have_the_same_vertices_on_both_sides(garment):
    pattern, mesh, _ = garment
    rims = {v for loop in mesh.topology.boundary_loops() for v in loop.tolist()}
    for seam in pattern.seams:
        (a,), (b,) = seam.a, seam.b
        one, other = mesh.edge_vertices(*a), mesh.edge_vertices(*b)
        assert np.array_equal(one, other[::-1])
        assert not rims & set(one[1:-1].tolist())


def test_pattern_points_and_triangles_agree_with_the_sewn_mesh(garment):
    _, mesh, _ = garment
    assert np.array_equal(mesh.point_vertex[mesh.point_triangles], mesh.triangles)
    assert np.array_equal(mesh.point_panel[mesh.point_triangles], np.repeat(mesh.panel[:, None], 3, axis=1))
    assert signed_areas(mesh.pattern_points, mesh.point_triangles) == pytest.approx(mesh.areas, rel=1e-9)
    assert mesh.triangles.dtype == np.int32


def test_mirrored_panels_have_mirrored_meshes(garment):
    pattern, mesh, _ = garment
    names = list(mesh.panel_names)
    for panel in pattern.panels.values():
        if panel.mirror_of:
            one, other = (
                np.sort(mesh.rest[mesh.panel == names.index(name)].mean(axis=1).round(9).view(complex), axis=0)
                for name in (panel.mirror_of, panel.name)
            )
            assert np.sort(one.real, axis=0) == pytest.approx(np.sort(other.real, axis=0))
            assert np.sort(one.imag, axis=0) == pytest.approx(np.sort(-other.imag, axis=0))


def test_darts_are_closed_at_their_point_only_once(load):
    mesh = build(load("trousers_9AR"), 0.025, "t")
    legs = mesh.edge_vertices("front_l", "dart_side"), mesh.edge_vertices("front_l", "dart_centre")
    assert legs[0][-1] == legs[1][0]
    assert len(set(legs[0].tolist())) == len(legs[0]) == 5
    waist = mesh.edge_vertices("front_l", "waist_side")[-1], mesh.edge_vertices("front_l", "waist_centre")[0]
    assert waist[0] == waist[1]


def test_axis_0_lies_along_the_grain_and_nothing_is_turned_over(polygon_panel):
    grain = np.array([0.6, 0.8])
    panel = polygon_panel("p", [[0, 0], [0.2, 0], [0.2, 0.1], [0, 0.1]], grain)
    mesh = build(Pattern("p", {"p": panel}, ()), 0.02, "g")
    side = mesh.pattern_points[mesh.point_triangles[:, 1]] - mesh.pattern_points[mesh.point_triangles[:, 0]]
    rest = mesh.rest[:, 1] - mesh.rest[:, 0]
    assert rest[:, 0] == pytest.approx(side @ grain)
    assert rest[:, 1] == pytest.approx(side @ [-0.8, 0.6])
    assert mesh.name == "g" and mesh.areas.sum() == pytest.approx(0.02)


def test_a_clockwise_loop_gives_the_same_mesh(load, turn_round):
    pattern = load("top_9AR")
    turned = Pattern(pattern.name, {n: turn_round(p) for n, p in pattern.panels.items()}, pattern.seams)
    turned_one = replace(turned, panels=pattern.panels | {"back": turned.panels["back"]})
    turned_one = replace(
        turned_one,
        seams=tuple(replace(s, reversed=(s.a[0][0] == "back") == (s.b[0][0] == "back")) for s in pattern.seams),
    )
    straight = build(pattern, 0.025, "g")
    for other in (build(turned, 0.025, "g"), build(turned_one, 0.025, "g")):
        assert other.vertex_count == straight.vertex_count
        assert other.areas.min() > 0
        back = list(straight.panel_names).index("back")
        one, two = (np.sort(m.rest[m.panel == back].reshape(-1, 2), axis=0) for m in (straight, other))
        assert one == pytest.approx(two, abs=1e-9)
        assert len(other.topology.boundary_loops()) == 4


def test_meshing_twice_gives_the_same(load):
    one, two = (build(load("top_dart_9AR"), 0.025, "g") for _ in range(2))
    for name in ("triangles", "rest", "pattern_points", "point_vertex", "point_triangles"):
        assert np.array_equal(getattr(one, name), getattr(two, name))


def test_a_chain_of_two_edges_sewn_to_one(polygon_panel):
    a = polygon_panel("a", [[0, 0], [0.2, 0], [0.2, 0.11], [0.2, 0.3], [0, 0.3]])
    b = polygon_panel("b", [[0, 0], [0.2, 0], [0.2, 0.3], [0, 0.3]])
    seam = Seam("s", (("a", "e1"), ("a", "e2")), (("b", "e3"),))
    mesh = build(Pattern("p", {"a": a, "b": b}, (seam,)), 0.02, "g")
    along_a = np.concatenate([mesh.edge_vertices("a", "e1"), mesh.edge_vertices("a", "e2")[1:]])
    assert np.array_equal(along_a, mesh.edge_vertices("b", "e3")[::-1])
    assert len(mesh.topology.boundary_loops()) == 1 and mesh.topology.euler_characteristic == 1


def test_two_panels_sewn_all_round_become_a_closed_cushion(polygon_panel):
    corners = [[-0.1, 0], [0.1, 0], [0.1, 0.2], [-0.1, 0.2]]
    panels = {name: polygon_panel(name, corners) for name in ("front", "back")}
    partner = {"e0": "e0", "e1": "e3", "e2": "e2", "e3": "e1"}
    seams = tuple(Seam(a, (("front", a),), (("back", b),)) for a, b in partner.items())
    mesh = build(Pattern("cushion", panels, seams), 0.02, "g")
    assert mesh.topology.boundary_loops() == [] and mesh.topology.euler_characteristic == 2
    assert mesh.areas.min() > 0 and mesh.areas.sum() == pytest.approx(0.08)


def test_a_corner_whose_two_sides_are_sewn_together_is_refused_when_too_coarse(polygon_panel):
    panel = polygon_panel("cone", [[0, 0], [0.2, 0.05], [0.2, 0.2], [0.05, 0.2]])
    seam = Seam("s", (("cone", "e0"),), (("cone", "e3"),))
    with pytest.raises(PatternError, match=r"sewn together \(panel 'cone'\)|share an edge \(panel 'cone'\)"):
        build(Pattern("p", {"cone": panel}, (seam,)), 0.25, "g")


def test_faults_of_the_pattern_are_raised_before_meshing(load):
    pattern = load("top_9AR")
    with pytest.raises(PatternError, match="seam 'x': panel 'back' has no edge 'nope'"):
        build(replace(pattern, seams=(*pattern.seams, Seam("x", (("back", "nope"),), (("back", "hem"),)))), 0.02, "g")
