"""The window of ``view``: the simulation runs while it is looked at from all sides."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence

import numpy as np
import taichi as ti

from taichi_tryon.errors import RunError
from taichi_tryon.view.ggui import GguiScene, close_window, open_window, show_window
from taichi_tryon.view.mesh import DrawList, Mesh
from taichi_tryon.view.occlusion import Occlusion
from taichi_tryon.view.orbit import HELP, Controls


class Viewer:
    """A GGUI window around a simulation.

    Args:
        step: computes the next instant; returns False when there is nothing more to compute (the window stays open).
        reset: goes back to the start.
        meshes: what is to be seen now.
        bounds: (lowest, highest) corner of what is seen, m.
        status: one line for the corner of the window, such as time and residual.
        size: (width, height) in pixels.

    Raises:
        RunError: no display or no Vulkan.
    """

    def __init__(
        self,
        step: Callable[[], bool],
        reset: Callable[[], None],
        meshes: Callable[[], Sequence[Mesh]],
        bounds: tuple[np.ndarray, np.ndarray],
        status: Callable[[], str] = lambda: "",
        size: tuple[int, int] = (960, 960),
        title: str = "taichi-tryon",
    ):
        require_display()
        self._step, self._reset, self._meshes, self._status = step, reset, meshes, status
        self.controls = Controls(bounds, size[0] / size[1])
        self._window = open_window(title, size, show=True)
        self._scene = GguiScene(self._window)
        self._occlusion = Occlusion()

    def run(self) -> None:
        """Until ESC or the window is closed; the window is gone afterwards."""
        try:
            self._run()
        finally:
            close_window(self._window)

    def _run(self) -> None:
        controls, window = self.controls, self._window
        more = True
        draw = self._draw_list()
        while window.running and not controls.quit:
            for event in window.get_events(ti.ui.PRESS):
                controls.press(event.key)
            controls.mouse(window.get_cursor_pos(), window.is_pressed(ti.ui.LMB), window.is_pressed(ti.ui.RMB))
            changed = False
            if controls.take_reset():
                self._reset()
                more = changed = True
            if controls.take_step() and more:
                more = self._step()
                changed = True
            if changed:
                draw = self._draw_list()
            self._scene.draw(draw, controls.orbit.camera)
            self._write_texts(more)
            show_window(window)

    def _draw_list(self) -> DrawList:
        return self._occlusion.apply(DrawList.of(self._meshes()))

    def _write_texts(self, more: bool) -> None:
        gui = self._window.get_gui()
        width, height = self._window.get_window_shape()
        with gui.sub_window("taichi-tryon", 0.01, 0.01, 290 / width, 140 / height):
            state = "paused" if self.controls.paused else "running" if more else "finished"
            gui.text(f"{state}   {self._status()}")
            for line in HELP:
                gui.text(line)


def require_display() -> None:
    """GGUI's window library ends the program without a word where there is no display: ask before.

    Raises:
        RunError: no display.
    """
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise RunError("view: no display on this machine (DISPLAY and WAYLAND_DISPLAY are unset); use run for pictures")
