"""Where a failure is seen in the flat pattern, and that each advice comes with what it is for."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tryon.failure import explain
from taichi_tryon.output.observation import Inspection
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.simulation import Progress


@pytest.fixture
def scene(make_cone_scene):
    return SceneSpec.model_validate(make_cone_scene())


def garment(name, holds=()):
    """Two panels, sewn along the edge from vertex 1 to 2."""
    mesh = SimpleNamespace(
        panel_names=("front", "back"),
        point_vertex=np.array([0, 1, 2, 2, 1, 3]),
        point_panel=np.array([0, 0, 0, 1, 1, 1]),
        pattern_points=np.array([[0, 0], [0.1, 0], [0, 0.1], [0, 0], [0.1, 0], [0.123, 0.05]]),
    )
    return SimpleNamespace(name=name, mesh=mesh, spec=SimpleNamespace(holds=holds))


def inspection(forces, pressure=100.0, depths=(0.0, 0.0)):
    """Of such a garment, lying in the plane z = 0.5 m."""
    positions = np.array([[0, 0, 0.5], [0.1, 0, 0.5], [0, 0.1, 0.5], [0.1, 0.1, 0.5]])
    arrays = {key: np.zeros(4) for key in ("gaps", "pressures", "inside", "samples", "contact_areas")}
    return Inspection(
        name="",
        triangles=np.array([[0, 1, 2], [1, 3, 2]]),
        positions=positions,
        velocities=np.full((4, 3), [0.003, 0, 0.004]),
        strains={},
        net_forces=np.array(forces, float)[:, None] * [0, 1.0, 0],
        weights=np.full(4, 0.05),
        contact_pressures=np.array([pressure]),
        contact_forces=np.zeros((4, 3)),
        normal_force=np.zeros(3),
        skin_pressures=np.zeros(0),
        skin_areas=np.zeros(0),
        energies={},
        crossings=np.zeros((0, 2)),
        depths=np.array(depths),
        **arrays,
    )


def found(scene, progress, residuals=(), forces=(0, 0, 0, -0.003), rounding=0.0, meeting=lambda _: None, **options):
    garments, seen = [garment("in"), garment("out")], [inspection([0, 0, 0, 0]), inspection(forces, **options)]
    return explain(scene, garments, seen, progress, residuals, rounding, meeting)


DONE = Progress(phase="done", steps=9, rejected=2, moved=0.002, residual=0.06)


def test_the_spot_is_the_vertex_with_the_greatest_net_force(scene):
    failure = found(scene, DONE)
    assert (failure.garment, failure.panel) == ("out", "back")
    assert failure.at_cm == (12.3, 5.0) and failure.world_cm == (10.0, 10.0, 50.0)
    assert np.allclose(failure.outward, [0, 0, 1])
    assert failure.seen == {
        "phase": "settle",
        "residual_relative": pytest.approx(0.003 / (0.05 * np.sqrt(8)), rel=1e-5),
        "net_force_mN": 3.0,
        "speed_max_mm_s": 5.0,
        "last_move_mm": 2.0,
        "steps": 9,
        "rejected_steps": 2,
    }
    first, second = failure.lines().split("\n")
    assert first == (
        "worst in out, panel back, at (12.3, 5) cm: net force 3 mN, 2 mm in the last step, 2 of 11 steps rejected "
        "(images/failed.png)"
    )
    assert second == f"try: {'; '.join(failure.advice)}"


def test_limbs_that_run_into_each_other_are_named_first(scene):
    asked = []
    first = found(scene, DONE, meeting=lambda at: asked.append(tuple(at)) or ("arm_l", "leg_l")).advice[0]
    assert first == "a pose that keeps arm_l and leg_l apart, which run into each other there"
    assert asked == [(0.1, 0.1, 0.5)]


def test_of_cloth_that_rests_in_the_body_the_spot_is_the_deepest(scene):
    rests = Progress(phase="done", residual=0.5 * scene.settle.residual)
    failure = found(scene, rests, depths=(2e-3, 1e-3))
    assert failure.at_cm == (0.0, 0.0) and failure.seen["net_force_mN"] == 0.0
    assert failure.seen["depth_mm"] == 2.0 and failure.advice[0] == "a start further off the body there"


def test_of_cloth_that_cannot_come_out_of_the_body_the_depth_is_told(scene):
    failure = found(scene, DONE, [0.06] * 20, depths=(0.0, 5e-3))
    assert failure.at_cm == (12.3, 5.0) and failure.seen["depth_mm"] == 5.0
    assert failure.advice[0] == "a start further off the body there" and "longer motion" in failure.advice[1]
    assert "depth_mm" not in found(scene, DONE, [0.06] * 20, depths=(0.0, 5e-4)).seen


def test_a_force_that_is_not_a_number_is_worst(scene):
    assert found(scene, DONE, forces=(0, np.nan, 0, 1)).at_cm == (10.0, 0.0)


def test_a_force_that_falls_asks_for_more_steps(scene):
    # by a factor of e in 10 steps, a factor of 100 above the limit of 0.01
    (advice,) = found(scene, DONE, list(np.exp(-np.arange(21) / 10) * np.e**2)).advice
    assert advice == "settle.max_steps=300, for the net force still falls"  # 200 and 2 * 46, rounded up


def test_one_that_does_not_fall_asks_for_something_else(scene):
    advice = found(scene, DONE, [0.06] * 20).advice
    assert [line.split("=")[0] for line in advice[:1]] == ["settle.max_steps"]
    assert "a finer mesh.edge_length_mm than 30" in advice[1]
    assert advice[2].startswith("settle.residual=0.072, ")
    far = Progress(phase="done", residual=2.0)
    assert not [line for line in found(scene, far, [2.0] * 20).advice if "residual=" in line]


def test_a_force_that_is_rounding_asks_for_more_digits(scene):
    solver = scene.solver.model_copy(update={"precision": "f32"})
    single = scene.model_copy(update={"solver": solver})
    failure = found(single, DONE, [0.06] * 20, rounding=0.04)
    assert failure.seen["rounding_relative"] == 0.04
    assert [line.split(",")[0] for line in failure.advice] == ["solver.precision=f64", "settle.residual=0.08"]
    assert "rounding_relative" not in found(single, DONE, [0.06] * 20, rounding=0.004).seen


def test_what_nothing_carries_falls(scene):
    (advice,) = found(scene, DONE, pressure=0.0).advice
    assert advice.startswith("a hold for out or a body below it")


@pytest.mark.parametrize(("phase", "words"), [("dress", "ease"), ("drape", "min_step_s=1e-06"), ("move", "motion.0")])
def test_a_step_that_cannot_be_done(scene, phase, words):
    failure = found(scene, Progress(phase=phase, dt=1e-6))
    assert words in " ".join(failure.advice) and failure.seen["step_s"] == 1e-6


def test_settings_that_stand_in_the_way(scene):
    solver = scene.solver.model_copy(update={"precision": "f32", "error_mm": 1.0})
    scene = scene.model_copy(update={"solver": solver})
    cut = Progress(phase="drape", newton_iterations=10, linear_iterations=5000)
    advice = " ".join(found(scene, cut).advice)
    for words in ("solver.precision=f64", "solver.max_linear_iterations=2000", "solver.error_mm than 1"):
        assert words in advice
