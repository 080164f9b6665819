import pytest

from taichi_tryon.errors import RunError
from taichi_tryon.view.interactive import Viewer


def test_without_a_display_one_line_says_so(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    with pytest.raises(RunError, match="no display on this machine") as fault:
        Viewer(step=lambda: True, reset=lambda: None, meshes=list, bounds=((0, 0, 0), (1, 1, 1)))
    assert "\n" not in str(fault.value)
