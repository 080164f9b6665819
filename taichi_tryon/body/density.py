"""Density of fused metaballs (eqs. 1 and 2 of the paper) with gradient, Hessian and gap, in NumPy.

One ball: f = w (1 - s)^3 where s = (x - c)^T Q (x - c) < 1, and 0 elsewhere: twice continuously differentiable. Balls
of one group add up, W is the largest sum among the groups, the skin is W = 1, and W > 1 inside. All functions take
points (k, 3) [m] and may be restricted to some groups (indices); the winner is the group with the largest sum.

The density has compact support: where no ball reaches, W and its gradient are 0 and there is no distance to be had.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields

import numpy as np

from taichi_tryon.body.model import Balls

FAR = 1.0
"""Gap [m] that stands for a point which no ball reaches."""

LONGEST_STEP = 0.01
"""Bound on a Newton step [m], for points deep inside where the gradient is small."""
SLIDE = 0.7
"""Share of the tangential shift that a Newton step makes: all of it would overshoot where the skin is curved."""
SLIDE_BAND = 0.01
"""No tangential shift while the foot is further than this [m] from the skin."""

TOLERANCE = 1e-7
"""A Newton step shorter than this [m] is the last."""

_CHUNK = 2048  # points at once: they lie together, and the (points, balls) tables stay in the cache


def density(balls: Balls, x: np.ndarray, groups: tuple[int, ...] | None = None) -> np.ndarray:
    """W (k,) of eq. 2."""
    return _in_chunks(balls, lambda near, part: _sums(near, _rest(near, part), groups).max(axis=1), x)


def winner(balls: Balls, x: np.ndarray, groups: tuple[int, ...] | None = None) -> np.ndarray:
    """Index (k,) of the group with the largest sum."""
    return _in_chunks(balls, lambda near, part: _winners(_sums(near, _rest(near, part), groups), groups), x)


def gradient(balls: Balls, x: np.ndarray, groups: tuple[int, ...] | None = None) -> np.ndarray:
    """Gradient (k, 3) [1/m] of the winner's sum; it points into the body."""
    return _in_chunks(balls, lambda near, part: _value_and_gradient(near, part, groups)[1], x)


def hessian(balls: Balls, x: np.ndarray, groups: tuple[int, ...] | None = None) -> np.ndarray:
    """Hessian (k, 3, 3) [1/m^2] of the winner's sum."""
    return _in_chunks(balls, lambda near, part: _hessian(near, part, groups), x)


def gap(balls: Balls, x: np.ndarray, groups: tuple[int, ...] | None = None) -> np.ndarray:
    """Signed distance (k,) [m] from the skin W = 1, positive outside, FAR where nothing reaches; see ``closest``."""
    return closest(balls, x, groups)[0]


def closest(
    balls: Balls, x: np.ndarray, groups: tuple[int, ...] | None = None, iterations: int = 30
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gap (k,) [m], closest point of the skin (k, 3) [m] and outward unit normal (k, 3) there.

    Newton steps onto W = 1 along the gradient, each with the shift along the tangent plane that brings the foot of the
    perpendicular under x; steps are held below 1 cm so that points deep inside, where the gradient is small, find out
    too. Where nothing reaches: FAR, x itself and a zero normal.
    """
    x = np.asarray(x, float)
    y = x.copy()
    normals = np.zeros_like(x)
    reached = np.zeros(len(x), bool)
    active = np.arange(len(x))
    for _ in range(iterations):
        if not len(active):
            break
        table = _in_chunks(
            balls, lambda near, part: np.column_stack(_value_and_gradient(near, part, groups)), y[active]
        )
        value, slope = table[:, 0], table[:, 1:]
        steepness = np.linalg.norm(slope, axis=1)
        has_slope = (value > 0) & (steepness > 1e-9)
        active, value, slope, steepness = active[has_slope], value[has_slope], slope[has_slope], steepness[has_slope]
        reached[active] = True
        normal = -slope / steepness[:, None]
        normals[active] = normal
        # To first order in W^(1/3), which is quadratic along the radius of a ball where W itself has a flat tail.
        root = np.cbrt(value)
        depth = 3 * root * root * (root - 1) / steepness
        offset = x[active] - y[active]
        slide = SLIDE * (offset - np.einsum("ki,ki->k", offset, normal)[:, None] * normal)
        slide[np.abs(depth) > SLIDE_BAND] = 0.0
        step = np.clip(depth, -LONGEST_STEP, LONGEST_STEP)[:, None] * normal + slide
        y[active] += step
        active = active[np.linalg.norm(step, axis=1) > TOLERANCE]
    distance = np.einsum("ki,ki->k", x - y, normals)
    return np.where(reached, distance, FAR), y, normals


def _in_chunks(balls: Balls, function: Callable[[Balls, np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
    """``function(balls, points)`` by chunks of points, each with only the balls whose boxes meet the chunk's."""
    extents, parts = balls.extents, []
    for part in np.array_split(np.asarray(x, float), max(1, -(-len(x) // _CHUNK))):
        near = np.ones(len(extents), bool)
        if len(part):
            low, high = part.min(axis=0), part.max(axis=0)
            near = ((balls.centers + extents >= low) & (balls.centers - extents <= high)).all(axis=1)
        parts.append(function(_some(balls, near), part))
    return np.concatenate(parts)


def _some(balls: Balls, chosen: np.ndarray) -> Balls:
    return Balls(**{field.name: getattr(balls, field.name)[chosen] for field in fields(balls)})


def _rest(balls: Balls, x: np.ndarray) -> np.ndarray:
    """1 - s (k, n), 0 where a ball does not reach; s is expanded in x so that one matrix product gives all of it."""
    q = balls.quadratics
    qc = np.einsum("nij,nj->ni", q, balls.centers)
    monomials = np.c_[x * x, x[:, [0, 0, 1]] * x[:, [1, 2, 2]], x, np.ones(len(x))]
    coefficients = np.c_[
        q[:, [0, 1, 2], [0, 1, 2]], 2 * q[:, [0, 0, 1], [1, 2, 2]], -2 * qc, np.einsum("ni,ni->n", qc, balls.centers)
    ]
    rest = monomials @ -coefficients.T
    rest += 1
    return np.maximum(rest, 0, out=rest)


def _sums(balls: Balls, rest: np.ndarray, groups: tuple[int, ...] | None) -> np.ndarray:
    membership = balls.membership if groups is None else balls.membership[:, list(groups)]
    return (rest * rest * rest) @ (balls.weights[:, None] * membership)


def _winners(sums: np.ndarray, groups: tuple[int, ...] | None) -> np.ndarray:
    best = sums.argmax(axis=1)
    return best if groups is None else np.asarray(groups)[best]


def _value_and_gradient(balls: Balls, x: np.ndarray, groups: tuple[int, ...] | None) -> tuple[np.ndarray, np.ndarray]:
    rest = _rest(balls, x)
    sums = _sums(balls, rest, groups)
    slope = -6 * rest * rest * balls.weights * balls.membership.T[_winners(sums, groups)]  # d f / d s, twice
    q = balls.quadratics
    qc = np.einsum("nij,nj->ni", q, balls.centers)
    stiffness = (slope @ q.reshape(-1, 9)).reshape(-1, 3, 3)
    return sums.max(axis=1), np.einsum("kij,kj->ki", stiffness, x) - slope @ qc


def _hessian(balls: Balls, x: np.ndarray, groups: tuple[int, ...] | None) -> np.ndarray:
    rest = _rest(balls, x)
    wins = balls.membership.T[_winners(_sums(balls, rest, groups), groups)]
    q = balls.quadratics
    weighted = rest * balls.weights * wins
    inward = np.einsum("nij,knj->kni", q, x[:, None] - balls.centers)
    curved = np.einsum("kn,kni,knj->kij", 24 * weighted, inward, inward)
    return curved - np.einsum("kn,nij->kij", 6 * weighted * rest, q)
