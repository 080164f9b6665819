"""How two runs are compared, and one small run of each kind."""

from pathlib import Path

import numpy as np
import pytest

from taichi_tryon.bench import suite
from taichi_tryon.bench.skip import compare, course
from taichi_tryon.bench.skip.compare import Trial, of
from taichi_tryon.bench.skip.course import Course
from taichi_tryon.bench.skip.plot import plot_skips
from taichi_tryon.errors import InputError
from taichi_tryon.scene.load import load_scene

TRIAL = Trial("sleep", "validation/sphere.yaml", ("skip.far_samples=false",), limit_mm=0.5)


@pytest.fixture(autouse=True)
def _in_the_project(monkeypatch):
    monkeypatch.chdir(Path(__file__).parents[3])


def made(height: float, step_s: float, looks: int = 30) -> Course:
    positions = np.array([[0.0, 0, 0], [0, height, 0]])
    return Course(positions, 12, {"step": step_s, "contact": step_s / 2}, 1.0, 40, 100, looks, 120, (1, 2))


def test_times_and_results_are_compared():
    found = list(of(TRIAL, [made(1.0, 0.03), made(1.0, 0.02)], [made(1.0004, 0.05, 60), made(1.0004, 0.04)]))
    values = {record.quantity: record.value for record in found}
    assert values["step_with"] == pytest.approx(20) and values["step_without"] == pytest.approx(40)
    assert values["step_with_over_without"] == values["contact_with_over_without"] == pytest.approx(0.5)
    assert values["looks_at_the_body_with"] == pytest.approx(25) and "balls_listed_with" not in values
    assert values["looks_at_the_body_without"] == pytest.approx(50)
    assert found[-1].quantity == "distance_of_results" and found[-1].value == pytest.approx(0.4)
    assert [record.quantity for record in found if record.limit is not None] == ["distance_of_results"]
    assert found[-1].passes and not list(of(TRIAL, [made(1.0, 0.02)], [made(1.0006, 0.04)]))[-1].passes


def test_ratios_are_drawn(tmp_path):
    (path,) = plot_skips(of(TRIAL, [made(1.0, 0.02)], [made(1.0, 0.04)]), tmp_path)
    assert path.name == "skip.png" and path.stat().st_size > 5000
    assert plot_skips([], tmp_path) == []


def test_every_scene_of_the_suite_can_be_read_with_and_without(monkeypatch):
    trials = [module.TRIAL for name in suite.SUITES["skip"] if hasattr(module := suite._module("skip", name), "TRIAL")]
    assert len(trials) == 8
    for trial in trials:
        path = course.FOLDER / trial.scene
        plain = load_scene(path, trial.overrides)
        assert (
            load_scene(path, trial.overrides + trial.fine)
            and load_scene(path, trial.overrides + trial.without) != plain
        )
    monkeypatch.chdir("/")
    with pytest.raises(InputError, match="no such file; start bench in the project's folder"):
        course.run(TRIAL.scene, (), 0, 1)


def test_a_trial_runs_both_ways_in_turn(monkeypatch):
    asked = []

    def run(function, *arguments):
        asked.append(arguments)
        return made(1.0, 0.02)

    monkeypatch.setattr(compare, "apart", run)
    trial = Trial("sleep", "a scene", ("without",), ("both",), ("fine",), before=4, steps=3)
    assert list(compare.compared(trial, quick=True))[-1].passes
    assert asked == [("a scene", ("both",), 4, 3), ("a scene", ("both", "without"), 4, 3)]
    asked.clear()
    list(compare.compared(trial, quick=False))
    assert [more for _, more, _, _ in asked] == [("both", "fine"), ("both", "fine", "without")] * compare.REPEATS


def test_a_course_is_measured(monkeypatch):
    """As coarse as it gets; Taichi runs already."""
    monkeypatch.setattr(course.runtime, "start", lambda *arguments, **options: None)
    found = course.run("validation/sphere.yaml", ("mesh.edge_length_mm=30", "settle.max_steps=0"), 10, 5)
    assert found.steps == 2 and found.positions.shape[1] == 3
    assert 0 < found.seconds["contact"] < found.seconds["step"] and found.kernels > 20
    assert 0 < found.looks <= found.chances and found.balls == (1, 1) and found.linear_iterations > 0
