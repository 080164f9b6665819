"""Records of costs that are known, and the measurements themselves at tiny sizes."""

import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tryon.bench.cost import balls, bandwidth, growth, layers, stages, step
from taichi_tryon.bench.cost.plot import plot_growth
from taichi_tryon.bench.cost.step import StepCost
from taichi_tryon.errors import RunError


def cost(vertices: int, exponent: float = 1.1, iterations: float = 10.0, each: int = 3000) -> StepCost:
    seconds = 1e-5 * vertices**exponent
    memory = 100_000_000 + each * vertices
    return StepCost(vertices, seconds, 2 * seconds, 2.0, iterations, memory, {})


def pair(layered: list[float], touching: int) -> layers.Pair:
    return layers.Pair(9, np.array(layered), np.array([0.01, 0.02, 0.03]), touching)


def test_layers_are_judged_by_the_median_of_frames_of_the_same_moment():
    free, folds = layers.CASES["nothing touches"], layers.CASES["folds"]
    # a frame that was disturbed does not count
    found = judged(layers.of("sheet", free, pair([0.012, 0.024, 3.0], 0)))
    assert found == {"pairs_in_contact": (0, True), "with_over_without": (pytest.approx(1.2), True)}
    slow = judged(layers.of("sheet", free, pair([0.014, 0.028, 0.042], 3)))
    assert slow == {"pairs_in_contact": (3, False), "with_over_without": (pytest.approx(1.4), False)}
    assert judged(layers.of("skirt", folds, pair([0.014, 0.028, 0.042], 49)))["pairs_in_contact"] == (49, False)


class Going:
    """A simulation that needs two steps for every other frame of its only phase, in which more and more touches."""

    def __init__(self, courses: list, which: str):
        self.courses, self.layered = courses, which == layers.WITH
        self.progress = SimpleNamespace(phase="drape", phase_time=0.0)
        self.scene, self.finished, self.steps = SimpleNamespace(scene="sheet"), False, 0
        self.setup = SimpleNamespace(cloth=SimpleNamespace(vertex_count=9))
        self.stepper = SimpleNamespace(layers=SimpleNamespace(touching=np.zeros(30, bool)))

    def advance(self):
        self.steps += 1
        self.progress.phase_time = [0, 1, 1.5, 2, 3, 3.5, 4][self.steps] * 0.01
        self.stepper.layers.touching[: 5 * self.steps] = True
        self.courses.append((self.layered, self.progress.phase_time / 0.01))
        self.finished = self.steps == 6

    def state(self):
        return self.steps, self.progress.phase_time

    def restore(self, state):
        self.steps, self.progress.phase_time = state


def test_both_go_in_turns_through_the_same_frames_from_where_one_was_led(monkeypatch):
    courses = []
    monkeypatch.setattr(layers, "_simulation", lambda case, edge, which: Going(courses, which))
    case = replace(layers.CASES["nothing touches"], frame_s=0.01, skipped=1, frames=2)
    found = layers.followed(case, 20.0)
    ways = [(True, 1), (False, 1.5), (False, 2), (True, 1.5), (True, 2), (True, 3), (False, 3)]
    assert courses == [(which, pytest.approx(frame)) for which, frame in ways]
    assert (found.vertices, found.touching, len(found.layered), len(found.plain)) == (9, 20, 2, 2)
    with pytest.raises(RunError, match="phase drape has not as many frames as 5"):
        layers.followed(replace(case, frames=4), 20.0)


def judged(records) -> dict:
    return {record.quantity: (record.value, record.passes) for record in records if record.limit is not None}


def test_growth_is_fitted_and_judged():
    found = list(growth.of([cost(2_500), cost(10_000), cost(40_000, iterations=19.0)]))
    assert judged(found) == {
        "exponent_of_time": (pytest.approx(1.1), True),
        "memory_of_a_further_vertex": (pytest.approx(3.0), True),
        "linear_iterations_times": (pytest.approx(1.9), True),
    }
    worse = growth.of([cost(2_500, 1.2), cost(40_000, 1.2, iterations=21.0, each=5000)])
    assert [passes for _, passes in judged(worse).values()] == [False, False, False]


def test_growth_is_drawn(tmp_path):
    records = list(growth.of([cost(2_500), cost(10_000)]))
    (path,) = plot_growth(records, tmp_path)
    assert path.name == "growth.png" and path.stat().st_size > 5000
    assert plot_growth([], tmp_path) == []


def test_stages_are_modules_and_the_rest():
    kernels = {
        "taichi_tryon.solver.matrix.Matrix._assemble": 0.4,
        "taichi_tryon.solver.matrix.Matrix._other": 0.1,
        "taichi._kernels.fill_field": 0.2,
    }
    found = list(stages.of(StepCost(25, 1.0, 1.0, 2.0, 10.0, 0, kernels)))
    times = {record.parameters["of"]: record.value for record in found}
    assert times == pytest.approx(
        {
            "all": 1000,
            "solver.matrix": 500,
            "taichi": 200,
            "launches, Python, LAPACK": 300,
            "solver.matrix.Matrix._assemble": 400,
            "solver.matrix.Matrix._other": 100,
            "taichi._kernels.fill_field": 200,
        }
    )


def test_a_step_is_measured():
    found = step.swing(6, timed=2)
    assert found.vertices == 36 and found.wall_s > 0 and found.cpu_s > 0
    assert found.newton_iterations >= 1 and found.linear_iterations >= 5 and found.memory >= 0


def test_time_is_given_to_the_method_whose_kernel_ran(tmp_path):
    script = tmp_path / "sums.py"
    script.write_text(
        "import taichi as ti\n"
        "from taichi_tryon import runtime\n"
        "from taichi_tryon.bench.cost.step import profiled\n"
        "runtime.start('cpu', offline_cache=False, profile=True)\n"
        "x = ti.field(float, 100_000)\n"
        "@ti.data_oriented\n"
        "class One:\n"
        "    @ti.kernel\n"
        "    def _add(self):\n"
        "        for i in x:\n"
        "            x[i] += ti.sin(x[i])\n"
        "one = One()\n"
        "one._add()\n"
        "ti.profiler.clear_kernel_profiler_info()\n"
        "one._add()\n"
        "print(*(f'{name} {seconds > 1e-5}' for name, seconds in profiled().items()))\n"
    )
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=60)
    assert done.stdout == "__main__.One._add True\n", done.stderr


def test_the_product_is_held_against_a_triad():
    found = {record.quantity: record for record in bandwidth.of(6, 1 << 12)}
    share = found["product_bandwidth"].value / found["triad"].value
    assert found["share_of_triad"].value == pytest.approx(100 * share) and found["share_of_triad"].limit == 60.0
    # 36 vertices: at least all pairs along the triangles' 85 edges, there and back
    assert found["product_bytes"].value * 1e6 >= 170 * 40 + 36 * (40 + 72)


def test_the_block_of_balls_keeps_its_volume():
    for grid in (balls.GRIDS[0], balls.GRIDS[2]):
        block = balls.block(grid)
        assert len(block.balls.weights) == np.prod(grid)
        assert balls.volume(block) == pytest.approx(balls.VOLUME, rel=0.01)


def test_a_query_takes_time():
    assert 1e-9 < balls.query(balls.block((2, 3, 2)), points=1000) < 1e-3
