"""A clamped area keeps its border's slope."""

import numpy as np
import pytest
import taichi as ti

from taichi_tryon import fields
from taichi_tryon.cloth.elastic import Elastic
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.sheet.mesh import sheet_mesh
from taichi_tryon.sheet.spec import SheetSpec

RADIUS, LINE = 0.1, 0.02


@pytest.fixture(scope="module")
def strip():
    return sheet_mesh(SheetSpec(size_cm=[6, 2], lines_cm=[2], grain_degree=0), 0.005, "strip")


@pytest.fixture(scope="module")
def clamped(strip, moduli):
    along = np.zeros(strip.vertex_count)
    along[strip.point_vertex] = strip.pattern_points[:, 0]
    held = along <= LINE + 1e-9
    return Cloth.join([(strip, moduli)]).clamped(held), along, held


def rolled(along, across) -> np.ndarray:
    """Flat up to the line, beyond it bent to a circle."""
    angle = np.maximum(along - LINE, 0) / RADIUS
    x = np.minimum(along, LINE) + RADIUS * np.sin(angle)
    return np.column_stack([x, across, -RADIUS * (1 - np.cos(angle))])


def test_only_the_area_cannot_bend(clamped):
    cloth, along, held = clamped
    rigid = held[cloth.triangles].all(axis=1)
    assert rigid.any() and np.array_equal(rigid, ~cloth.edge_stiffness.any(axis=(1, 2)))
    first, second = cloth.hinge_triangles.T
    beside = rigid[first] | (rigid[second] & (second >= 0))
    assert np.array_equal(cloth.edge_clamps != 0, beside)


def test_bent_from_the_line_on_it_stores_what_the_rest_stores(clamped, strip, moduli):
    """B / 2 R^2 for every area beyond the line; the clamp holds the slope, so nothing is spread across the line."""
    cloth, along, _ = clamped
    across = np.zeros(strip.vertex_count)
    across[strip.point_vertex] = strip.pattern_points[:, 1]
    x = ti.Vector.field(3, float, shape=cloth.vertex_count)
    fields.upload(x, rolled(along, across))
    elastic = Elastic(cloth, x)
    for _ in range(40):
        elastic.evaluate(0.0)
    exact = moduli.bend[0] / (2 * RADIUS**2) * 0.04 * 0.02
    # at the other end nothing holds the normals: they give way over half a triangle
    assert elastic.energies()[2] == pytest.approx(exact, rel=0.08)
    clamp, spread, rotation = (
        cloth.edge_clamps,
        elastic.bending.hinges.spread.to_numpy(),
        elastic.bending.rotation.to_numpy()[0],
    )
    assert np.abs(spread[clamp != 0]).max() > 0.01
    assert rotation[clamp != 0] == pytest.approx(-0.5 * (clamp * spread)[clamp != 0])


def test_forces_are_the_energys_gradient(clamped, strip):
    cloth, along, held = clamped
    across = np.zeros(strip.vertex_count)
    across[strip.point_vertex] = strip.pattern_points[:, 1]
    start = rolled(along, across)
    x, force = (ti.Vector.field(3, float, shape=cloth.vertex_count) for _ in range(2))
    fields.upload(x, start)
    elastic = Elastic(cloth, x)

    @ti.kernel
    def gather():
        for i in force:
            force[i] = elastic.force(i)

    def energy(positions) -> float:
        fields.upload(x, positions)
        for _ in range(60):
            elastic.evaluate(0.0)
        return float(elastic.energies()[:3].sum())

    direction = np.random.default_rng(1).normal(size=start.shape) * ~held[:, None]
    step = 1e-8
    slope = (energy(start + step * direction) - energy(start - step * direction)) / (2 * step)
    energy(start)
    gather()
    assert -(force.to_numpy() * direction).sum() == pytest.approx(slope, rel=1e-4)
