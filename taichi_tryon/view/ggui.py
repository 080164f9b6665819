"""The renderer on Taichi's GGUI: off the screen for pictures, on it for the window of ``view``.

GGUI lights one side of a surface and knows neither hidden sky nor weave; so the light is computed in our own kernel, at
the corners of triangles cut along the check's lines, and GGUI draws the colours as they are. It needs Vulkan, in
hardware or software.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from tempfile import TemporaryDirectory

import numpy as np
import taichi as ti
from taichi.ui.utils import get_field_info

from taichi_tryon.errors import RunError
from taichi_tryon.view.camera import Camera
from taichi_tryon.view.corners import CORNER, Pieces, light_corners, shrink
from taichi_tryon.view.mesh import DrawList, Mesh
from taichi_tryon.view.occlusion import Occlusion
from taichi_tryon.view.shading import BACKGROUND, vec3

SUPERSAMPLING = 2
# Taichi 1.7.4 on a software Vulkan now and then hands back a picture with nothing drawn; so often it is asked again
ATTEMPTS = 3
PACKAGES = "libvulkan1 mesa-vulkan-drivers"


_open: list[ti.ui.Window] = []


def open_window(title: str, size: tuple[int, int], show: bool) -> ti.ui.Window:
    """A GGUI window, on or off the screen; give it back by ``close_window``.

    Raises:
        RunError: no Vulkan, or a window is open already: Taichi crashes when one of two closes, or when it is started
            anew while one is open.
    """
    if _open:
        raise RunError("no second GGUI window: Taichi bears one at a time; close the first")
    try:
        with _elsewhere():
            window = ti.ui.Window(title, size, vsync=show, show_window=show)
    except Exception as fault:  # Taichi raises bare RuntimeErrors and Exceptions here
        raise RunError(f"no GGUI: it needs Vulkan (on Debian: apt-get install {PACKAGES})") from fault
    _open.append(window)
    return window


def close_window(window: ti.ui.Window) -> None:
    """Close a window of ``open_window``; may be called twice."""
    if window in _open:
        _open.remove(window)
        with _elsewhere():
            window.destroy()


def show_window(window: ti.ui.Window) -> None:
    """Show what was drawn since the last call."""
    with _elsewhere():
        window.show()


@contextmanager
def _elsewhere() -> Iterator[None]:
    """GGUI reads and writes ``imgui.ini`` in the working directory; the user's is none of its business."""
    before = os.getcwd()
    os.chdir(_folder().name)
    try:
        yield
    finally:
        os.chdir(before)


@cache
def _folder() -> TemporaryDirectory:
    """Lives as long as the program."""
    return TemporaryDirectory(prefix="taichi_tryon_")


class GguiScene:
    """Draws draw lists into a GGUI window.

    The vertices go to GGUI's core directly: ``SceneV2.mesh`` hands the core an array that it frees before the core has
    read it (Taichi 1.7.4; now and then a picture stays empty).
    """

    def __init__(self, window: ti.ui.Window):
        self._window = window
        self._canvas = window.get_canvas()
        self._scene = window.get_scene()
        self._camera = ti.ui.Camera()
        self._pieces = Pieces()
        self._corners = np.zeros((0, CORNER), np.float32)

    def draw(self, draw: DrawList, camera: Camera) -> None:
        """Fill the window's canvas; the caller shows it or reads it back."""
        parent, weights = self._pieces.of(draw)
        count = 3 * len(parent)
        if len(self._corners) != count:
            self._corners = np.zeros((count, CORNER), np.float32)
        eye = np.asarray(camera.eye, np.float32)
        light_corners(
            self._corners, parent, weights, draw.vertices, draw.normals, draw.openness, draw.triangles,
            draw.colors, draw.weave, draw.mesh, draw.style, camera.axes.astype(np.float32), vec3(*eye),
        )  # fmt: skip
        self._aim(camera, draw.vertices)
        self._canvas.set_background_color(BACKGROUND)
        self._scene.set_camera(self._camera)
        self._scene.ambient_light((1.0, 1.0, 1.0))
        corners, no_indices, own_colors, two_sided, wireframe = get_field_info(self._corners), None, True, True, False
        self._scene.scene.mesh(
            corners, own_colors, get_field_info(no_indices), (0.0, 0.0, 0.0), two_sided, count, 0, count, 0, wireframe
        )
        self._canvas.scene(self._scene)

    def _aim(self, camera: Camera, vertices: np.ndarray) -> None:
        self._camera.position(*map(float, camera.eye))
        self._camera.lookat(*map(float, camera.target))
        self._camera.up(*map(float, camera.up))
        self._camera.fov(float(camera.fov_deg))
        depth = (np.asarray(camera.eye) - vertices) @ camera.axes[2]
        self._camera.z_near(max(0.9 * float(depth.min()), 0.01))
        self._camera.z_far(max(1.1 * float(depth.max()), 0.02))


class GguiRenderer:
    """Pictures by GGUI off the screen.

    Args:
        size: (width, height) of the pictures.

    Raises:
        RunError: no Vulkan.
    """

    name = "ggui"

    def __init__(self, size: tuple[int, int]):
        self.size = (int(size[0]), int(size[1]))
        self._window = open_window("taichi-tryon", tuple(SUPERSAMPLING * side for side in self.size), show=False)
        self._scene = GguiScene(self._window)
        self._occlusion = Occlusion()

    def render(self, meshes: Sequence[Mesh] | DrawList, camera: Camera) -> np.ndarray:
        """A picture, uint8 (height, width, 3), of meshes or of what ``prepare`` made of them."""
        draw = meshes if isinstance(meshes, DrawList) else self.prepare(meshes)
        for _ in range(ATTEMPTS):
            self._scene.draw(draw, camera)
            pixels = self._window.get_image_buffer_as_numpy()
            if np.ptp(pixels[::8, ::8, :3], axis=(0, 1)).any():
                break
        image = np.empty((self.size[1], self.size[0], 3), np.uint8)
        shrink(pixels, image, SUPERSAMPLING)
        return image

    def prepare(self, meshes: Sequence[Mesh]) -> DrawList:
        """What all views of one instant share: gathered arrays and hidden sky."""
        return self._occlusion.apply(DrawList.of(meshes))

    def close(self) -> None:
        """Give the window back."""
        close_window(self._window)
