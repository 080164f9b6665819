"""Sections of the body by rays and planes, and girths as a tape takes them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from taichi_tryon.body.density import density
from taichi_tryon.body.model import Balls, Body

_SAMPLE_SPACING = 2e-3  # [m]; a gap in the body thinner than this along a ray may be overlooked
_BISECTIONS = 30  # 2 mm / 2^30 is below 1e-11 m
_TAPE_RAYS = 96
_TAPE_REACH = 0.6  # [m]; no girth of a person reaches further from the middle of its section


def ray_radius(
    balls: Balls,
    center: np.ndarray,
    directions: np.ndarray,
    groups: tuple[int, ...] | None = None,
    max_radius: float = _TAPE_REACH,
) -> np.ndarray:
    """Distance (k,) [m] from ``center`` (3,) to where rays along unit ``directions`` (k, 3) leave the body for good.

    The largest root of W = 1 up to ``max_radius`` [m] among the given groups (None: all). NaN where a ray meets no
    skin, or is still inside at ``max_radius``.
    """
    center, directions = np.asarray(center, float), np.asarray(directions, float)
    count = int(np.ceil(max_radius / _SAMPLE_SPACING)) + 1
    radii = np.linspace(0.0, max_radius, count)

    def inside(at: np.ndarray) -> np.ndarray:
        points = center + at[..., None] * directions.reshape(-1, *[1] * (at.ndim - 1), 3)
        return (density(balls, points.reshape(-1, 3), groups) >= 1).reshape(at.shape)

    hits = inside(np.broadcast_to(radii, (len(directions), count)))
    last = count - 1 - hits[:, ::-1].argmax(axis=1)
    found = hits.any(axis=1) & (last < count - 1)
    low = radii[last]
    high = radii[np.minimum(last + 1, count - 1)]
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        within = inside(middle)
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    return np.where(found, (low + high) / 2, np.nan)


def plane_basis(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two orthogonal unit vectors (3,) across a unit ``normal`` (3,)."""
    helper = np.eye(3)[np.abs(normal).argmin()]
    first = np.cross(normal, helper)
    first /= np.linalg.norm(first)
    return first, np.cross(normal, first)


def section(
    balls: Balls, plane_point: np.ndarray, plane_normal: np.ndarray, groups: tuple[int, ...] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Outermost points (k, 3) [m] of a plane section in turn around it, and its centroid (3,) [m].

    Rays go out from ``plane_point`` first, then from the centroid of what they hit, for even spacing. Raises ValueError
    where the plane meets none of the groups around the point.
    """
    normal = np.asarray(plane_normal, float) / np.linalg.norm(plane_normal)
    first, second = plane_basis(normal)
    angles = np.arange(_TAPE_RAYS) * 2 * np.pi / _TAPE_RAYS
    directions = np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * second
    center = np.asarray(plane_point, float)
    for _ in range(2):
        radii = ray_radius(balls, center, directions, groups)
        seen = np.isfinite(radii)
        if seen.sum() < 3:
            raise ValueError(f"no closed section of groups {groups} around {np.round(center, 3)} m in the plane")
        points = center + radii[seen, None] * directions[seen]
        flat = (points - center) @ np.column_stack((first, second))
        center = center + _polygon_centroid(flat) @ np.vstack((first, second))
    return points, center


def girth(
    balls: Balls, plane_point: np.ndarray, plane_normal: np.ndarray, groups: tuple[int, ...] | None = None
) -> float:
    """Length [m] of a tape around a plane section: perimeter of its convex hull (ISO 8559-1), to 0.02 %."""
    points, center = section(balls, plane_point, plane_normal, groups)
    normal = np.asarray(plane_normal, float) / np.linalg.norm(plane_normal)
    flat = (points - center) @ np.column_stack(plane_basis(normal))
    return float(ConvexHull(flat).area)  # in the plane, scipy's "area" is the perimeter


def measure(body: Body, transforms: np.ndarray) -> list[tuple[str, float, float | None]]:
    """(name, girth [m], published girth [m] or None) of all measurements, bones at ``transforms`` (b, 4, 4)."""
    balls = body.posed(transforms)
    results = []
    for name, tape in body.measurements.items():
        motion = transforms[body.skeleton.index(tape.bone)]
        point = motion[:3, :3] @ tape.point + motion[:3, 3]
        results.append((name, girth(balls, point, motion[:3, :3] @ tape.normal, tape.groups), tape.published))
    return results


def _polygon_centroid(points: np.ndarray) -> np.ndarray:
    """Centroid (2,) of the area of a polygon (k, 2)."""
    ahead = np.roll(points, -1, axis=0)
    cross = points[:, 0] * ahead[:, 1] - points[:, 1] * ahead[:, 0]
    return ((points + ahead) * cross[:, None]).sum(axis=0) / (3 * cross.sum())
