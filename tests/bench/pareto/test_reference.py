"""The converged solution is found once for a scene."""

import shutil

import numpy as np
import pytest

from taichi_tryon.bench.pareto import reference, sphere
from taichi_tryon.bench.pareto.hang import problem
from taichi_tryon.bench.pareto.ours import scene_of
from taichi_tryon.bench.pareto.reference import Reference, converged, distance, kept
from taichi_tryon.bench.pareto.track import Track

PROBLEM = problem(6, "table1", 0.5)


def found(value: float) -> Reference:
    frames = np.full(3, value)
    return Reference(Track(np.full((2, 3), value), frames, frames, frames, 1.0, 2.0, 3.0), 0.25)


def test_distance_is_the_root_of_the_mean_square():
    positions = np.zeros((4, 3))
    assert distance(positions, positions + [[3, 0, 4], [0, 0, 0], [0, 0, 0], [0, 0, 0]]) == pytest.approx(2.5)


def test_a_file_is_read_again_only_for_the_same_scene(tmp_path, monkeypatch):
    monkeypatch.setattr(reference, "FOLDER", tmp_path / "references")
    scene, other = (scene_of(PROBLEM, converged(rate)) for rate in (120, 240))
    first = kept("hang", scene, lambda: found(1.0))
    assert kept("hang", scene, lambda: found(2.0)).track.lowest.tolist() == [1, 1, 1]
    assert (first.doubt, first.track.positions.shape, float(first.track.wall_s)) == (0.25, (2, 3), 2.0)
    assert kept("hang", other, lambda: found(3.0)).track.lowest.tolist() == [3, 3, 3]
    assert len(list((tmp_path / "references").glob("hang_*.npz"))) == 2


@pytest.mark.parametrize("scene, moved", [(PROBLEM, False), (sphere.problem(16, "table1", 0.5), True)])
def test_a_law_that_does_not_act_in_a_scene_does_not_change_its_key(tmp_path, monkeypatch, scene, moved):
    package = tmp_path / "package"
    shutil.copytree(reference.PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(reference, "PACKAGE", package)
    scene = scene_of(scene, converged(120))
    keys = [reference._key(scene)]
    for changed in ("contact/body.py", "cloth/membrane.py"):
        with open(package / changed, "a") as source:
            source.write("# changed")
        keys.append(reference._key(scene))
    assert (keys[0] != keys[1]) is moved and keys[1] != keys[2]


def test_a_fall_is_compared_only_as_long_as_asked_with_steps_twice_as_long_for_the_doubt(tmp_path, monkeypatch):
    asked = []

    def run(function, of, setting):
        asked.append((of.duration, setting.name))
        return found(float(len(asked))).track

    monkeypatch.setattr(reference, "FOLDER", tmp_path)
    monkeypatch.setattr(reference, "apart", run)
    result = reference.falling(PROBLEM, 120)
    assert asked == [(0.5, "converged, 1/60 s"), (0.5, "converged, 1/120 s")]
    assert result.track.lowest[0] == 2.0 and result.doubt == pytest.approx(np.sqrt(3))
