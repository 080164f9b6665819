"""Chooses who draws: GGUI where Vulkan is found, else the rasteriser."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from taichi_tryon.errors import InputError, RunError
from taichi_tryon.view.camera import Camera
from taichi_tryon.view.ggui import GguiRenderer
from taichi_tryon.view.mesh import DrawList, Mesh
from taichi_tryon.view.raster import RasterRenderer


class Renderer(Protocol):
    """What both renderers can do; pictures are (width, height) = ``size``."""

    name: str
    size: tuple[int, int]

    def prepare(self, meshes: Sequence[Mesh]) -> DrawList:
        """What all views of one instant share."""

    def render(self, meshes: Sequence[Mesh] | DrawList, camera: Camera) -> np.ndarray:
        """A picture, uint8 (height, width, 3)."""

    def close(self) -> None:
        """Give back what the device lent."""


def make_renderer(size: tuple[int, int], prefer: str = "auto") -> tuple[Renderer, str | None]:
    """A renderer in the running Taichi, and one line for the user where it is not the best one.

    Args:
        size: (width, height) of the pictures.
        prefer: "auto" (GGUI, else raster), "ggui" or "raster".

    Raises:
        InputError: ``prefer`` is something else.
        RunError: GGUI was asked for and does not start.
    """
    if prefer not in ("auto", "ggui", "raster"):
        raise InputError(f"renderer: {prefer!r} is unknown; allowed are auto, ggui, raster")
    if prefer == "raster":
        return RasterRenderer(size), None
    try:
        return GguiRenderer(size), None
    except RunError as fault:
        if prefer == "ggui":
            raise
        return RasterRenderer(size), f"pictures by the built-in rasteriser; {fault}"
