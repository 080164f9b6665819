"""The same sheet in MuJoCo."""

from importlib.util import find_spec
from xml.etree import ElementTree

import numpy as np
import pytest

from taichi_tryon.bench.pareto import ours, peer, sphere, sphere_layers
from taichi_tryon.bench.pareto.hang import problem
from taichi_tryon.bench.pareto.peer import PeerSetting
from taichi_tryon.bench.pareto.reference import converged, distance
from taichi_tryon.errors import InputError
from taichi_tryon.setup import prepare
from taichi_tryon.timing import Stopwatch

needs_mujoco = pytest.mark.skipif(find_spec("mujoco") is None, reason="MuJoCo has no wheel for this Python")


def test_its_shell_is_as_stiff_as_the_fabric(moduli):
    young, thickness = peer.shell(moduli)
    assert young * thickness == pytest.approx(moduli.stretch[:2].mean())
    assert young * thickness**3 / 12 == pytest.approx(moduli.bend[:2].mean())


def test_without_mujoco_one_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr(peer, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'taichi-tryon\[peers\]'") as caught:
        peer.require()
    assert "\n" not in str(caught.value)


def test_its_model_holds_the_corners_and_takes_step_and_friction_from_the_scene():
    of = problem(6, "isotropic", 0.1)
    setup = prepare(ours.scene_of(of, ours.Setting("")), Stopwatch())
    model = ElementTree.fromstring(peer._xml(of, setup, PeerSetting(5)))
    assert float(model.find("option").get("timestep")) == pytest.approx(1 / 300)
    pinned = [int(k) for k in model.find(".//pin").get("id").split()]
    assert sorted(setup.positions[pinned, 0]) == pytest.approx([0, 0.5]) and set(setup.positions[pinned, 2]) == {-0.5}
    assert model.find(".//geom") is None and model.find(".//flexcomp/contact").get("friction") == "0.3 0 0"


def test_its_layers_touch_at_twice_the_radius_where_ours_do():
    of = sphere_layers.problem(11, 0.1)
    setup = prepare(ours.scene_of(of, ours.Setting("")), Stopwatch())
    flex = ElementTree.fromstring(peer._xml(of, setup, PeerSetting(1))).find(".//flexcomp")
    assert flex.find("contact").get("selfcollide") == "auto"
    assert 2 * float(flex.get("radius")) == pytest.approx(setup.scene.contact.layers.thickness_mm / 1000)
    plain = sphere.problem(11, "table1")
    setup = prepare(ours.scene_of(plain, ours.Setting("")), Stopwatch())
    assert 'selfcollide="none"' in peer._xml(plain, setup, PeerSetting(1))


@needs_mujoco
def test_it_falls_freely_down_to_the_ball():
    of = sphere.problem(11, "isotropic", seconds=0.1)
    track = peer.run(of, PeerSetting(10))
    step = 1 / 600
    steps = 10 * np.arange(1, 7)
    assert track.lowest == pytest.approx(0.3 - 9.81 * step**2 * steps * (steps + 1) / 2, abs=1e-6)
    assert track.strain.max() < 1e-9 and track.frames == pytest.approx(6 - 0.1)


@needs_mujoco
def test_both_solve_the_same_problem_where_steps_are_small():
    # at 0.2 s the sheet has turned by half a right angle; MuJoCo is of first order
    of = problem(6, "isotropic", 0.2)
    of = type(of)(**{**vars(of), "moment": 0.2})
    right = ours.follow(of, ours.scene_of(of, converged(120))).positions
    away = [distance(peer.run(of, PeerSetting(steps)).positions, right) for steps in (5, 20, 80)]
    start = distance(prepare(ours.scene_of(of, ours.Setting("")), Stopwatch()).positions, right)
    assert away[2] < 0.6 * away[1] < 0.36 * away[0] and away[2] < 0.01 * start
