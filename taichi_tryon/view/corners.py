"""The draw list as lit loose triangles, for renderers that take colours at vertices only (GGUI).

The light is computed at the corners by the same law as in the rasteriser.
"""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tryon.kernel_loops import shared
from taichi_tryon.view.cut import cut_along_lines
from taichi_tryon.view.mesh import DrawList
from taichi_tryon.view.shading import displayed, lit, vec3, woven

CORNER = 12  # numbers in a vertex of GGUI
_HARD = 1e-4  # of a stripe: a piece lies on one side of each line, so its colour needs no soft edge


class Pieces:
    """The loose triangles of a draw list; the cut of the woven ones is kept as long as their weave stays the same."""

    def __init__(self):
        self._weave = np.zeros((0, 3, 2), np.float32)
        self._parent, self._weights = cut_along_lines(self._weave)

    def of(self, draw: DrawList) -> tuple[np.ndarray, np.ndarray]:
        """(parent (m,) int32, weights (m, 3, 3) float32) as of ``cut_along_lines``; plain triangles stay whole."""
        has_weave = draw.style[draw.mesh, 1] > 0
        weave = draw.weave[has_weave]
        if not np.array_equal(weave, self._weave):
            self._weave = weave
            self._parent, self._weights = cut_along_lines(weave)
        woven_ones, plain_ones = np.flatnonzero(has_weave), np.flatnonzero(~has_weave)
        parent = np.concatenate([plain_ones, woven_ones[self._parent]]).astype(np.int32)
        plain = np.broadcast_to(np.eye(3, dtype=np.float32), (len(plain_ones), 3, 3))
        return parent, np.concatenate([plain, self._weights]).astype(np.float32)


@ti.kernel
@shared
def light_corners(
    corners: ti.types.ndarray(dtype=ti.f32, ndim=2),
    parent: ti.types.ndarray(dtype=ti.i32, ndim=1),
    weights: ti.types.ndarray(dtype=ti.f32, ndim=3),
    vertices: ti.types.ndarray(dtype=ti.f32, ndim=2),
    normals: ti.types.ndarray(dtype=ti.f32, ndim=2),
    openness: ti.types.ndarray(dtype=ti.f32, ndim=2),
    triangles: ti.types.ndarray(dtype=ti.i32, ndim=2),
    albedos: ti.types.ndarray(dtype=ti.f32, ndim=3),
    weave: ti.types.ndarray(dtype=ti.f32, ndim=3),
    mesh: ti.types.ndarray(dtype=ti.i32, ndim=1),
    style: ti.types.ndarray(dtype=ti.f32, ndim=2),
    axes: ti.types.ndarray(dtype=ti.f32, ndim=2),
    eye: vec3,
):
    """corners (3 m, 12), as GGUI keeps vertices: position (3), normal (3), texture (2, unused), RGB and opacity.

    Pieces of one-sided meshes that face away shrink to a point.
    """
    for piece in range(parent.shape[0]):
        t = parent[piece]
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        a = tm.vec3(vertices[i, 0], vertices[i, 1], vertices[i, 2])
        b = tm.vec3(vertices[j, 0], vertices[j, 1], vertices[j, 2])
        c = tm.vec3(vertices[k, 0], vertices[k, 1], vertices[k, 2])
        inside = ti.cast(tm.dot(tm.cross(b - a, c - a), eye - a) < 0, ti.f32)
        m = mesh[t]
        drawn = inside == 0 or style[m, 0] > 0
        middle = tm.vec2(0.0)
        for corner, e in ti.static(ti.ndrange(3, 3)):
            middle += weights[piece, corner, e] / 3.0 * tm.vec2(weave[t, e, 0], weave[t, e, 1])
        for corner in range(3):
            at = 3 * piece + corner
            point, shown = a, tm.vec3(0.0)
            if drawn:
                weight = tm.vec3(weights[piece, corner, 0], weights[piece, corner, 1], weights[piece, corner, 2])
                point = weight[0] * a + weight[1] * b + weight[2] * c
                normal, albedo, hidden = tm.vec3(0.0), tm.vec3(0.0), tm.vec2(0.0)
                for e in ti.static(range(3)):
                    v, w = ti.Vector([i, j, k])[e], weight[e]
                    normal += w * tm.vec3(normals[v, 0], normals[v, 1], normals[v, 2])
                    albedo += w * tm.vec3(albedos[t, e, 0], albedos[t, e, 1], albedos[t, e, 2])
                    hidden += w * tm.vec2(openness[v, 0], openness[v, 1])
                if style[m, 1] > 0:
                    albedo = woven(albedo, tm.vec3(style[m, 2], style[m, 3], style[m, 4]), middle, _HARD)
                color = lit(
                    albedo,
                    tm.normalize(normal + 1e-12) * (1.0 - 2.0 * inside),
                    tm.normalize(eye - point),
                    tm.mix(hidden[0], hidden[1], inside),
                    inside,
                    style[m, 5],
                    tm.vec3(axes[0, 0], axes[0, 1], axes[0, 2]),
                    tm.vec3(axes[1, 0], axes[1, 1], axes[1, 2]),
                    tm.vec3(axes[2, 0], axes[2, 1], axes[2, 2]),
                )
                shown = displayed(color)
            for e in ti.static(range(3)):
                corners[at, e] = ti.cast(point[e], ti.f32)
                corners[at, 3 + e] = ti.f32(1.0)  # GGUI normalises it, though the light is ours
                corners[at, 8 + e] = ti.cast(shown[e], ti.f32)
            corners[at, 11] = ti.f32(1.0)


@ti.kernel
@shared
def shrink(
    pixels: ti.types.ndarray(dtype=ti.f32, ndim=3),
    image: ti.types.ndarray(dtype=ti.u8, ndim=3),
    times: ti.i32,
):
    """GGUI's buffer (width, height, 4), first row at the bottom, to a picture (height, width, 3) ``times`` smaller."""
    for row, column in ti.ndrange(image.shape[0], image.shape[1]):
        for k in ti.static(range(3)):
            total = 0.0
            for y, x in ti.ndrange(times, times):
                total += pixels[column * times + x, pixels.shape[1] - 1 - (row * times + y), k]
            image[row, column, k] = ti.cast(tm.clamp(total / (times * times), 0.0, 1.0) * 255.0 + 0.5, ti.u8)
