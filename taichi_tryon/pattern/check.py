"""Whether a pattern can be sewn: all faults at once, each with the place in the YAML that it belongs to."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from shapely import Polygon
from shapely.validation import explain_validity

from taichi_tryon.errors import PatternError
from taichi_tryon.pattern.panel import Panel, Pattern, Seam
from taichi_tryon.units import CM, MM

CLOSING_TOLERANCE = 0.01 * MM
"""How far an edge may begin from the end of the one before it [m]: rounding of written coordinates."""
SEAM_TOLERANCE = 0.5 * MM
"""Difference of the two sides of a seam [m] that counts as rounding and needs no stated ease."""
SHORTEST_EDGE = 1.0 * MM
"""Below this length [m] an edge is a slip of the pen: no mesh can follow it."""


class Fault(NamedTuple):
    """What is wrong, and the keys that lead to it from the top of the pattern's YAML."""

    place: tuple[str | int, ...]
    message: str


def check(pattern: Pattern) -> None:
    """Raise PatternError with every fault of the pattern."""
    found = faults(pattern)
    if found:
        raise PatternError(*(f"pattern '{pattern.name}': {fault.message}" for fault in found))


def faults(pattern: Pattern) -> list[Fault]:
    """Every fault of a pattern: of its panels one by one, then of its seams and bands."""
    found = [fault for panel in pattern.panels.values() if panel.mirror_of is None for fault in _panel_faults(panel)]
    return found + _seam_faults(pattern, sound=not found) + band_faults(pattern)


def _panel_faults(panel: Panel) -> list[Fault]:
    place = ("panels", panel.name)
    found = []
    for name, count in Counter(edge.name for edge in panel.edges).items():
        if count > 1:
            found.append(Fault((*place, "edges"), f"panel '{panel.name}': {count} edges are called '{name}'"))
    if not np.linalg.norm(panel.grain) > 0:
        found.append(Fault((*place, "grain"), f"panel '{panel.name}': the grain line has no direction"))
    outline = _outline_faults(panel)
    return found + (outline or _crossing_faults(panel))


def _outline_faults(panel: Panel) -> list[Fault]:
    """Edges that are degenerate or do not follow each other."""
    found = []
    for i, (edge, following) in enumerate(zip(panel.edges, (*panel.edges[1:], panel.edges[0]), strict=True)):
        place = ("panels", panel.name, "edges", i)
        who = f"panel '{panel.name}', edge '{edge.name}'"
        if edge.kind == "arc" and _is_flat(edge.points):
            found.append(Fault(place, f"{who}: the three points of the arc lie on a line; write it as a line"))
        elif edge.length < SHORTEST_EDGE:
            found.append(Fault(place, f"{who}: {edge.length / CM:.3g} cm long; the least is {SHORTEST_EDGE / CM:g} cm"))
        gap = np.linalg.norm(edge.end - following.start)
        if gap > CLOSING_TOLERANCE:
            found.append(
                Fault(
                    place,
                    f"{who} ends {gap / CM:.3g} cm from where '{following.name}' starts: "
                    "the edges of a panel follow each other round a closed loop",
                )
            )
    return found


def _is_flat(points: np.ndarray) -> bool:
    a, b = points[1] - points[0], points[2] - points[0]
    return abs(a[0] * b[1] - a[1] * b[0]) <= 1e-9 * max(a @ a, b @ b)


def _crossing_faults(panel: Panel) -> list[Fault]:
    polygon = Polygon(panel.outline() / CM)
    if polygon.is_valid and polygon.area > 0:
        return []
    why = explain_validity(polygon)
    where = f" near ({why[why.index('[') + 1 : -1].replace(' ', ', ')}) cm" if "[" in why else ""
    message = f"panel '{panel.name}': the outline crosses or touches itself{where}"
    return [Fault(("panels", panel.name, "edges"), message)]


def _seam_faults(pattern: Pattern, sound: bool) -> list[Fault]:
    """Faults of names, and, where these and the panels are ``sound``, of lengths and directions."""
    found: list[Fault] = []
    names = Counter(seam.name for seam in pattern.seams)
    sewn: dict[tuple[str, str], str] = {}
    for i, seam in enumerate(pattern.seams):
        if names[seam.name] > 1:
            found.append(Fault(("seams", i, "name"), f"{names[seam.name]} seams are called '{seam.name}'"))
        unknown = [
            fault
            for side in ("a", "b")
            for fault in _unknown_edges(pattern, f"seam '{seam.name}'", getattr(seam, side), ("seams", i, side))
        ]
        found += unknown
        for side in ("a", "b"):
            for j, edge in enumerate(getattr(seam, side)):
                if edge in sewn:
                    message = f"seam '{seam.name}': edge {edge[0]}.{edge[1]} is sewn already, by seam '{sewn[edge]}'"
                    found.append(Fault(("seams", i, side, j), message))
                sewn.setdefault(edge, seam.name)
        if sound and not unknown:
            found += _length_faults(pattern, seam, i) + _direction_faults(pattern, seam, i)
            found += _button_faults(pattern, seam, i)
    return found


def band_faults(pattern: Pattern) -> list[Fault]:
    """Every fault of a pattern's bands."""
    found = []
    names = Counter(band.name for band in pattern.bands)
    for i, band in enumerate(pattern.bands):
        if names[band.name] > 1:
            found.append(Fault(("bands", i, "name"), f"{names[band.name]} bands are called '{band.name}'"))
        for j, (panel, edge) in enumerate(band.edges):
            if (panel, edge) in band.edges[:j]:
                message = f"band '{band.name}': edge {panel}.{edge} is listed twice"
                found.append(Fault(("bands", i, "edges", j), message))
        found += _unknown_edges(pattern, f"band '{band.name}'", band.edges, ("bands", i, "edges"))
    return found


def _unknown_edges(
    pattern: Pattern, who: str, edges: tuple[tuple[str, str], ...], place: tuple[str | int, ...]
) -> list[Fault]:
    found = []
    for j, (panel, edge) in enumerate(edges):
        if panel not in pattern.panels:
            message = f"no panel '{panel}'; there are {', '.join(pattern.panels)}"
            found.append(Fault((*place, j), f"{who}: {message}"))
        elif edge not in (names := [e.name for e in pattern.panels[panel].edges]):
            message = f"panel '{panel}' has no edge '{edge}'; there are {', '.join(names)}"
            found.append(Fault((*place, j), f"{who}: {message}"))
    return found


def _length_faults(pattern: Pattern, seam: Seam, index: int) -> list[Fault]:
    a, b = pattern.side_length(seam.a), pattern.side_length(seam.b)
    if abs(a - b) <= seam.ease + SEAM_TOLERANCE:
        return []
    message = (
        f"seam '{seam.name}': side a is {a / CM:.2f} cm long and side b {b / CM:.2f} cm, but the stated ease is "
        f"{seam.ease / CM:g} cm; mend the edges or state the ease by ease_cm"
    )
    return [Fault(("seams", index), message)]


def _button_faults(pattern: Pattern, seam: Seam, index: int) -> list[Fault]:
    length = pattern.side_length(seam.a)
    return [
        Fault(
            ("seams", index, "buttons_cm", j),
            f"seam '{seam.name}': a button at {place / CM:g} cm of a side that is {length / CM:.4g} cm long",
        )
        for j, place in enumerate(seam.buttons)
        if not 0 <= place <= length
    ]


def _direction_faults(pattern: Pattern, seam: Seam, index: int) -> list[Fault]:
    """Loops of the same sense are sewn against each other; otherwise one panel would be inside out."""
    found = []
    senses = {side: {pattern.panels[panel].signed_area > 0 for panel, _ in getattr(seam, side)} for side in ("a", "b")}
    for side, sense in senses.items():
        if len(sense) > 1:
            message = f"seam '{seam.name}': panels of side {side} are drawn in different senses; turn one round"
            found.append(Fault(("seams", index, side), message))
    if not found and (senses["a"] == senses["b"]) != seam.reversed:
        right = "same" if seam.reversed else "reverse"
        message = f"seam '{seam.name}': sewn so, one panel would be inside out; write direction: {right}"
        found.append(Fault(("seams", index, "direction"), message))
    return found + _chain_faults(pattern, seam, index)


def _chain_faults(pattern: Pattern, seam: Seam, index: int) -> list[Fault]:
    """Neighbouring edges of one panel are listed in their running order (there may be a dart between two of them)."""
    found = []
    for side in ("a", "b"):
        for j, (first, second) in enumerate(pairwise(getattr(seam, side))):
            e, f = pattern.edge(first), pattern.edge(second)
            if first[0] == second[0] and _meet(f.end, e.start) and not _meet(e.end, f.start):
                message = f"seam '{seam.name}': '{second[1]}' comes before '{first[1]}' in '{first[0]}'; swap them"
                found.append(Fault(("seams", index, side, j + 1), message))
    return found


def _meet(end: np.ndarray, start: np.ndarray) -> bool:
    return np.linalg.norm(end - start) <= CLOSING_TOLERANCE
