"""The constant matrix of bending: its energy on cylinders, rigid motions, seams, clamps, and its derivatives."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import taichi as ti

from taichi_tryon.cloth.constant import matrix
from taichi_tryon.cloth.elastic import Elastic
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.sheet.mesh import sheet_mesh
from taichi_tryon.sheet.spec import SheetSpec

# unlike along warp and weft, and with a coupling, so that no term can be missed
BEND = np.array([1.4e-5, 1.0e-5, 2.0e-6, 3.7e-6])


@pytest.fixture(scope="module")
def sheet(make_sheet):
    return make_sheet(0.12, 0.1, 0.006)


@pytest.fixture(scope="module")
def fabric(moduli):
    return replace(moduli, bend=BEND)


def energy(q, positions) -> float:
    return 0.5 * float((positions * (q @ positions)).sum())


def rolled(points, degrees, radius) -> np.ndarray:
    """Points (n, 2) on a cylinder whose curved direction lies at an angle to the first axis."""
    along = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    s = points @ along / radius
    return np.column_stack([radius * np.sin(s), radius * np.cos(s), points @ [-along[1], along[0]]])


def rigidity(degrees) -> float:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return BEND[0] * c**4 + 2 * (BEND[2] + 2 * BEND[3]) * s**2 * c**2 + BEND[1] * s**4


@pytest.mark.parametrize("degrees", [0, 30, 45, 90, 120])
def test_a_cylinder_stores_half_b_over_r_squared(sheet, fabric, degrees):
    q = matrix(Cloth.join([(sheet, fabric)]))
    exact = 0.5 * rigidity(degrees) / 0.1**2 * sheet.areas.sum()
    # across free borders the curvature is let go, on half a triangle's width
    assert energy(q, rolled(sheet.points, degrees, 0.1)) == pytest.approx(exact, rel=0.08)


def test_rigid_motions_and_flat_stretch_cost_nothing(sheet, fabric):
    q = matrix(Cloth.join([(sheet, fabric)]))
    bent = rolled(sheet.points, 30, 0.1)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    assert energy(q, bent @ turn.T + [1.0, -2.0, 3.0]) == pytest.approx(energy(q, bent), rel=1e-9)
    flat = sheet.points @ np.random.default_rng(1).normal(size=(2, 3))
    assert abs(energy(q, flat)) < 1e-9 * energy(q, bent)
    assert np.linalg.eigvalsh(q.toarray()).min() > -1e-12 * abs(q).max()


def two_panels(sheet, degrees, cut) -> tuple:
    """The sheet cut along the edges nearest to ``cut`` of its width, the right part's material axes turned."""
    right = sheet.rest.mean(axis=1)[:, 0] > cut
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turned = sheet.rest @ np.array([[c, -s], [s, c]]) + [0.7, -0.2]
    return right, np.where(right[:, None, None], turned, sheet.rest)


def test_a_level_seam_is_no_seam(sheet, fabric):
    """Two panels of an isotropic fabric sewn as they were cut bend as one piece, whatever their axes."""
    isotropic = replace(fabric, bend=np.array([1e-5, 1e-5, 3e-6, 3.5e-6]))
    _, rest = two_panels(sheet, 40, 0.06)
    sewn = type(sheet)(**{**vars(sheet), "rest": rest})
    whole, parts = (matrix(Cloth.join([(mesh, isotropic)])) for mesh in (sheet, sewn))
    assert abs(whole - parts).max() < 1e-9 * abs(whole).max()


def test_across_a_seam_each_panel_bends_by_its_own_axes(sheet, fabric):
    """Warp runs along the bend on the left, across it on the right."""
    right, rest = two_panels(sheet, 90, 0.06)
    q = matrix(Cloth.join([(type(sheet)(**{**vars(sheet), "rest": rest}), fabric)]))
    share = sheet.areas[right].sum(), sheet.areas[~right].sum()
    exact = (share[0] * rigidity(90) + share[1] * rigidity(0)) / (2 * 0.1**2)
    assert energy(q, rolled(sheet.points, 0, 0.1)) == pytest.approx(exact, rel=0.05)


def test_a_tube_has_no_seam(fabric):
    """Sewn to itself along its height, a sheet on its own cylinder bends everywhere alike."""
    radius = 0.05
    size = [200 * np.pi * radius, 6]
    mesh = sheet_mesh(SheetSpec(size_cm=size, tube_radius_cm=100 * radius, grain_degree=0), 0.006, "tube")
    points = np.zeros((mesh.vertex_count, 2))
    points[mesh.point_vertex] = mesh.pattern_points
    q = matrix(Cloth.join([(mesh, fabric)]))
    exact = BEND[0] / (2 * radius**2) * mesh.areas.sum()
    assert energy(q, rolled(points, 0, radius)) == pytest.approx(exact, rel=0.04)


def test_behind_a_clamp_nothing_bends_and_its_slope_is_held(fabric):
    mesh = sheet_mesh(SheetSpec(size_cm=[6, 2], lines_cm=[2], grain_degree=0), 0.0025, "strip")
    along, across = mesh.pattern_points[np.unique(mesh.point_vertex, return_index=True)[1]].T
    cloth = Cloth.join([(mesh, fabric)]).clamped(along <= 0.02 + 1e-9)
    exact = BEND[0] / (2 * 0.1**2) * 0.04 * 0.02
    angle = np.maximum(along - 0.02, 0) / 0.1
    curve = np.column_stack([np.minimum(along, 0.02) + 0.1 * np.sin(angle), across, 0.1 * np.cos(angle)])
    assert energy(matrix(cloth), curve) == pytest.approx(exact, rel=0.04)
    # a fold along the line alone, of half a triangle's turn
    fold = np.column_stack([along, across, -0.1 * np.maximum(along - 0.02, 0)])
    assert energy(matrix(cloth), fold) > 1.5 * energy(matrix(Cloth.join([(mesh, fabric)])), fold)


@pytest.fixture(scope="module", params=[0.0, 0.01], ids=["elastic", "with friction"])
def law(request, make_sheet, fabric):
    coarse = make_sheet(0.12, 0.1, 0.02)
    cloth = Cloth.join([(coarse, replace(fabric, damping_time=request.param))], "constant")
    elastic = Elastic(cloth, ti.Vector.field(3, float, shape=cloth.vertex_count))
    force = ti.Vector.field(3, float, shape=cloth.vertex_count)

    @ti.kernel
    def gather():
        for i in force:
            force[i] = elastic.force(i)

    def at(positions, inverse_dt=0.0):
        elastic.x.from_numpy(positions)
        elastic.evaluate(inverse_dt)
        gather()
        return elastic.energies(inverse_dt), force.to_numpy()

    rng = np.random.default_rng(4)
    start = (
        np.column_stack([coarse.points, np.zeros(len(coarse.points))]) + rng.normal(size=(len(coarse.points), 3)) * 1e-3
    )
    return cloth, elastic, at, start, rng.normal(size=start.shape)


def test_force_is_minus_the_gradient(law):
    _, elastic, at, start, direction = law
    at(start)
    elastic.begin_step()
    moved = start + 1e-4 * direction[::-1]
    eps = 1e-7
    slope = (at(moved + eps * direction, 60.0)[0].sum() - at(moved - eps * direction, 60.0)[0].sum()) / (2 * eps)
    assert -(at(moved, 60.0)[1] * direction).sum() == pytest.approx(slope, rel=1e-6)


def test_bending_energy_is_that_of_the_matrix(law):
    cloth, elastic, at, start, _ = law
    energies, _ = at(start)
    assert energies[2] == pytest.approx(energy(matrix(cloth), start), rel=1e-6)
    half = len(cloth.triangles) // 2
    parts = elastic.energies(triangles=slice(0, half)) + elastic.energies(triangles=slice(half, len(cloth.triangles)))
    assert parts[:3] == pytest.approx(energies[:3], rel=1e-9)


def test_what_friction_does_in_parts_adds_up(law):
    cloth, elastic, at, start, direction = law
    at(start)
    elastic.begin_step()
    at(start + 1e-3 * direction, 60.0)
    third = len(cloth.triangles) // 3
    parts = elastic.energies(60.0, slice(0, third)) + elastic.energies(60.0, slice(third, len(cloth.triangles)))
    assert parts == pytest.approx(elastic.energies(60.0), rel=1e-9)


# In single precision: the energy of a rolled sheet near the origin and 8 m off, on a grid that both are exact on.
FAR_OFF = """
import json
import numpy as np
import taichi as ti
from taichi_tryon import fields, runtime
from taichi_tryon.cloth.constant import Constant, matrix
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.fabric import Moduli
from taichi_tryon.sheet.mesh import sheet_mesh
from taichi_tryon.sheet.spec import SheetSpec

runtime.start("cpu", "f32", 1)
mesh = sheet_mesh(SheetSpec(size_cm=[10, 10], grain_degree=0), 0.01, "sheet")
moduli = Moduli(np.array([2392.8, 2373.2, 0.0, 77.54]), np.array([1.4e-5, 1.0e-5, 0.0, 3.7e-6]), 0.29, 0.0)
cloth = Cloth.join([(mesh, moduli)], "constant")
x, tables = ti.Vector.field(3, float, shape=cloth.vertex_count), fields.Tables()
law = Constant(cloth, x, tables)
tables.fill()
sums = ti.field(ti.f64, shape=fields.CHUNKS)

@ti.kernel
def energy():
    for chunk in range(fields.CHUNKS):
        sums[chunk] = law.energy(chunk, 0, len(cloth.triangles))

flat = np.zeros((cloth.vertex_count, 2))
flat[mesh.point_vertex] = mesh.pattern_points
rolled = np.column_stack([0.1 * np.sin(flat[:, 0] / 0.1), flat[:, 1], 0.1 * np.cos(flat[:, 0] / 0.1)])
rolled = np.round(rolled * 2**18) / 2**18
found = []
for shift in (0.0, 8.0):
    fields.upload(x, rolled + shift)
    law.evaluate(0.0)
    energy()
    found.append(float(sums.to_numpy().sum()))
print(json.dumps([*found, 0.5 * float((rolled * (matrix(cloth) @ rolled)).sum())]))
"""


def test_in_single_precision_the_energy_is_the_same_far_off(tmp_path):
    """In a process of its own, which starts Taichi anew."""
    script = tmp_path / "far_off.py"
    script.write_text(FAR_OFF)
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run([sys.executable, script], check=True, timeout=300, capture_output=True, env=environment)
    near, far, exact = json.loads(done.stdout.splitlines()[-1])
    assert far == near and near == pytest.approx(exact, rel=1e-5)


def test_forces_and_moments_balance(law):
    _, _, at, start, _ = law
    _, force = at(start)
    scale = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * scale
    assert np.abs(np.cross(start, force).sum(axis=0)).max() < 1e-9 * scale


def test_a_single_triangle_has_nothing_to_bend_across(fabric):
    mesh = sheet_mesh(SheetSpec(outline_cm=[[0, 0], [3, 0], [0, 3]]), 0.03, "triangle")
    cloth = Cloth.join([(mesh, fabric)], "constant")
    assert len(cloth.triangles) == 1
    elastic = Elastic(cloth, ti.Vector.field(3, float, shape=3))
    elastic.x.from_numpy(np.column_stack([1.01 * mesh.pattern_points, np.zeros(3)]))
    elastic.evaluate(0.0)
    energies = elastic.energies()
    assert energies[0] > 0 and energies[2] == 0
