"""A pattern drawn as a pattern maker knows it: panels laid out with grain lines, levels, edge names and seam pairs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from shapely import LineString, Point, Polygon
from shapely.ops import polylabel

from taichi_tryon.errors import InputError
from taichi_tryon.pattern.panel import Edge, Panel, Pattern
from taichi_tryon.units import CM

FORMATS = (".svg", ".png")
SHEET_WIDTH = 2.2
"""Panels are laid in rows no wider than this [m]."""
GAP = 0.08
"""Free space between panels [m]."""
INCHES_PER_METRE = 9.0
PNG_DPI = 130
LETTER_WIDTH = 0.6 / 72 / INCHES_PER_METRE
"""Of the usual letter on the sheet, for each point of the letters' size [m]."""
NOTCH = 0.008
"""Length of a notch [m]."""
SMOOTH = np.cos(np.radians(20))
"""Edges that meet with less of a bend are one line for the eye: their common end is marked by a notch."""
INK, LEVEL, OPEN_EDGE = "#222222", "#8899bb", "#222222"


def draw(pattern: Pattern, path: Path) -> None:
    """Draw a pattern into an SVG or PNG file; both sides of a seam share a colour and a number, open edges are black.

    Raises InputError for another kind of file.
    """
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: a pattern is drawn as {' or '.join(FORMATS)}")
    # here, since only drawing needs it, and it is slow to load
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    offsets = layout(pattern)
    corners = np.concatenate([panel.outline() + offsets[panel.name] for panel in pattern.panels.values()])
    low, high = corners.min(axis=0) - GAP, corners.max(axis=0) + GAP
    figure = Figure(figsize=(high - low) * INCHES_PER_METRE)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.axis("off")
    seams = {
        edge: (number, _colour(number, matplotlib))
        for number, seam in enumerate(pattern.seams, start=1)
        for edge in (*seam.a, *seam.b)
    }
    for panel in pattern.panels.values():
        _draw_panel(axes, panel, offsets[panel.name], {e: look for (p, e), look in seams.items() if p == panel.name})
    axes.text(low[0] + GAP / 4, high[1] - GAP / 4, pattern.name, fontsize=11, va="top", color=INK)
    axes.plot(low[0] + GAP / 4 + np.array([0, 0.1]), [low[1] + GAP / 4] * 2, color=INK, lw=1.5)
    axes.text(low[0] + GAP / 4 + 0.11, low[1] + GAP / 4, "10 cm", fontsize=7, va="center", color=INK)
    svg = path.suffix.lower() == ".svg"
    # a fixed salt and no date: the same pattern gives the same file
    with matplotlib.rc_context({"svg.hashsalt": pattern.name}):
        figure.savefig(path, dpi=PNG_DPI, metadata={"Date": None} if svg else None)


def layout(pattern: Pattern) -> dict[str, np.ndarray]:
    """Where each panel's origin goes (2,) [m]: side by side in rows, mirror images on their side of the original."""
    offsets: dict[str, np.ndarray] = {}
    row: list[str] = []
    pen, top = 0.0, 0.0
    boxes = {name: _box(panel) for name, panel in pattern.panels.items()}

    def end_row() -> None:
        nonlocal pen, top, row
        shift = top - max(boxes[name][1, 1] for name in row)
        for name in row:
            offsets[name][1] = shift
        top += min(boxes[name][0, 1] for name in row) - max(boxes[name][1, 1] for name in row) - GAP
        pen, row = 0.0, []

    for name in _in_order(pattern):
        (left, _), (right, _) = boxes[name]
        if row and pen + right - left > SHEET_WIDTH:
            end_row()
        offsets[name] = np.array([pen - left, 0.0])
        pen += right - left + GAP
        row.append(name)
    end_row()
    return offsets


def _box(panel: Panel) -> np.ndarray:
    outline = panel.outline()
    return np.stack([outline.min(axis=0), outline.max(axis=0)])


def _in_order(pattern: Pattern) -> Iterator[str]:
    """Panel names, every mirror image next to its original, on the side where it is worn."""
    for name, panel in pattern.panels.items():
        if panel.mirror_of is None:
            images = [other for other, p in pattern.panels.items() if p.mirror_of == name]
            on_right = _box(panel).sum(axis=0)[0] > 0
            yield from (*images, name) if on_right else (name, *images)


def _colour(number: int, matplotlib) -> tuple[float, ...]:
    """Colours far apart for neighbouring numbers, dark enough on white."""
    return matplotlib.colors.hsv_to_rgb(((number * 0.381966) % 1, 0.85, 0.75))


def _draw_panel(axes, panel: Panel, offset: np.ndarray, seams: dict[str, tuple[int, tuple[float, ...]]]) -> None:
    polygon = Polygon(panel.outline() + offset)
    counter_clockwise = panel.signed_area > 0
    axes.fill(*np.array(polygon.exterior.coords).T, color="#f4f1ea", zorder=0)
    for name, height in panel.levels.items():
        _draw_level(axes, polygon, name, height + offset[1])
    for edge in panel.edges:
        number, colour = seams.get(edge.name, (None, OPEN_EDGE))
        axes.plot(*(edge.sample(33) + offset).T, color=colour, lw=1.6, solid_capstyle="round", zorder=3)
        _label_edge(axes, edge, offset, counter_clockwise)
    numbers = {name: number for name, (number, _) in seams.items()}
    for name, place in _number_places(panel, numbers).items():
        number, colour = seams[name]
        look = dict(fontsize=7, weight="bold", color=colour, ha="center", va="center", zorder=5)
        axes.text(*(place + offset), str(number), **look)
    for edge, following in _neighbours(panel):
        direction = edge.tangent(1.0)
        if direction @ following.tangent(0.0) > SMOOTH:
            inward = _inward(direction, counter_clockwise)
            axes.plot(*np.stack([edge.end, edge.end + NOTCH * inward]).T + offset[:, None], color=INK, lw=1.2, zorder=4)
    _draw_grain(axes, panel, polygon)


def _inward(direction: np.ndarray, counter_clockwise: bool) -> np.ndarray:
    return np.array([-direction[1], direction[0]]) * (1 if counter_clockwise else -1)


def _label_edge(axes, edge: Edge, offset: np.ndarray, counter_clockwise: bool) -> None:
    """The edge's name, inside along its middle."""
    middle, direction = edge.at(np.array([0.5]))[0] + offset, edge.tangent(0.5)
    inward = _inward(direction, counter_clockwise)
    angle = np.degrees(np.arctan2(direction[1], direction[0]))
    upright = (angle + 90) % 180 - 90
    look = dict(ha="center", va="center", rotation_mode="anchor", zorder=5)
    size = float(np.clip(0.75 * edge.length / (LETTER_WIDTH * len(edge.name)), 3.5, 6.5))
    axes.text(*(middle + 0.011 * inward), edge.name, fontsize=size, rotation=upright, color=INK, **look)


def _neighbours(panel: Panel) -> Iterator[tuple[Edge, Edge]]:
    """Every edge with the one that follows it."""
    return zip(panel.edges, (*panel.edges[1:], panel.edges[0]), strict=True)


def _number_places(panel: Panel, numbers: dict[str, int]) -> dict[str, np.ndarray]:
    """Place (2,) of the seam's number by edge: outside the edge's middle, or once over the mouth of a dart."""
    sense = panel.signed_area > 0
    places = {}
    for edge in panel.edges:
        if edge.name in numbers:
            places[edge.name] = edge.at(np.array([0.5]))[0] - 0.014 * _inward(edge.tangent(0.5), sense)
    for leg, other in _neighbours(panel):
        if leg.name in numbers and numbers[leg.name] == numbers.get(other.name):
            mouth = (leg.start + other.end) / 2
            from_point = mouth - leg.end
            places[leg.name] = mouth + 0.014 * from_point / np.linalg.norm(from_point)
            del places[other.name]
    return places


def _draw_level(axes, polygon: Polygon, name: str, height: float) -> None:
    left, _, right, _ = polygon.bounds
    cut = polygon.intersection(LineString([(left - 1, height), (right + 1, height)]))
    for i, piece in enumerate(_lines(cut)):
        axes.plot(*np.array(piece.coords).T, color=LEVEL, lw=0.7, ls=(0, (6, 4)), zorder=1)
        if i == 0:
            x = piece.bounds[0] + 0.03
            axes.text(x, height + 0.003, name, fontsize=5, color=LEVEL, va="bottom", zorder=2)


def _draw_grain(axes, panel: Panel, polygon: Polygon) -> None:
    """An arrow with two heads through the panel's roomiest place, and the panel's name across it."""
    center = np.array(polylabel(polygon, tolerance=1e-3).coords[0])
    reach = 10 * panel.grain
    through = polygon.intersection(LineString([center - reach, center + reach]))
    piece = min(_lines(through), key=lambda line: line.distance(Point(center)))
    ends = np.array(piece.coords)
    middle, half = ends.mean(axis=0), min(0.35 * piece.length, 0.2)
    arrow = dict(arrowstyle="<|-|>", color=INK, lw=0.9, mutation_scale=9, shrinkA=0, shrinkB=0)
    axes.annotate("", middle + half * panel.grain, middle - half * panel.grain, arrowprops=arrow, zorder=2)
    text = f"{panel.name}\n{panel.area / CM**2:.0f} cm²"
    box = dict(facecolor="#f4f1ea", edgecolor="none", pad=1.5)
    axes.text(*middle, text, fontsize=8, ha="center", va="center", color=INK, bbox=box, zorder=6)


def _lines(shape) -> list[LineString]:
    if isinstance(shape, LineString):
        return [] if shape.is_empty else [shape]
    return [part for part in getattr(shape, "geoms", ()) if isinstance(part, LineString)]
