"""Chooses who draws: GGUI where there is a graphics card, else the rasteriser, which takes a third of the time that
GGUI takes on a software Vulkan."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from taichi_tryon.errors import InputError, RunError
from taichi_tryon.view.camera import Camera
from taichi_tryon.view.ggui import GguiRenderer
from taichi_tryon.view.mesh import DrawList, Mesh
from taichi_tryon.view.raster import RasterRenderer

CARDS = ("dri/renderD*", "nvidiactl", "dxg")
"""Device files of what Linux draws with: all cards with a driver of the kernel's, NVIDIA's own, and those of WSL."""


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
        prefer: "auto" (GGUI where it finds a graphics card, else raster), "ggui" (also on a software Vulkan), "raster".

    Raises:
        InputError: ``prefer`` is something else.
        RunError: GGUI was asked for and does not start.
    """
    if prefer not in ("auto", "ggui", "raster"):
        raise InputError(f"renderer: {prefer!r} is unknown; allowed are auto, ggui, raster")
    if prefer == "raster" or (prefer == "auto" and not graphics_card()):
        return RasterRenderer(size), None
    try:
        return GguiRenderer(size), None
    except RunError as fault:
        if prefer == "ggui":
            raise
        return RasterRenderer(size), f"pictures by the built-in rasteriser; {fault}"


def graphics_card(devices: Path = Path("/dev")) -> bool:
    """Whether there may be one; only Linux tells, by its device files."""
    return sys.platform != "linux" or any(any(devices.glob(card)) for card in CARDS)
