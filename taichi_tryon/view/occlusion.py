"""How much of the sky each vertex sees: depth in folds, under arms and between legs, for both renderers.

The scene is drawn into small depth maps from many directions without perspective; a vertex sees a direction when it is
not behind the map's depth. That is ambient occlusion by shadow maps: cheap, and the same for all views of one instant.
"""

from dataclasses import replace

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tryon.kernel_loops import shared
from taichi_tryon.view.mesh import DrawList, smoothed
from taichi_tryon.view.zbuffer import edge

DIRECTIONS = 24
RESOLUTION = 192
_SMOOTHING = 4  # rounds: shadows of single directions leave no edges on the skin
_OFFSET = 0.010  # m along the normal before asking: a surface does not hide itself
_FLOOR = 0.25  # light from below is that part of the light from above


class Occlusion:
    """Owns the depth maps, made once."""

    def __init__(self):
        self._maps = ti.ndarray(ti.i32, shape=(DIRECTIONS, RESOLUTION, RESOLUTION))
        self._frames = frames(DIRECTIONS)

    def apply(self, draw: DrawList) -> DrawList:
        """The same list with ``openness`` filled in."""
        low, high = draw.vertices.min(axis=0), draw.vertices.max(axis=0)
        center, radius = (low + high) / 2, float(np.linalg.norm(high - low) / 2) + 1e-6
        openness = np.empty((len(draw.vertices), 2), np.float32)
        middle = ti.types.vector(3, ti.f32)(*center)
        placed = np.empty((DIRECTIONS, len(draw.vertices), 3), np.float32)
        fill_maps(draw.vertices, draw.triangles, self._frames, self._maps, placed, middle, radius)
        ask_maps(draw.vertices, draw.normals, self._frames, self._maps, openness, middle, radius)
        return replace(draw, openness=smoothed(openness, draw.triangles, _SMOOTHING).astype(np.float32))


def frames(count: int) -> np.ndarray:
    """(count, 3, 3) float32 rows right, up, towards the light: directions spread evenly over the sphere (Fibonacci)."""
    k = np.arange(count) + 0.5
    height = 1 - 2 * k / count
    around = np.pi * (1 + np.sqrt(5)) * k
    flat = np.sqrt(1 - height**2)
    light = np.stack([flat * np.cos(around), height, flat * np.sin(around)], axis=1)
    right = np.cross([0.0, 1.0, 0.0], light)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    return np.stack([right, np.cross(light, right), light], axis=1).astype(np.float32)


@ti.func
def _place(frames: ti.template(), d, p, radius):
    """Map coordinates and depth in 0..1 (0 nearest to the light) of a point relative to the centre."""
    x = frames[d, 0, 0] * p[0] + frames[d, 0, 1] * p[1] + frames[d, 0, 2] * p[2]
    y = frames[d, 1, 0] * p[0] + frames[d, 1, 1] * p[1] + frames[d, 1, 2] * p[2]
    z = frames[d, 2, 0] * p[0] + frames[d, 2, 1] * p[1] + frames[d, 2, 2] * p[2]
    return tm.vec3((0.5 + 0.5 * x / radius) * RESOLUTION, (0.5 + 0.5 * y / radius) * RESOLUTION, 0.5 - 0.5 * z / radius)


@ti.kernel
@shared
def fill_maps(
    vertices: ti.types.ndarray(dtype=ti.f32, ndim=2),
    triangles: ti.types.ndarray(dtype=ti.i32, ndim=2),
    frames: ti.types.ndarray(dtype=ti.f32, ndim=3),
    maps: ti.types.ndarray(dtype=ti.i32, ndim=3),
    placed: ti.types.ndarray(dtype=ti.f32, ndim=3),
    center: ti.types.vector(3, ti.f32),
    radius: ti.f32,
):
    """maps: depth of the front-most surface, in 2^-28; placed (directions, nv, 3): room for vertices on the maps."""
    for d, i, j in maps:
        maps[d, i, j] = 2**30
    for d, v in ti.ndrange(maps.shape[0], vertices.shape[0]):
        at = _place(frames, d, tm.vec3(vertices[v, 0], vertices[v, 1], vertices[v, 2]) - center, radius)
        for k in ti.static(range(3)):
            placed[d, v, k] = ti.cast(at[k], ti.f32)
    for d, t in ti.ndrange(maps.shape[0], triangles.shape[0]):
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        a = tm.vec3(placed[d, i, 0], placed[d, i, 1], placed[d, i, 2])
        b = tm.vec3(placed[d, j, 0], placed[d, j, 1], placed[d, j, 2])
        c = tm.vec3(placed[d, k, 0], placed[d, k, 1], placed[d, k, 2])
        area = edge(a[0], a[1], b[0], b[1], c[0], c[1])
        if area != 0:
            x0 = ti.max(ti.cast(ti.ceil(ti.min(a[0], b[0], c[0]) - 0.5), ti.i32), 0)
            x1 = ti.min(ti.cast(ti.floor(ti.max(a[0], b[0], c[0]) - 0.5), ti.i32), RESOLUTION - 1)
            y0 = ti.max(ti.cast(ti.ceil(ti.min(a[1], b[1], c[1]) - 0.5), ti.i32), 0)
            y1 = ti.min(ti.cast(ti.floor(ti.max(a[1], b[1], c[1]) - 0.5), ti.i32), RESOLUTION - 1)
            for y in range(y0, y1 + 1):
                for x in range(x0, x1 + 1):
                    wa = edge(b[0], b[1], c[0], c[1], x + 0.5, y + 0.5) / area
                    wb = edge(c[0], c[1], a[0], a[1], x + 0.5, y + 0.5) / area
                    wc = 1.0 - wa - wb
                    if wa >= -1e-4 and wb >= -1e-4 and wc >= -1e-4:
                        depth = wa * a[2] + wb * b[2] + wc * c[2]
                        ti.atomic_min(maps[d, y, x], ti.cast(depth * 2**28, ti.i32))


@ti.kernel
@shared
def ask_maps(
    vertices: ti.types.ndarray(dtype=ti.f32, ndim=2),
    normals: ti.types.ndarray(dtype=ti.f32, ndim=2),
    frames: ti.types.ndarray(dtype=ti.f32, ndim=3),
    maps: ti.types.ndarray(dtype=ti.i32, ndim=3),
    openness: ti.types.ndarray(dtype=ti.f32, ndim=2),
    center: ti.types.vector(3, ti.f32),
    radius: ti.f32,
):
    for v in range(vertices.shape[0]):
        normal = tm.vec3(normals[v, 0], normals[v, 1], normals[v, 2])
        point = tm.vec3(vertices[v, 0], vertices[v, 1], vertices[v, 2]) - center
        for side in ti.static(range(2)):
            outward = normal * (1.0 - 2.0 * side)
            seen, whole = 0.0, 0.0
            for d in range(maps.shape[0]):
                light = tm.vec3(frames[d, 2, 0], frames[d, 2, 1], frames[d, 2, 2])
                weight = tm.dot(outward, light)
                if weight > 0.05:
                    if light[1] < 0:
                        weight *= _FLOOR
                    at = _place(frames, d, point + _OFFSET * outward, radius)
                    depth = at[2] - 0.5 * _OFFSET / radius
                    seen += weight * _lit_part(maps, d, at[0] - 0.5, at[1] - 0.5, depth)
                    whole += weight
            openness[v, side] = ti.cast(seen / tm.max(whole, 1e-6) if whole > 0 else 1.0, ti.f32)


@ti.func
def _lit_part(maps: ti.template(), d, x, y, depth):
    """Part of the four map samples around that are not in front: the shadow's edge is soft."""
    i, j = ti.cast(ti.floor(y), ti.i32), ti.cast(ti.floor(x), ti.i32)
    fy, fx = y - i, x - j
    total = 0.0
    for di, dj in ti.static(ti.ndrange(2, 2)):
        row = ti.min(ti.max(i + di, 0), RESOLUTION - 1)
        column = ti.min(ti.max(j + dj, 0), RESOLUTION - 1)
        weight = (fy if ti.static(di == 1) else 1.0 - fy) * (fx if ti.static(dj == 1) else 1.0 - fx)
        if depth * 2**28 <= maps[d, row, column]:
            total += weight
    return total
