"""Every scene in two processes: the same start, to the last bit. The suite's case same_bits runs them on from there."""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from taichi_tryon.bench.stability import same_bits
from taichi_tryon.scene.load import load_scene

ROOT = Path(__file__).parents[3]
SCENES = sorted((ROOT / "configs" / "scenes").glob("*.yaml"))


def digests() -> dict[str, str]:
    """Of all arrays from which each scene starts, its triangles being coarse."""
    from taichi_tryon.scene.load import load_scene
    from taichi_tryon.setup import prepare
    from taichi_tryon.timing import Stopwatch

    found = {}
    for path in SCENES:
        setup = prepare(load_scene(path, ("mesh.edge_length_mm=40",)), Stopwatch())
        arrays = [setup.positions, setup.velocities, setup.holds.leader, *vars(setup.cloth).values()]
        whole = hashlib.sha256()
        for array in arrays:
            whole.update(array.tobytes() if hasattr(array, "tobytes") else repr(array).encode())
        found[path.stem] = whole.hexdigest()
    return found


def test_every_scene_starts_the_same_whatever_came_before():
    """Sets of names come in another order in each process; one has loaded NumPy, with two threads for its products,
    before the package."""
    code = f"import json, runpy; print(json.dumps(runpy.run_path({__file__!r})['digests']()))"
    one, other = (
        json.loads(subprocess.run([sys.executable, "-c", first + code], env={**os.environ, **variables},
                                  check=True, capture_output=True, text=True, cwd=ROOT).stdout.splitlines()[-1])
        for first, variables in (
            ("", {"PYTHONHASHSEED": "1"}),
            ("import numpy, scipy.linalg; ", {"PYTHONHASHSEED": "2", "OPENBLAS_NUM_THREADS": "2"}),
        )
    )  # fmt: skip
    assert list(one) == [path.stem for path in SCENES] and len(one) > 5
    assert one == other


@pytest.mark.parametrize("scene", SCENES, ids=lambda path: path.stem)
def test_a_few_steps_of_a_scene_move_what_moves_and_settle_nothing(scene):
    whole, brief = load_scene(scene), load_scene(scene, same_bits._briefly(scene)[1::2])
    assert (brief.mesh.edge_length_mm, brief.settle.max_steps) == (40, 0)
    assert brief.drape.duration_s + sum(step.duration_s for step in brief.motion) <= 0.1
    assert len(brief.motion) == bool(whole.motion) and brief.pose == whole.pose
    for step in brief.motion:
        assert step.pose.translation_cm != brief.pose.translation_cm
        assert step.pose.rotations_degree == brief.pose.rotations_degree


@pytest.mark.parametrize("differs", [False, True])
def test_a_quick_look_compares_two_runs_of_every_scene(monkeypatch, differs):
    calls = []

    def compared(scene, *options, runs):
        calls.append((scene.stem, tuple(runs)))
        return {"again": ["frames/frame_0001.vtu"] if differs and scene.stem == "quick" else []}

    monkeypatch.setattr(same_bits, "compared", compared)
    monkeypatch.chdir(ROOT)
    found = list(same_bits.records(quick=True))
    assert sorted(calls) == [(path.stem, ("first", "again")) for path in SCENES]
    assert [record.parameters["scene"] for record in found if not record.passes] == ["quick"] * differs
