"""Where mesh vertices lie on the edges of a pattern: alike on both sides of every seam."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_tryon.pattern.panel import EdgeName, Pattern, Seam

MEETING_SHARE = 0.35
"""Ends of edges within a chain that lie closer across the seam than this share of the edge length are sewn together."""


@dataclass(frozen=True, eq=False)
class EdgeSamples:
    """Vertices along one edge in its own direction: ``fractions`` (n,) of its length, from 0 to 1.

    Points of sewn edges that carry the same number ``knots`` (n,) of the same ``seam`` become one vertex, but for those
    that are not ``sewn`` (n,) bool, where a closure is open; all are None for an edge without a seam.
    """

    fractions: np.ndarray
    seam: str | None = None
    knots: np.ndarray | None = None
    sewn: np.ndarray | None = None


def sample_edges(pattern: Pattern, edge_length: float) -> dict[EdgeName, EdgeSamples]:
    """Samples of every edge at equal arc length, at most ``edge_length`` [m] apart; ends of edges always are samples.

    Along a seam the longer side decides, and both sides get the same number of segments.
    """
    samples: dict[EdgeName, EdgeSamples] = {}
    for seam in pattern.seams:
        samples |= _sample_seam(pattern, seam, edge_length)
    for panel in pattern.panels.values():
        for edge in panel.edges:
            count = _segments(edge.length, edge_length)
            samples.setdefault((panel.name, edge.name), EdgeSamples(np.linspace(0, 1, count + 1)))
    return samples


def _sample_seam(pattern: Pattern, seam: Seam, edge_length: float) -> dict[EdgeName, EdgeSamples]:
    """Samples of all edges of a seam. Positions run along side a, as fractions of each side's whole length."""
    lengths_a, lengths_b = ([pattern.edge(name).length for name in side] for side in (seam.a, seam.b))
    total_a, total_b = sum(lengths_a), sum(lengths_b)
    corners_a, corners_b = (np.concatenate([[0], np.cumsum(side)]) / sum(side) for side in (lengths_a, lengths_b))
    if seam.reversed:
        corners_b = 1 - corners_b[::-1]
    reach = max(seam.ease, MEETING_SHARE * edge_length) / max(total_a, total_b)
    marks_a, marks_b = _common_marks(corners_a, corners_b, reach)
    for mark in np.array(seam.marks) / total_a:
        if np.abs(marks_a - mark).min() * total_a > MEETING_SHARE * edge_length:
            at = np.searchsorted(marks_a, mark)
            marks_b = np.insert(marks_b, at, np.interp(mark, marks_a, marks_b))
            marks_a = np.insert(marks_a, at, mark)

    positions_a, positions_b = [np.zeros(1)], [np.zeros(1)]
    for step_a, step_b, from_a, from_b in zip(np.diff(marks_a), np.diff(marks_b), marks_a, marks_b, strict=False):
        count = _segments(max(step_a * total_a, step_b * total_b), edge_length)
        within = np.arange(1, count + 1) / count
        positions_a.append(from_a + step_a * within)
        positions_b.append(from_b + step_b * within)
    positions_a, positions_b = np.concatenate(positions_a), np.concatenate(positions_b)
    knots, sewn = np.arange(len(positions_a)), seam.sewn(positions_a * total_a)
    side_a = _cut(seam.name, seam.a, corners_a, positions_a, knots, sewn)
    if seam.reversed:
        positions_b, corners_b, knots, sewn = 1 - positions_b[::-1], 1 - corners_b[::-1], knots[::-1], sewn[::-1]
    return side_a | _cut(seam.name, seam.b, corners_b, positions_b, knots, sewn)


def _common_marks(a: np.ndarray, b: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions on both sides of all corners of either: two corners within ``reach`` meet, others get a partner.

    ``a`` and ``b`` rise from 0 to 1. The partner of a lone corner divides the other side in the same ratio.
    """
    meeting: list[tuple[float, float]] = [(0.0, 0.0)]
    lone_a, lone_b = [], []
    rest_a, rest_b = list(a[1:-1]), list(b[1:-1])
    while rest_a and rest_b:
        if abs(rest_a[0] - rest_b[0]) <= reach:
            meeting.append((rest_a.pop(0), rest_b.pop(0)))
        elif rest_a[0] < rest_b[0]:
            lone_a.append(rest_a.pop(0))
        else:
            lone_b.append(rest_b.pop(0))
    lone_a, lone_b = np.array(lone_a + rest_a), np.array(lone_b + rest_b)
    on_a, on_b = np.array([*meeting, (1.0, 1.0)]).T
    marks_a = np.concatenate([on_a, lone_a, np.interp(lone_b, on_b, on_a)])
    marks_b = np.concatenate([on_b, np.interp(lone_a, on_a, on_b), lone_b])
    order = np.argsort(marks_a, kind="stable")
    return marks_a[order], marks_b[order]


def _cut(
    seam: str,
    side: tuple[EdgeName, ...],
    corners: np.ndarray,
    positions: np.ndarray,
    knots: np.ndarray,
    sewn: np.ndarray,
) -> dict[EdgeName, EdgeSamples]:
    """Share out the positions along a side among its edges; a corner belongs to both its edges."""
    at = np.searchsorted(positions, corners - 1e-9)
    samples = {}
    for name, first, last, start, end in zip(side, at, at[1:], corners, corners[1:], strict=False):
        fractions = (positions[first : last + 1] - start) / (end - start)
        fractions[0], fractions[-1] = 0, 1
        samples[name] = EdgeSamples(fractions, seam, knots[first : last + 1], sewn[first : last + 1])
    return samples


def _segments(length: float, edge_length: float) -> int:
    return max(1, int(np.ceil(length / edge_length - 1e-6)))
