import os
import subprocess
import sys

import pytest

from taichi_tryon.errors import InputError, RunError
from taichi_tryon.view import renderer as chosen
from taichi_tryon.view.renderer import graphics_card, make_renderer

WITHOUT_VULKAN = """
from taichi_tryon import runtime
from taichi_tryon.errors import RunError
from taichi_tryon.view import renderer
from taichi_tryon.view.renderer import make_renderer
renderer.graphics_card = lambda: True
runtime.start("cpu", threads=1, offline_cache=False)
renderer, message = make_renderer((32, 32))
print(renderer.name, message)
try:
    make_renderer((32, 32), "ggui")
except RunError as fault:
    print(fault)
"""


def test_raster_on_request_needs_no_message():
    renderer, message = make_renderer((32, 32), "raster")
    assert (renderer.name, renderer.size, message) == ("raster", (32, 32), None)


def test_unknown_renderer_is_said():
    with pytest.raises(InputError, match="'opengl' is unknown; allowed are auto, ggui, raster"):
        make_renderer((32, 32), "opengl")


def test_a_second_ggui_renderer_is_refused_until_the_first_is_closed(ggui, monkeypatch):
    monkeypatch.setattr(chosen, "graphics_card", lambda: True)
    with pytest.raises(RunError, match="one at a time"):
        make_renderer((32, 32), "ggui")
    renderer, message = make_renderer((32, 32))
    assert renderer.name == "raster"
    assert "one at a time" in message
    ggui.close()
    renderer, message = make_renderer((32, 32))
    assert (renderer.name, message) == ("ggui", None)
    renderer.close()


def test_without_a_graphics_card_the_rasteriser_draws_and_nothing_is_said(monkeypatch):
    monkeypatch.setattr(chosen, "graphics_card", lambda: False)
    renderer, message = make_renderer((32, 32))
    assert (renderer.name, message) == ("raster", None)


@pytest.mark.parametrize("device", ["dri/renderD128", "nvidiactl", "dxg"])
def test_a_graphics_card_is_told_by_its_device_file(tmp_path, monkeypatch, device):
    monkeypatch.setattr("sys.platform", "linux")
    (tmp_path / "dri").mkdir()
    (tmp_path / "nvidia-caps").mkdir()
    assert not graphics_card(tmp_path)
    (tmp_path / device).touch()
    assert graphics_card(tmp_path)
    monkeypatch.setattr("sys.platform", "darwin")
    assert graphics_card(tmp_path / "nowhere")


def test_without_vulkan_the_rasteriser_draws_and_one_line_says_how_to_get_ggui():
    hidden = {**os.environ, "VK_DRIVER_FILES": "/nonexistent", "VK_ICD_FILENAMES": "/nonexistent"}
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_VULKAN], env=hidden, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    first, second = [line for line in done.stdout.splitlines() if "apt-get" in line]
    assert first == (
        "raster pictures by the built-in rasteriser; no GGUI: it needs Vulkan "
        "(on Debian: apt-get install libvulkan1 mesa-vulkan-drivers)"
    )
    assert second in first
