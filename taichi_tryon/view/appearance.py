"""What things look like: cloth with its weave, skin, and maps of values with their colours."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taichi_tryon.errors import InputError
from taichi_tryon.view.mesh import Mesh, Weave, smoothed, vertex_normals

SKIN = (0.86, 0.71, 0.62)

# Nine points of matplotlib's viridis (value grows with brightness) and of a diverging blue-grey-red.
_SEQUENTIAL = np.array(
    [[68, 1, 84], [71, 45, 123], [59, 82, 139], [44, 114, 142], [33, 145, 140], [40, 174, 128], [94, 201, 98],
     [173, 220, 48], [253, 231, 37]]
) / 255.0  # fmt: skip
_DIVERGING = np.array(
    [[33, 77, 156], [79, 125, 190], [134, 170, 211], [189, 205, 222], [221, 221, 221], [232, 195, 178], [219, 146, 121],
     [191, 89, 74], [150, 32, 41]]
) / 255.0  # fmt: skip


def parse_color(text: str) -> tuple[float, float, float]:
    """sRGB in 0..1 of "#rrggbb".

    Raises:
        InputError: anything else.
    """
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", text):
        raise InputError(f'color: {text!r} is not a colour; write it as "#rrggbb", for example "#8fb3d9"')
    return tuple(int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))


def cloth(
    positions: np.ndarray,
    triangles: np.ndarray,
    rest: np.ndarray,
    color: str,
    checker: float | None = None,
    second_color: str | None = None,
) -> Mesh:
    """A garment to draw.

    Args:
        positions: (nv, 3) m.
        triangles: (nt, 3).
        rest: (nt, 3, 2) m material coordinates of the corners, axis 0 warp.
        color: "#rrggbb".
        checker: stripe width of the woven check, m; None for plain cloth.
        second_color: of the second yarn; without it a paler shade of ``color``.
    """
    first = parse_color(color)
    weave = None
    if checker is not None:
        second = tuple(c + 0.55 * (1 - c) for c in first) if second_color is None else parse_color(second_color)
        weave = Weave(rest, checker, second)
    return Mesh(positions, triangles, first, weave=weave)


def skin(vertices: np.ndarray, triangles: np.ndarray, color: Sequence[float] = SKIN) -> Mesh:
    """The body's closed surface to draw; its normals are smoothed, as marching cubes leave slivers."""
    normals = smoothed(vertex_normals(vertices, triangles), triangles, 2)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return Mesh(vertices, triangles, color, normals=normals, two_sided=False, sheen=0.04)


@dataclass(frozen=True)
class Scale:
    """How values become colours, as the colour bar shows it.

    Attributes:
        label: what is shown, with its unit: "pressure [kPa]".
        low, high: the values at the ends of the bar; values outside take the end's colour.
        diverging: blue - grey - red about the middle instead of dark to bright.
    """

    label: str
    low: float
    high: float
    diverging: bool = False

    def colors(self, values: np.ndarray) -> np.ndarray:
        """sRGB (..., 3) of values (...)."""
        points = _DIVERGING if self.diverging else _SEQUENTIAL
        part = np.clip((np.asarray(values, float) - self.low) / max(self.high - self.low, 1e-300), 0, 1)
        stops = np.linspace(0, 1, len(points))
        return np.stack([np.interp(part, stops, points[:, k]) for k in range(3)], axis=-1)

    @staticmethod
    def fitting(label: str, values: np.ndarray, diverging: bool = False) -> Scale:
        """A scale that holds the middle 98 % of the values; a diverging one is symmetric about zero."""
        low, high = np.percentile(values, [1, 99])
        if diverging:
            high = max(abs(low), abs(high))
            low = -high
        return Scale(label, float(low), float(high if high > low else low + 1e-9), diverging)

    @staticmethod
    def from_zero(label: str, values: np.ndarray) -> Scale:
        """A scale from zero that holds 99 % of the values (n,) above it, of which there may be few."""
        above = values[values > 0]
        return Scale(label, 0.0, float(np.percentile(above, 99)) if len(above) else 1e-9)


def value_map(
    positions: np.ndarray, triangles: np.ndarray, values: np.ndarray, scale: Scale, per_triangle: bool = False
) -> Mesh:
    """A garment coloured by values per vertex (nv,) or, ``per_triangle``, by values (nt,).

    Values per triangle are drawn flat: what is computed is shown, not smoothed.
    """
    colors = scale.colors(values)
    if per_triangle:
        colors = np.repeat(colors[:, None], 3, axis=1)
    return Mesh(positions, triangles, colors, sheen=0.0)
