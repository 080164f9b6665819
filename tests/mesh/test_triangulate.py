import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from taichi_tryon.errors import PatternError
from taichi_tryon.mesh import triangulate as module
from taichi_tryon.mesh.triangulate import corner_angles, signed_areas, triangulate

H = 0.02


def outline(corners, h=H):
    """A polygon with its sides divided into segments no longer than h."""
    corners = np.asarray(corners, dtype=float)
    parts = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = int(np.ceil(np.linalg.norm(b - a) / h - 1e-9))
        parts.append(a + np.arange(count)[:, None] / count * (b - a))
    return np.concatenate(parts)


L_SHAPE = outline([[0, 0], [0.4, 0], [0.4, 0.1], [0.1, 0.1], [0.1, 0.3], [0, 0.3]])
CIRCLE = 0.15 * np.stack([np.cos(np.arange(50) / 25 * np.pi), np.sin(np.arange(50) / 25 * np.pi)], axis=1)


@pytest.mark.parametrize(("polygon", "area"), [(L_SHAPE, 0.06), (CIRCLE, 25 * 0.15**2 * np.sin(np.pi / 25))], ids="Lo")
@pytest.mark.parametrize("sense", [1, -1])
def test_boundary_area_and_angles(polygon, area, sense):
    polygon = polygon[::sense]
    points, triangles = triangulate(polygon, H, "p")
    assert np.array_equal(points[: len(polygon)], polygon)
    areas = signed_areas(points, triangles)
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(area, rel=1e-12)
    assert np.degrees(corner_angles(points[triangles]).min()) > 30
    lengths = np.linalg.norm(points[triangles] - points[np.roll(triangles, -1, axis=1)], axis=2)
    assert 0.8 * H < lengths.mean() < 1.1 * H
    assert lengths.max() < 1.8 * H


def test_neither_sense_nor_start_matters():
    points, triangles = triangulate(L_SHAPE, H, "p")

    def shapes(points, triangles):
        corners = points[triangles]
        first = np.lexsort((corners[..., 1], corners[..., 0]))[:, :1]
        order = (first + np.arange(3)) % 3
        corners = np.take_along_axis(corners, order[..., None], axis=1).reshape(-1, 6)
        return corners[np.lexsort(corners.T)]

    wanted = shapes(points, triangles)
    for other in (L_SHAPE[::-1], np.roll(L_SHAPE, 17, axis=0), np.roll(L_SHAPE, -5, axis=0)[::-1]):
        assert np.array_equal(shapes(*triangulate(other, H, "p")), wanted)


def test_the_same_mesh_every_time_and_in_every_thread():
    wanted = triangulate(CIRCLE, H, "p")
    with ThreadPoolExecutor(4) as pool:
        for points, triangles in pool.map(lambda _: triangulate(CIRCLE, H, "p"), range(8)):
            assert np.array_equal(points, wanted[0]) and np.array_equal(triangles, wanted[1])


def test_sharp_points_keep_their_boundary():
    polygon = outline([[0, 0], [0.3, 0], [0.3, 0.02], [0.1, 0.03], [0.3, 0.04], [0.3, 0.2], [0, 0.2]])
    points, triangles = triangulate(polygon, H, "p")
    assert signed_areas(points, triangles).sum() == pytest.approx(0.06 - 0.002, rel=1e-9)


def test_a_polygon_without_inner_points():
    points, triangles = triangulate(np.array([[0, 0], [0.02, 0], [0.01, 0.018]]), H, "p")
    assert len(points) == 3 and sorted(triangles[0]) == [0, 1, 2]


def test_faults_name_the_panel():
    with pytest.raises(PatternError, match=r"panel 'p': two boundary vertices are 0 cm apart"):
        triangulate(np.array([[0, 0], [0.1, 0], [0.1, 0], [0, 0.1]]), H, "p")
    with pytest.raises(PatternError, match="panel 'p': the outline crosses itself"):
        triangulate(np.array([[0, 0], [0.1, 0.1], [0.1, 0], [0, 0.1]]), H, "p")


def test_a_changed_boundary_is_found(monkeypatch):
    whole = module._netgen

    def loses_a_triangle(polygon, panel):
        points, triangles = whole(polygon, panel)
        return points, triangles[:-1]

    def moves_a_point(polygon, panel):
        return whole(polygon * 1.001, panel)

    monkeypatch.setattr(module, "_netgen", loses_a_triangle)
    with pytest.raises(PatternError, match="panel 'p': the mesher did not keep the boundary"):
        triangulate(CIRCLE, H, "p")
    monkeypatch.setattr(module, "_netgen", moves_a_point)
    with pytest.raises(PatternError, match="panel 'p': the mesher moved the boundary"):
        triangulate(CIRCLE, H, "p")


def test_meshing_is_quiet_and_netgen_is_loaded_only_then():
    code = (
        "import sys, numpy as np\n"
        "from taichi_tryon.mesh.triangulate import triangulate\n"
        "assert 'netgen' not in sys.modules\n"
        "triangulate(np.array([[0, 0], [.02, 0], [.02, .02], [0, .02]]), .02, 'p')\n"
        "assert 'netgen' in sys.modules\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
