"""Steps of a strip that rubs: it keeps a bend, only accepted steps move its anchors, and its matrix is the Hessian."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tryon import fields, units
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.sheet.mesh import sheet_mesh
from taichi_tryon.sheet.spec import SheetSpec
from taichi_tryon.solver.implicit import ImplicitStep
from taichi_tryon.timing import Stopwatch

EDGE, CLAMP = 0.01, 0.01
HB, HG = 0.03 * units.GF_CM_PER_CM, 0.5 * units.GF_PER_CM


@pytest.fixture(scope="module")
def strip():
    """A strip of 7 by 2 cm, its clamp ending on a line of the mesh."""
    mesh = sheet_mesh(SheetSpec(size_cm=[7, 2], lines_cm=[100 * CLAMP], grain_degree=0), EDGE, "strip")
    points = np.zeros((mesh.vertex_count, 2))
    points[mesh.point_vertex] = mesh.pattern_points
    return SimpleNamespace(mesh=mesh, points=points)


@pytest.fixture(scope="module")
def _rubbing(strip, moduli, floor_and_ball_field, contact, settings):
    held = strip.points[:, 0] < CLAMP + 1e-9
    fabric = replace(moduli, bend_friction=(HB, HB), shear_friction=HG)
    cloth = Cloth.join([(strip.mesh, fabric)]).clamped(held)
    laws = (contact.stiffness, contact.thickness, contact.friction)
    free = np.repeat(~held[:, None], 3, axis=1)
    positions = curved(strip.points, 1e-9)
    # the coarse space takes long to compile
    plain = replace(settings, preconditioner="block_jacobi")
    step = ImplicitStep(cloth, floor_and_ball_field, positions, laws, np.zeros(3), plain, Stopwatch(), free)
    step.compile()
    return step, step.state()


@pytest.fixture
def rubbing(_rubbing):
    """The strip level, as new."""
    step, new = _rubbing
    assert not new["bend_anchors"].any() and not new["shear_anchors"].any()
    step.restore(new)
    return step


def curved(points: np.ndarray, curvature: float) -> np.ndarray:
    """The strip bent up behind its clamp, 5 m above the floor."""
    arc = np.maximum(points[:, 0] - CLAMP, 0) * curvature
    along = np.minimum(points[:, 0], CLAMP) + np.sin(arc) / curvature
    return np.column_stack([along, 5 + (1 - np.cos(arc)) / curvature, -points[:, 1]])


def bent(step, strip, curvature):
    """Bend it by hand: friction slips on the way."""
    fields.upload(step.x, curved(strip.points, curvature))
    for _ in range(20):
        step.elastic.evaluate(0.0)
    step.elastic.end_step()


def test_a_bent_strip_keeps_the_curvature_at_which_friction_holds_it(rubbing, strip, moduli):
    """Let go, it springs back until B k = HB."""
    bent(rubbing, strip, 60.0)
    for dt in (0.03, 0.1, 0.3, 1.0, 1.0, 1.0):
        assert rubbing.step(dt, inertia=0.0).accepted
    x = rubbing.x.to_numpy()
    end = np.abs(strip.points[:, 0] - 0.07) < 1e-9
    chord = x[end].mean(axis=0) - [CLAMP, 5, -0.01]
    # of an arc that leaves the clamp level: tan(turn / 2) is the slope of its chord
    kept = 2 * np.arctan2(chord[1], chord[0]) / (0.07 - CLAMP)
    assert kept == pytest.approx(HB / moduli.bend[0], rel=0.015)


def test_anchors_move_with_accepted_steps_alone(rubbing, strip):
    bent(rubbing, strip, 60.0)
    before = rubbing.elastic.state()
    assert not rubbing.step(0.01, error_limit=1e-12).accepted
    failed = rubbing.elastic.state()
    assert rubbing.step(0.01).accepted
    done = rubbing.elastic.state()
    assert np.array_equal(failed["bend_anchors"], before["bend_anchors"])
    assert not np.array_equal(done["bend_anchors"], before["bend_anchors"])


def test_restored_it_goes_on_with_the_same_bits(rubbing, strip):
    bent(rubbing, strip, 60.0)
    rubbing.step(0.005)
    state, ends = rubbing.state(), []
    for _ in range(2):
        rubbing.restore(state)
        rubbing.step(0.005)
        rubbing.step(0.005)
        ends.append(rubbing.state())
        bent(rubbing, strip, -30.0)  # a history that must be forgotten
    for name, values in ends[0].items():
        assert np.array_equal(values, ends[1][name]), name


def test_the_matrix_holds_the_stiffness_of_shear_where_it_sticks(rubbing, strip, make_forces, as_sparse):
    """In its plane a level strip has no bending, which the matrix knows but roughly."""
    rng = np.random.default_rng(3)
    level = curved(strip.points, 1e-9)
    start = level + rng.normal(size=level.shape) * [5e-5, 0, 5e-5]
    forces, eps = make_forces(rubbing), 1e-9
    direction = rng.normal(size=level.shape) * [1, 0, 1]
    slope = (forces.at(start + eps * direction) - forces.at(start - eps * direction)) / (2 * eps)
    rubbing.x.from_numpy(start)
    rubbing.elastic.begin_step()
    rubbing.elastic.evaluate(0.0)
    stuck = np.abs(rubbing.elastic.strain.to_numpy()[:, 2]) < rubbing.elastic.friction.reach
    assert 0.2 < stuck.mean() < 0.8
    rubbing.potential.matrix.assemble(0.0, exact=True)
    found = (as_sparse(rubbing.potential.matrix) @ direction.ravel()).reshape(-1, 3)
    assert found == pytest.approx(-slope, abs=1e-5 * np.abs(slope).max())


def test_bending_blocks_are_no_softer_than_a_strip_that_sticks(
    rubbing, strip, make_forces, as_sparse, assert_no_softer
):
    level, eps = curved(strip.points, 1e-9), 1e-8
    forces = make_forces(rubbing)
    forces.at(level)
    rubbing.elastic.begin_step()
    rubbing.potential.matrix.assemble(0.0)
    assert_no_softer(as_sparse(rubbing.potential.matrix), forces, level, eps, sweeps=10)
