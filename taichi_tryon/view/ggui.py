"""The renderer on Taichi's GGUI: off the screen for pictures, on it for the window of ``view``.

GGUI lights one side of a surface and knows neither hidden sky nor weave; so the light is computed in our own kernel, at
the corners of triangles cut along the check's lines, and GGUI draws the colours as they are. It needs Vulkan, in
hardware or software.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import taichi as ti

from taichi_tryon.errors import RunError
from taichi_tryon.view.camera import Camera
from taichi_tryon.view.corners import Pieces, light_corners, shrink
from taichi_tryon.view.mesh import DrawList, Mesh
from taichi_tryon.view.occlusion import Occlusion
from taichi_tryon.view.shading import BACKGROUND, vec3

SUPERSAMPLING = 2
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
        window = ti.ui.Window(title, size, vsync=show, show_window=show)
    except Exception as fault:  # Taichi raises bare RuntimeErrors and Exceptions here
        raise RunError(f"no GGUI: it needs Vulkan (on Debian: apt-get install {PACKAGES})") from fault
    _open.append(window)
    return window


def close_window(window: ti.ui.Window) -> None:
    """Close a window of ``open_window``; may be called twice."""
    if window in _open:
        _open.remove(window)
        window.destroy()


class GguiScene:
    """Draws draw lists into a GGUI window; its fields grow when a scene is larger than any before."""

    def __init__(self, window: ti.ui.Window):
        self._window = window
        self._canvas = window.get_canvas()
        self._scene = window.get_scene()
        self._camera = ti.ui.Camera()
        self._pieces = Pieces()
        self._capacity = 0
        self._tree = None

    def draw(self, draw: DrawList, camera: Camera) -> None:
        """Fill the window's canvas; the caller shows it or reads it back."""
        parent, weights = self._pieces.of(draw)
        count = 3 * len(parent)
        self._reserve(count)
        eye = np.asarray(camera.eye, np.float32)
        light_corners(
            self._positions, self._colors, parent, weights, draw.vertices, draw.normals, draw.openness, draw.triangles,
            draw.colors, draw.weave, draw.mesh, draw.style, camera.axes.astype(np.float32), vec3(*eye),
        )  # fmt: skip
        self._aim(camera, draw.vertices)
        self._canvas.set_background_color(BACKGROUND)
        self._scene.set_camera(self._camera)
        self._scene.ambient_light((1.0, 1.0, 1.0))
        self._scene.mesh(
            self._positions,
            normals=self._normals,
            per_vertex_color=self._colors,
            two_sided=True,
            vertex_count=count,
            index_count=count,
        )
        self._canvas.scene(self._scene)

    def close(self) -> None:
        """Give the fields back."""
        if self._tree is not None:
            self._tree.destroy()
            self._tree, self._capacity = None, 0

    def _aim(self, camera: Camera, vertices: np.ndarray) -> None:
        self._camera.position(*map(float, camera.eye))
        self._camera.lookat(*map(float, camera.target))
        self._camera.up(*map(float, camera.up))
        self._camera.fov(float(camera.fov_deg))
        depth = (np.asarray(camera.eye) - vertices) @ camera.axes[2]
        self._camera.z_near(max(0.9 * float(depth.min()), 0.01))
        self._camera.z_far(max(1.1 * float(depth.max()), 0.02))

    def _reserve(self, count: int) -> None:
        if count <= self._capacity:
            return
        self.close()
        self._capacity = int(1.25 * count)
        self._positions, self._normals, self._colors = (ti.Vector.field(3, ti.f32) for _ in range(3))
        builder = ti.FieldsBuilder()
        builder.dense(ti.i, self._capacity).place(self._positions, self._normals, self._colors)
        self._tree = builder.finalize()
        self._normals.fill((0.0, 1.0, 0.0))  # unused, but GGUI normalises them


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
        self._scene.draw(draw, camera)
        pixels = self._window.get_image_buffer_as_numpy()
        image = np.empty((self.size[1], self.size[0], 3), np.uint8)
        shrink(pixels, image, SUPERSAMPLING)
        return image

    def prepare(self, meshes: Sequence[Mesh]) -> DrawList:
        """What all views of one instant share: gathered arrays and hidden sky."""
        return self._occlusion.apply(DrawList.of(meshes))

    def close(self) -> None:
        """Give window and fields back."""
        self._scene.close()
        close_window(self._window)
