"""The one law of light: both renderers call it, so that their pictures agree.

A studio: key light from the upper left of the camera, weak fill from the right, and a sky that surroundings may hide.
All colours are linear here.
"""

from __future__ import annotations

import taichi as ti
import taichi.math as tm

BACKGROUND = (0.925, 0.93, 0.94)  # sRGB
_KEY = (-0.50, 0.60, 0.62)  # camera axes: right, up, towards the viewer
_FILL = (0.85, 0.05, 0.52)
_LEAST_OPEN = 0.2  # light that comes by way of other surfaces, so that nothing is black
_INSIDE = 0.6  # brightness of the inner side of cloth

vec3 = ti.types.vector(3, ti.f32)


@ti.func
def woven(first, second, uv, width):
    """Colour of a gingham check at ``uv`` (in stripes), edges softened over ``width`` (in stripes).

    Warp yarns change colour along the weft, weft yarns along the warp; where the two differ the eye sees the mean. The
    weft is a little paler, so that warp and weft can be told apart.
    """
    warp = _stripe(uv[1], width)
    weft = _stripe(uv[0], width) * 0.72
    return tm.mix(first, second, 0.5 * (warp + weft))


@ti.func
def _stripe(x, width):
    """0 on even stripes, 1 on odd ones; the edges are at whole numbers."""
    shifted = x - 0.5
    distance = abs(shifted - 2.0 * tm.floor(shifted * 0.5) - 1.0) - 0.5  # to the odd stripe's edge, negative inside
    return tm.clamp(0.5 - distance / width, 0.0, 1.0)


@ti.func
def lit(albedo, normal, view, seen_sky, inside, sheen, right, up, back):
    """Light that leaves a surface point towards the camera.

    ``normal`` faces the viewer, ``view`` points to the camera, both unit; ``seen_sky`` is the part of the sky seen;
    ``inside`` is 1 on the inner side of cloth; ``right, up, back`` are the camera's axes.
    """
    key = tm.normalize(_KEY[0] * right + _KEY[1] * up + _KEY[2] * back)
    fill = tm.normalize(_FILL[0] * right + _FILL[1] * up + _FILL[2] * back)
    # Light wraps a little around the edge between light and shade: a large lamp, not a point.
    from_key = tm.max((tm.dot(normal, key) + 0.15) / 1.15, 0.0)
    from_fill = tm.max((tm.dot(normal, fill) + 0.3) / 1.3, 0.0)
    sky = 0.80 + 0.20 * normal[1]
    openness = _LEAST_OPEN + (1.0 - _LEAST_OPEN) * seen_sky
    light = 0.36 * sky * openness + 0.84 * from_key * (0.25 + 0.75 * openness) + 0.13 * from_fill * openness
    rim = 1.0 - tm.clamp(tm.dot(normal, view), 0.0, 1.0)
    shade = 1.0 - (1.0 - _INSIDE) * inside
    return albedo * light * shade + sheen * rim * rim * rim * openness * shade


@ti.func
def displayed(color):
    """Linear light to sRGB, with a soft shoulder instead of burnt whites."""
    x = tm.max(color, 0.0)
    return tm.pow(x / tm.pow(1.0 + tm.pow(x, 6.0), 1.0 / 6.0), 1.0 / 2.2)
