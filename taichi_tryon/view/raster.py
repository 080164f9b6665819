"""The renderer that needs no graphics driver: z-buffer and shading per sample as Taichi kernels."""

from collections.abc import Sequence

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tryon.kernel_loops import shared
from taichi_tryon.view import zbuffer
from taichi_tryon.view.camera import Camera
from taichi_tryon.view.mesh import DrawList, Mesh
from taichi_tryon.view.occlusion import Occlusion
from taichi_tryon.view.shading import BACKGROUND, displayed, lit, vec3, woven

SUPERSAMPLING = 2


class RasterRenderer:
    """Draws meshes on whatever device Taichi runs; the same input gives the same bytes.

    Args:
        size: (width, height) of the pictures.
    """

    name = "raster"

    def __init__(self, size: tuple[int, int]):
        self.size = (int(size[0]), int(size[1]))
        width, height = (SUPERSAMPLING * side for side in self.size)
        self._words = ti.ndarray(ti.i64, shape=width * height)
        self._image = np.zeros((self.size[1], self.size[0], 3), np.uint8)
        self._occlusion = Occlusion()

    def render(self, meshes: Sequence[Mesh] | DrawList, camera: Camera) -> np.ndarray:
        """A picture, uint8 (height, width, 3), of meshes or of what ``prepare`` made of them."""
        draw = meshes if isinstance(meshes, DrawList) else self.prepare(meshes)
        width, height = (SUPERSAMPLING * side for side in self.size)
        axes = camera.axes.astype(np.float32)
        eye = np.asarray(camera.eye, np.float32)
        focal = 0.5 * height / np.tan(np.radians(camera.fov_deg) / 2)
        screen = np.zeros((len(draw.vertices), 3), np.float32)
        zbuffer.clear(self._words)
        zbuffer.project(draw.vertices, screen, axes, vec3(*eye), focal, width, height)
        visible = screen[screen[:, 2] > 0, 2]
        if visible.size:
            nearest, farthest = 1.0001 * float(visible.max()), 0.9999 * float(visible.min())
            zbuffer.fill(screen, draw.triangles, draw.mesh, draw.style, self._words, nearest, farthest, width, height)
        shade(
            self._words, screen, draw.vertices, draw.normals, draw.openness, draw.triangles, draw.colors, draw.weave,
            draw.mesh, draw.style, self._image, axes, vec3(*eye), vec3(*BACKGROUND),
            camera.metres_per_pixel(self.size[1]), width,
        )  # fmt: skip
        return self._image.copy()

    def prepare(self, meshes: Sequence[Mesh]) -> DrawList:
        """What all views of one instant share: gathered arrays and hidden sky."""
        return self._occlusion.apply(DrawList.of(meshes))

    def close(self) -> None:
        """Nothing to give back: the arrays go with the object."""


@ti.kernel
@shared
def shade(
    words: ti.types.ndarray(dtype=ti.i64, ndim=1),
    screen: ti.types.ndarray(dtype=ti.f32, ndim=2),
    vertices: ti.types.ndarray(dtype=ti.f32, ndim=2),
    normals: ti.types.ndarray(dtype=ti.f32, ndim=2),
    openness: ti.types.ndarray(dtype=ti.f32, ndim=2),
    triangles: ti.types.ndarray(dtype=ti.i32, ndim=2),
    colors: ti.types.ndarray(dtype=ti.f32, ndim=3),
    weave: ti.types.ndarray(dtype=ti.f32, ndim=3),
    mesh: ti.types.ndarray(dtype=ti.i32, ndim=1),
    style: ti.types.ndarray(dtype=ti.f32, ndim=2),
    image: ti.types.ndarray(dtype=ti.u8, ndim=3),
    axes: ti.types.ndarray(dtype=ti.f32, ndim=2),
    eye: vec3,
    background: vec3,
    pixel: ti.f32,
    width: ti.i32,
):
    """Colour of each pixel: the mean over its samples; those that show one triangle are lit once."""
    for row, column in ti.ndrange(image.shape[0], image.shape[1]):
        total, color = tm.vec3(0.0), tm.vec3(0.0)
        shown = -2  # the triangle of the sample before; -1 is the background
        for sample in range(SUPERSAMPLING * SUPERSAMPLING):
            sy = row * SUPERSAMPLING + sample // SUPERSAMPLING
            sx = column * SUPERSAMPLING + sample % SUPERSAMPLING
            word = words[sy * width + sx]
            t = -1
            if word < ti.i64(zbuffer.EMPTY):
                t = ti.cast(word & ti.i64(zbuffer.TRIANGLE), ti.i32)
            if t != shown and t < 0:
                color = tm.vec3(background[0], background[1], background[2])
            elif t != shown:
                corner = ti.Vector([triangles[t, 0], triangles[t, 1], triangles[t, 2]])
                weight = _weights(screen, corner, (column + 0.5) * SUPERSAMPLING, (row + 0.5) * SUPERSAMPLING)
                normal, point, uv, albedo = tm.vec3(0.0), tm.vec3(0.0), tm.vec2(0.0), tm.vec3(0.0)
                hidden = tm.vec2(0.0)
                for k in ti.static(range(3)):
                    v, w = corner[k], weight[k]
                    normal += w * tm.vec3(normals[v, 0], normals[v, 1], normals[v, 2])
                    point += w * tm.vec3(vertices[v, 0], vertices[v, 1], vertices[v, 2])
                    albedo += w * tm.vec3(colors[t, k, 0], colors[t, k, 1], colors[t, k, 2])
                    uv += w * tm.vec2(weave[t, k, 0], weave[t, k, 1])
                    hidden += w * tm.vec2(openness[v, 0], openness[v, 1])
                m = mesh[t]
                if style[m, 1] > 0:
                    # 1.2 mm soft edges, but never finer than the picture can show
                    width_in_stripes = _stripes_per_metre(weave, vertices, corner, t) * tm.max(pixel, 0.0012)
                    albedo = woven(albedo, tm.vec3(style[m, 2], style[m, 3], style[m, 4]), uv, width_in_stripes)
                inside = ti.cast(_turned(vertices, corner, eye), ti.f32)
                normal = tm.normalize(normal + 1e-12) * (1.0 - 2.0 * inside)
                color = displayed(
                    lit(
                        albedo,
                        normal,
                        tm.normalize(eye - point),
                        tm.mix(hidden[0], hidden[1], inside),
                        inside,
                        style[m, 5],
                        tm.vec3(axes[0, 0], axes[0, 1], axes[0, 2]),
                        tm.vec3(axes[1, 0], axes[1, 1], axes[1, 2]),
                        tm.vec3(axes[2, 0], axes[2, 1], axes[2, 2]),
                    )
                )
            shown = t
            total += color
        for k in ti.static(range(3)):
            image[row, column, k] = ti.cast(tm.clamp(total[k] / SUPERSAMPLING**2, 0.0, 1.0) * 255.0 + 0.5, ti.u8)


@ti.func
def _weights(screen: ti.template(), corner, px, py):
    """Barycentric coordinates in space of the point seen there, or of one near on the triangle's rim."""
    a, b, c = corner[0], corner[1], corner[2]
    wa = zbuffer.edge(screen[b, 0], screen[b, 1], screen[c, 0], screen[c, 1], px, py) * screen[a, 2]
    wb = zbuffer.edge(screen[c, 0], screen[c, 1], screen[a, 0], screen[a, 1], px, py) * screen[b, 2]
    wc = zbuffer.edge(screen[a, 0], screen[a, 1], screen[b, 0], screen[b, 1], px, py) * screen[c, 2]
    inside = tm.max(tm.vec3(wa, wb, wc) / (wa + wb + wc), 0.0)
    return inside / (inside[0] + inside[1] + inside[2])


@ti.func
def _turned(vertices: ti.template(), corner, eye):
    """1 where the camera sees the inner side of the triangle, else 0."""
    a = tm.vec3(vertices[corner[0], 0], vertices[corner[0], 1], vertices[corner[0], 2])
    b = tm.vec3(vertices[corner[1], 0], vertices[corner[1], 1], vertices[corner[1], 2])
    c = tm.vec3(vertices[corner[2], 0], vertices[corner[2], 1], vertices[corner[2], 2])
    return ti.cast(tm.dot(tm.cross(b - a, c - a), eye - a) < 0, ti.i32)


@ti.func
def _stripes_per_metre(weave: ti.template(), vertices: ti.template(), corner, t):
    """How many stripes pass per metre of cloth along the triangle's first edge."""
    a, b = corner[0], corner[1]
    along = tm.vec2(weave[t, 1, 0] - weave[t, 0, 0], weave[t, 1, 1] - weave[t, 0, 1])
    edge = tm.vec3(vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2])
    return tm.length(along) / tm.max(tm.length(edge), 1e-9)
