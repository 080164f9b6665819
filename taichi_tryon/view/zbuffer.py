"""Filling triangles into a depth buffer: which triangle is in front at each sample.

Depth and triangle number share one 64-bit word and the smallest word wins, so that the result does not depend on the
order in which threads come.
"""

import taichi as ti
import taichi.math as tm

from taichi_tryon.kernel_loops import shared

EMPTY = 2**62
_SHIFT = 2**32
TRIANGLE = _SHIFT - 1  # the bits that hold the triangle
_LEVELS = 2.0**30  # depth steps between nearest and farthest


@ti.func
def edge(ax, ay, bx, by, px, py):
    """Twice the signed area of (a, b, p)."""
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax)


@ti.kernel
@shared
def clear(words: ti.types.ndarray(dtype=ti.i64, ndim=1)):
    for i in words:
        words[i] = ti.i64(EMPTY)


@ti.kernel
@shared
def project(
    vertices: ti.types.ndarray(dtype=ti.f32, ndim=2),
    screen: ti.types.ndarray(dtype=ti.f32, ndim=2),
    axes: ti.types.ndarray(dtype=ti.f32, ndim=2),
    eye: ti.types.vector(3, ti.f32),
    focal: ti.f32,
    width: ti.i32,
    height: ti.i32,
):
    """screen (n, 3): sample coordinates x right, y down, rounded to 1/256 (then areas are exact), and 1 / distance."""
    for i in range(vertices.shape[0]):
        p = tm.vec3(vertices[i, 0], vertices[i, 1], vertices[i, 2]) - eye
        x = axes[0, 0] * p[0] + axes[0, 1] * p[1] + axes[0, 2] * p[2]
        y = axes[1, 0] * p[0] + axes[1, 1] * p[1] + axes[1, 2] * p[2]
        z = -(axes[2, 0] * p[0] + axes[2, 1] * p[1] + axes[2, 2] * p[2])
        if z > 1e-3:
            screen[i, 0] = _rounded(0.5 * width + focal * x / z)
            screen[i, 1] = _rounded(0.5 * height - focal * y / z)
            screen[i, 2] = ti.cast(1.0 / z, ti.f32)
        else:
            screen[i, 2] = ti.f32(0.0)  # behind the camera: its triangles are left out


@ti.func
def _rounded(x):
    return ti.cast(ti.floor(x * 256.0 + 0.5) / 256.0, ti.f32)


@ti.kernel
@shared
def fill(
    screen: ti.types.ndarray(dtype=ti.f32, ndim=2),
    triangles: ti.types.ndarray(dtype=ti.i32, ndim=2),
    mesh: ti.types.ndarray(dtype=ti.i32, ndim=1),
    style: ti.types.ndarray(dtype=ti.f32, ndim=2),
    words: ti.types.ndarray(dtype=ti.i64, ndim=1),
    nearest: ti.f32,
    farthest: ti.f32,
    width: ti.i32,
    height: ti.i32,
):
    """words (width * height,): front-most ``depth level * 2^32 + triangle`` at each sample.

    1 / distance is linear over the picture; ``nearest`` and ``farthest`` are its bounds. One-sided meshes show only
    triangles that face the camera.
    """
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = ti.cast(screen[a, 0], ti.f64), ti.cast(screen[a, 1], ti.f64)
        bx, by = ti.cast(screen[b, 0], ti.f64), ti.cast(screen[b, 1], ti.f64)
        cx, cy = ti.cast(screen[c, 0], ti.f64), ti.cast(screen[c, 1], ti.f64)
        area = edge(ax, ay, bx, by, cx, cy)
        seen = screen[a, 2] > 0 and screen[b, 2] > 0 and screen[c, 2] > 0 and area != 0
        if area > 0 and style[mesh[t], 0] == 0:  # y runs down: counter-clockwise in space is a negative area
            seen = False
        if seen:
            x0 = ti.max(ti.cast(ti.ceil(ti.min(ax, bx, cx) - 0.5), ti.i32), 0)
            x1 = ti.min(ti.cast(ti.floor(ti.max(ax, bx, cx) - 0.5), ti.i32), width - 1)
            y0 = ti.max(ti.cast(ti.ceil(ti.min(ay, by, cy) - 0.5), ti.i32), 0)
            y1 = ti.min(ti.cast(ti.floor(ti.max(ay, by, cy) - 0.5), ti.i32), height - 1)
            scale = 1.0 / area
            for y in range(y0, y1 + 1):
                for x in range(x0, x1 + 1):
                    px, py = x + ti.cast(0.5, ti.f64), y + ti.cast(0.5, ti.f64)
                    wa = edge(bx, by, cx, cy, px, py) * scale
                    wb = edge(cx, cy, ax, ay, px, py) * scale
                    wc = edge(ax, ay, bx, by, px, py) * scale
                    if wa >= 0 and wb >= 0 and wc >= 0:
                        near = wa * screen[a, 2] + wb * screen[b, 2] + wc * screen[c, 2]
                        depth = tm.clamp((nearest - near) / (nearest - farthest), 0.0, 1.0)
                        level = ti.cast(depth * _LEVELS, ti.i64)
                        ti.atomic_min(words[y * width + x], level * ti.i64(_SHIFT) + t)
