"""``view``: the simulation behind the window, and the window itself where there is a screen to open it on."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from taichi_tryon import stage
from taichi_tryon.errors import RunError
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.setup import prepare
from taichi_tryon.simulation import Simulation
from taichi_tryon.timing import Stopwatch
from taichi_tryon.window import Live, view_scene

ROOT = Path(__file__).parents[1]
KEYS = """
from taichi_tryon.view.orbit import Controls
from taichi_tryon.cli import main
from taichi_tryon.window import Live
keys = iter([None, None, "n", "n", "r", None, None, "Right", " ", None, "Escape"])
status = Live.status

def press_instead(self, *_):
    if (key := next(keys)):
        self.press(key)

def say(self):
    print(status(self))
    return status(self)

Controls.mouse, Live.status = press_instead, say
main(["view", "scene.yaml", "--arch", "cpu"])
"""


@pytest.fixture(scope="module")
def cone(make_cone_scene) -> dict:
    """Without the coarse space, which takes long to compile."""
    return {**make_cone_scene(), "solver": {"preconditioner": "block_jacobi"}}


@pytest.fixture(scope="module")
def only_live(cone):
    clock = Stopwatch()
    return Live(Simulation(prepare(SceneSpec.model_validate(cone), clock), clock))


@pytest.fixture
def live(only_live):
    """At the start again for each test: making a new one compiles for long."""
    only_live.reset()
    return only_live


def test_steps_reset_and_the_same_steps_again(live):
    start = live.meshes()[1].vertices.copy()
    assert live.status() == "dress   0.00 s"
    assert live.step() and live.step()
    moved, status = live.meshes()[1].vertices.copy(), live.status()
    assert np.abs(moved - start).max() > 1e-4 and status != "dress   0.00 s"
    live.reset()
    assert live.status() == "dress   0.00 s"
    np.testing.assert_array_equal(live.meshes()[1].vertices, start)
    assert live.step() and live.step()
    np.testing.assert_array_equal(live.meshes()[1].vertices, moved)


def test_to_the_end_and_no_further(live):
    for _ in range(1000):
        if not live.step():
            break
    steps = live.simulation.progress.steps
    assert live.simulation.finished and not live.step() and live.simulation.progress.steps == steps
    assert "net force" in live.status() and live.status().startswith("done")
    live.reset()
    assert live.step()


def test_a_step_that_fails_ends_it_until_reset(live, monkeypatch):
    def fail():
        raise RunError("no step is small enough")

    with monkeypatch.context() as patch:
        patch.setattr(live.simulation, "advance", fail)
        assert not live.step()
        assert live.status() == "no step is small enough"
    assert not live.step()
    live.reset()
    assert live.step() and live.status().startswith("dress")


def test_bounds_hold_body_and_garments(live):
    low, high = stage.bounds(live.simulation.setup)
    body, cone = (mesh.vertices for mesh in live.meshes())
    assert (cone >= low).all() and (cone <= high).all()
    # the body's are estimated
    assert (body >= low - 0.03).all() and (body <= high + 0.03).all()


def test_without_a_display_nothing_is_prepared(make_cone_scene, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr("taichi_tryon.window.prepare", None)
    with pytest.raises(RunError, match="no display"):
        view_scene(SceneSpec.model_validate(make_cone_scene()))


@pytest.mark.skipif(not shutil.which("Xvfb"), reason="no Xvfb here")
def test_window_runs_resets_and_closes(cone, tmp_path):
    (tmp_path / "scene.yaml").write_text(json.dumps(cone))
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x1024x24"]
    server = subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL)
    try:
        os.close(write)
        with os.fdopen(read) as display:
            environment = os.environ | {"DISPLAY": f":{display.readline().strip()}", "PYTHONPATH": str(ROOT)}
        result = subprocess.run(
            [sys.executable, "-c", KEYS], env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=120
        )
    finally:
        server.terminate()
        server.wait()
    if "no GGUI" in result.stderr:
        pytest.skip("no Vulkan here")
    assert result.returncode == 0, result.stderr
    times = [float(line.split()[1]) for line in result.stdout.splitlines()]
    back = next(i for i in range(1, len(times)) if times[i] < times[i - 1])
    assert 0 < times[0] < times[back - 1] and times[back] == 0 < times[-1]
    assert [path.name for path in tmp_path.iterdir()] == ["scene.yaml"]
