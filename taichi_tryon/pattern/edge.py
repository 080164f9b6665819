"""One edge of a panel: a straight line, a cubic Bezier curve or a circular arc, measured and sampled by arc length."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

_SPANS = 64
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_NODES, _WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2


@dataclass(frozen=True, eq=False)
class Edge:
    """An edge in its own direction, in panel coordinates [m].

    ``points`` (k, 2): start and end of a ``line``; the four control points of a ``cubic``; start, any point on the
    way, and end of an ``arc``.
    """

    name: str
    kind: str
    points: np.ndarray

    @property
    def start(self) -> np.ndarray:
        return self.points[0]

    @property
    def end(self) -> np.ndarray:
        return self.points[-1]

    @property
    def length(self) -> float:
        """Length along the edge [m], by Gauss quadrature: exact for lines and arcs, about 1e-12 relative for cubics."""
        return float(self._arc_lengths[-1])

    def at(self, fractions: np.ndarray) -> np.ndarray:
        """Points (n, 2) at these fractions (n,) of the edge's length; 0 and 1 give its ends exactly."""
        fractions = np.asarray(fractions, dtype=float)
        if self.kind == "cubic":
            points = self._point(self._parameter(fractions * self.length))
        else:  # constant speed: fraction and parameter are the same
            points = self._point(fractions)
        points[fractions <= 0] = self.start
        points[fractions >= 1] = self.end
        return points

    def sample(self, count: int) -> np.ndarray:
        """``count`` points (count, 2) at equal arc length, both ends among them."""
        return self.at(np.linspace(0.0, 1.0, count))

    def tangent(self, fraction: float) -> np.ndarray:
        """Unit direction (2,) of travel at a fraction of the length."""
        step = self.at(np.clip([fraction - 1e-4, fraction + 1e-4], 0, 1))
        direction = step[1] - step[0]
        return direction / np.linalg.norm(direction)

    def swept_area(self) -> float:
        """The edge's share 1/2 integral (x dy - y dx) of the area [m^2] within a loop of edges (Green's theorem)."""
        t = _quadrature_parameters()
        point, rate = self._point(t.ravel()), self._rate(t.ravel())
        integrand = (point[:, 0] * rate[:, 1] - point[:, 1] * rate[:, 0]) / 2
        return float((integrand.reshape(t.shape) @ _WEIGHTS).sum() / _SPANS)

    def turned_round(self) -> Edge:
        """The same edge travelled the other way."""
        return Edge(self.name, self.kind, self.points[::-1].copy())

    def mirrored(self) -> Edge:
        """The edge's mirror image in the panel's y axis, travelled the other way, so that a loop keeps its sense."""
        return Edge(self.name, self.kind, self.points[::-1] * [-1.0, 1.0] + 0.0)

    @cached_property
    def _arc(self) -> tuple[np.ndarray, float, float, float]:
        """Centre (2,), radius, angle at the start and angle swept (signed) of an arc."""
        start, through, end = self.points
        chords = np.stack([through - start, end - start])
        center = start + np.linalg.solve(2 * chords, (chords**2).sum(axis=1))
        angles = np.arctan2(*(self.points - center).T[::-1])
        to_through, to_end = (angles[1:] - angles[0]) % (2 * np.pi)
        swept = to_end if to_through < to_end else to_end - 2 * np.pi
        return center, float(np.linalg.norm(start - center)), float(angles[0]), float(swept)

    @cached_property
    def _arc_lengths(self) -> np.ndarray:
        """Length (_SPANS + 1,) from the start to the ends of equal spans of the parameter."""
        if self.kind == "line":
            return np.linspace(0.0, np.linalg.norm(self.end - self.start), _SPANS + 1)
        if self.kind == "arc":
            _, radius, _, swept = self._arc
            return np.linspace(0.0, radius * abs(swept), _SPANS + 1)
        speed = self._speed(_quadrature_parameters().ravel()).reshape(_SPANS, -1)
        return np.concatenate([[0.0], np.cumsum(speed @ _WEIGHTS) / _SPANS])

    def _parameter(self, length: np.ndarray) -> np.ndarray:
        """Parameters at which the curve has these lengths (n,) behind it: Newton's method within one span."""
        span = np.clip(np.searchsorted(self._arc_lengths, length, side="right") - 1, 0, _SPANS - 1)
        rest = length - self._arc_lengths[span]
        of_span = rest / np.diff(self._arc_lengths)[span]
        for _ in range(6):
            begin, width = span / _SPANS, of_span / _SPANS
            nodes = begin[:, None] + width[:, None] * _NODES
            travelled = (self._speed(nodes.ravel()).reshape(nodes.shape) @ _WEIGHTS) * width
            slope = np.maximum(self._speed(begin + width), 1e-6 * self.length) / _SPANS
            of_span = np.clip(of_span + (rest - travelled) / slope, 0, 1)
        return (span + of_span) / _SPANS

    def _point(self, t: np.ndarray) -> np.ndarray:
        """Points (n, 2) at parameters (n,) within 0 and 1."""
        t = t[:, None]
        if self.kind == "line":
            return self.start + t * (self.end - self.start)
        if self.kind == "arc":
            center, radius, angle, swept = self._arc
            angle = angle + t * swept
            return center + radius * np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
        a, b, c, d = self.points
        s = 1 - t
        return s**3 * a + 3 * s**2 * t * b + 3 * s * t**2 * c + t**3 * d

    def _rate(self, t: np.ndarray) -> np.ndarray:
        """Derivative (n, 2) of the points with respect to the parameter."""
        if self.kind == "line":
            return np.broadcast_to(self.end - self.start, (len(t), 2))
        t = t[:, None]
        if self.kind == "arc":
            _, radius, angle, swept = self._arc
            angle = angle + t * swept
            return radius * swept * np.concatenate([-np.sin(angle), np.cos(angle)], axis=1)
        a, b, c, d = self.points
        s = 1 - t
        return 3 * (s**2 * (b - a) + 2 * s * t * (c - b) + t**2 * (d - c))

    def _speed(self, t: np.ndarray) -> np.ndarray:
        return np.linalg.norm(self._rate(t), axis=1)


def _quadrature_parameters() -> np.ndarray:
    """Gauss parameters (_SPANS, 8) of all spans."""
    return (np.arange(_SPANS)[:, None] + _NODES) / _SPANS
