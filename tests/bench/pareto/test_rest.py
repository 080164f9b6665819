"""A way to rest, held against a converged one."""

import numpy as np
import pytest

from taichi_tryon.bench.pareto import reference, rest
from taichi_tryon.bench.pareto.falls import AS_IS
from taichi_tryon.bench.pareto.ours import Setting
from taichi_tryon.errors import RunError
from taichi_tryon.scene.load import load_scene

PATH = "configs/validation/cantilever.yaml"
# here and elsewhere without the coarse space, which takes long to compile
COARSE = (
    "mesh.edge_length_mm=10",
    "settle.residual=1e-3",
    "solver.newton_tolerance=1e-3",
    "solver.preconditioner=block_jacobi",
)


def test_records_hold_each_setting_against_the_converged_way(tmp_path, monkeypatch):
    ways = []

    def run(function, path, setting):
        ways.append(setting.overrides)
        if setting.name == "broken":
            raise RunError("not at rest")
        frame = np.zeros(1)
        return rest.Track(np.full((2, 3), float(len(ways))), frame, frame, frame, 0.5, 1.0, 1.0)

    monkeypatch.setattr(reference, "FOLDER", tmp_path)
    monkeypatch.setattr(rest, "apart", run)
    settings = (AS_IS, Setting("broken", ("solver.step_s=0.1",)))
    found = list(rest.records("strip", PATH, 10.0, ("settle.residual=1e-7",), ("settle.residual=1e-6",), settings))
    assert ways[0] == ("mesh.edge_length_mm=10.0", "settle.residual=1e-7")
    assert ways[1] == (*ways[0], "settle.residual=1e-6") and ways[2] == ways[0][:1]
    assert found[0].value == pytest.approx(1000 * np.sqrt(3))
    error = next(record for record in found if record.quantity == "position_error")
    assert error.value == pytest.approx(2000 * np.sqrt(3)) and error.parameters["setting"] == "as is"
    assert (found[-1].quantity, found[-1].parameters["setting"]) == ("failed", "broken")


def test_a_strip_comes_to_rest_and_is_looked_at_there():
    track = rest.follow(load_scene(PATH, COARSE))
    assert -0.05 < track.lowest[0] < -0.01 and track.frames == 1 and track.depth == [0.0]
    assert 0 < track.cpu_s and 0 < track.wall_s and track.strain[0] < 0.01


def test_what_does_not_come_to_rest_is_a_failed_run():
    with pytest.raises(RunError, match="cantilever: not at rest after 1 steps"):
        rest.follow(load_scene(PATH, (*COARSE, "settle.max_steps=1")))
