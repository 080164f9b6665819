"""The output folder: one run at a time, and what goes of an earlier one."""

import fcntl

import pytest

from taichi_tryon.errors import InputError, RunError
from taichi_tryon.output import folder


def written(path):
    """What a killed run leaves."""
    names = ["scene.yaml", "report.json", "video.mp4", "checkpoint.npz", "frames.pvd", "log.txt", ".video.part.mp4",
             ".checkpoint.12.part.npz", "frames/frame_0000.vtu", "frames/body_0000.vtu", "frames/frame_0001.vtu",
             "frames/.frame_0002.12.part.vtu", "images/front_0001.png", "images/.front_0002.12.part.png",
             "mine.txt", "frames/notes.txt"]  # fmt: skip
    for name in names:
        (path / name).parent.mkdir(exist_ok=True)
        (path / name).write_text("x")
    return {name for name in names if ".part." not in name}


def names(path):
    return {str(file.relative_to(path)) for file in path.rglob("*") if file.is_file()}


def test_a_run_that_goes_on_finds_all_that_was_finished(tmp_path):
    finished = written(tmp_path)
    folder.clear(tmp_path, resumed=True)
    assert names(tmp_path) == finished


def test_a_new_run_finds_nothing_of_the_one_before(tmp_path):
    written(tmp_path)
    folder.clear(tmp_path, resumed=False)
    assert names(tmp_path) == {"scene.yaml", "log.txt", "mine.txt", "frames/notes.txt"}


def test_frames_from_a_number_on_are_removed(tmp_path):
    written(tmp_path)
    folder.clear_frames(tmp_path, 1)
    assert {"frames/frame_0000.vtu", "frames/body_0000.vtu"} <= names(tmp_path)
    assert not {"frames/frame_0001.vtu", "images/front_0001.png"} & names(tmp_path)


def test_what_cannot_be_removed_is_told(tmp_path):
    (tmp_path / "report.json").mkdir()
    with pytest.raises(RunError, match="report.json: cannot be removed"):
        folder.clear(tmp_path, resumed=False)


def test_one_run_at_a_time(tmp_path):
    folder.require_free(tmp_path)
    with (tmp_path / folder.LOG).open("a") as log:
        folder.lock(log, tmp_path)
        with pytest.raises(InputError, match="another run is writing there; wait for its end or choose another"):
            folder.require_free(tmp_path)
        with (tmp_path / folder.LOG).open("a") as other, pytest.raises(InputError, match="another run"):
            folder.lock(other, tmp_path)
    folder.require_free(tmp_path)


def test_file_systems_without_locks_are_no_fault(tmp_path, monkeypatch):
    def refused(*_):
        raise OSError(37, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refused)
    (tmp_path / folder.LOG).write_text("")
    folder.require_free(tmp_path)
