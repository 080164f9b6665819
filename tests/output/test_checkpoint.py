"""A checkpoint comes back bit by bit, or is refused with a reason."""

import numpy as np
import pytest

from taichi_tryon.errors import InputError, RunError
from taichi_tryon.output import checkpoint

SCENE = "scene: a\n"


@pytest.fixture
def state():
    return {
        "positions": np.random.default_rng(0).normal(size=(5, 3)),
        "single": np.random.default_rng(1).normal(size=4).astype(np.float32),
        "phase": np.array("settle"),
        "steps": np.array(7),
        "residual": np.array(np.inf),
    }


def test_round_trip(tmp_path, state):
    checkpoint.save(tmp_path, SCENE, state)
    found = checkpoint.load(tmp_path, SCENE)
    assert set(found) == set(state)
    for name, values in state.items():
        assert found[name].dtype == values.dtype and np.array_equal(found[name], values)
    assert [path.name for path in tmp_path.iterdir()] == ["checkpoint.npz"]


def test_a_later_one_replaces_it(tmp_path, state):
    checkpoint.save(tmp_path, SCENE, state)
    checkpoint.save(tmp_path, SCENE, {"steps": np.array(8)})
    assert list(checkpoint.load(tmp_path, SCENE)) == ["steps"]


def test_that_of_another_scene_is_refused(tmp_path, state):
    checkpoint.save(tmp_path, SCENE, state)
    with pytest.raises(InputError, match="checkpoint.npz: was written by another scene"):
        checkpoint.load(tmp_path, "scene: b\n")


def test_none_is_refused(tmp_path):
    with pytest.raises(InputError, match="no checkpoint to resume from"):
        checkpoint.load(tmp_path, SCENE)


def test_a_broken_one_is_refused(tmp_path, state):
    checkpoint.save(tmp_path, SCENE, state)
    path = tmp_path / "checkpoint.npz"
    whole = path.read_bytes()
    turned = bytearray(whole)
    turned[200] ^= 255  # within the positions: the sum no longer agrees
    for broken in (b"", b"PK", b"not a checkpoint", whole[: len(whole) // 2], whole[:-1], bytes(turned)):
        path.write_bytes(broken)
        with pytest.raises(InputError, match="checkpoint.npz: (not a checkpoint|was written by another)"):
            checkpoint.load(tmp_path, SCENE)


def test_arrays_of_objects_are_not_unpickled(tmp_path):
    with (tmp_path / "checkpoint.npz").open("wb") as file:
        np.savez(file, fingerprint=np.array(["x"], object))
    with pytest.raises(InputError, match="not a checkpoint"):
        checkpoint.load(tmp_path, SCENE)


def test_what_is_not_a_number_is_refused_and_the_one_before_kept(tmp_path, state):
    checkpoint.save(tmp_path, SCENE, state)
    bad = {**state, "positions": np.full((5, 3), np.nan)}
    with pytest.raises(RunError, match="positions is not a number; the checkpoint before is kept"):
        checkpoint.save(tmp_path, SCENE, bad)
    assert np.array_equal(checkpoint.load(tmp_path, SCENE)["positions"], state["positions"])


def test_a_folder_that_is_gone_is_told(tmp_path, state):
    with pytest.raises(RunError, match="cannot be written"):
        checkpoint.save(tmp_path / "gone", SCENE, state)
