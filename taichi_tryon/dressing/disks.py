"""Disks around the body (paper, 5.1): a plane carried by a bone, and a rim at some distance from the section."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import label
from scipy.spatial import ConvexHull, QhullError

from taichi_tryon.body.density import density
from taichi_tryon.body.model import Balls, Body
from taichi_tryon.dressing.spec import DiskSpec, DressingSpec
from taichi_tryon.errors import DressingError
from taichi_tryon.units import CM

SIDES = 360  # corners of a rim
RAYS = 96
SHARE = 0.4
GRID = 31  # points across the window in which a section is looked for


@dataclass(frozen=True)
class Disk:
    """A disk in one pose. Going round from ``start`` towards ``left`` is going leftwards seen along the garment."""

    name: str
    center: np.ndarray  # (3,) centroid of the body's section [m]
    normal: np.ndarray  # (3,) unit, from top to hem
    start: np.ndarray  # (3,) unit, theta = 0
    left: np.ndarray  # (3,) unit, theta = 90 degrees
    rim: np.ndarray  # (SIDES + 1, 3) points at equal arc length, the last one closes it or ends the half

    def point(self, t: np.ndarray) -> np.ndarray:
        """Points (k, 3) of the rim at shares ``t`` (k,) of its length (eqs. 4 and 5)."""
        x = np.clip(t, 0, 1) * SIDES
        i = np.minimum(x.astype(int), SIDES - 1)
        f = (x - i)[:, None]
        return (1 - f) * self.rim[i] + f * self.rim[i + 1]


def disk_frame(spec: DressingSpec, name: str, body: Body, transforms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A point (3,) [m] of a disk's plane and its unit normal (3,) where the bones stand at ``transforms`` (b, 4, 4).

    It is where the garment belongs, not where it is pulled up to.
    """
    disk = spec.disks[name]
    point, normal, _, _ = _frame(name, disk, body, transforms)
    return point - disk.lift_cm * CM * normal, normal


def make_disk(spec: DressingSpec, name: str, body: Body, transforms: np.ndarray, balls: Balls, extra: float) -> Disk:
    """The disk where the body has these ``balls``; ``extra`` [m] widens the rim for garments underneath."""
    disk = spec.disks[name]
    point, normal, start, left = _frame(name, disk, body, transforms)
    groups = body.groups(*disk.groups)
    section = _Section(balls, groups, point, start, left)
    center = section.centroid(disk.reach_cm * CM)
    if center is None:
        raise DressingError(
            f"dressing '{spec.dressing}', disk '{name}': groups {', '.join(disk.groups)} have no section there; "
            f"look at its `at`, `offset_cm` and `groups`"
        )
    outline = center + section.outline(center, disk.reach_cm * CM)
    rim, outward = _rim(disk.outline, center, outline)
    rim = rim + _free_ease(section, rim, outward, disk.ease_cm * CM + extra)[:, None] * outward
    rim = _resample(_from_start(rim, center, disk.half))
    middle = point + center @ np.array([start, left]) - (disk.lift_cm + disk.pulled_up_cm) * CM * normal
    return Disk(name, middle, normal, start, left, middle + (rim - center) @ np.array([start, left]))


def _frame(name: str, disk: DiskSpec, body: Body, transforms: np.ndarray):
    """Point of the plane, normal, direction of theta = 0 and the one 90 degrees on, in the pose."""
    bones = body.skeleton.names
    if disk.at in body.landmarks:
        rest = body.landmarks[disk.at].position
    elif disk.at in bones:
        rest = body.skeleton.heads[bones.index(disk.at)]
    else:
        known = ", ".join([*body.landmarks, *bones])
        raise DressingError(
            f"disk '{name}': at: no landmark or bone of body '{body.name}' is named '{disk.at}'; {known}"
        )
    motion = transforms[body.skeleton.index(disk.turns_with)]
    turn = motion[:3, :3]
    point = turn @ (rest + np.array(disk.offset_cm) * CM) + motion[:3, 3]
    if disk.bisects_with is not None:
        left_, _, right_ = np.linalg.svd(turn + transforms[body.skeleton.index(disk.bisects_with)][:3, :3])
        turn = left_ @ right_
    normal = turn @ np.array(disk.normal)
    normal /= np.linalg.norm(normal)
    start = turn @ np.array(disk.start)
    start -= (start @ normal) * normal
    start /= np.linalg.norm(start)
    return point, normal, start, np.cross(start, normal)


@dataclass(frozen=True)
class _Section:
    """A section of some groups in the plane through ``origin``, in plane coordinates along ``start`` and ``left``."""

    balls: Balls
    groups: tuple[int, ...] | None
    origin: np.ndarray
    start: np.ndarray
    left: np.ndarray

    def inside(self, points: np.ndarray) -> np.ndarray:
        """Whether plane points (.., 2) lie in the body."""
        x = self.origin + points.reshape(-1, 2) @ np.array([self.start, self.left])
        return (density(self.balls, x, self.groups) >= 1).reshape(points.shape[:-1])

    def centroid(self, reach: float) -> np.ndarray | None:
        """Centroid (2,) of the connected part nearest to the origin; None without one."""
        line = np.linspace(-reach, reach, GRID)
        grid = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1)
        distance = np.linalg.norm(grid, axis=-1)
        parts, _ = label(self.inside(grid) & (distance <= reach))
        if not parts.any():
            return None
        part = parts == parts.flat[np.where(parts > 0, distance, np.inf).argmin()]
        return grid[part].mean(axis=0)

    def outline(self, center: np.ndarray, reach: float) -> np.ndarray:
        """(RAYS, 2) vectors from the centre to where the body ends first, at even angles."""
        angle = np.arange(RAYS) * (2 * np.pi / RAYS)
        ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        steps = np.linspace(0, reach, 65)
        inside = self.inside(center + steps[:, None, None] * ray)
        first = np.where(inside.all(axis=0), len(steps) - 1, inside.argmin(axis=0))
        low, high = steps[np.maximum(first - 1, 0)], steps[first]
        for _ in range(8):
            middle = 0.5 * (low + high)
            within = self.inside(center + middle[:, None] * ray)
            low, high = np.where(within, middle, low), np.where(within, high, middle)
        return low[:, None] * ray


def _rim(kind: str, center: np.ndarray, outline: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (SIDES, 2) about the section's ``outline`` (k, 2), and the directions (SIDES, 2) of their ease."""
    angle = np.arange(SIDES) * (2 * np.pi / SIDES)
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    offset = outline - center
    if kind == "circle":
        return center + np.linalg.norm(offset, axis=1).max() * direction, direction
    if kind == "ellipse":
        low, high = offset.min(axis=0), offset.max(axis=0)
        axes = (high - low) / 2
        # the least factor that takes the ellipse of the section's box around all of the section
        around = np.linalg.norm((offset - (low + high) / 2) / axes, axis=1).max()
        return center + (low + high) / 2 + axes * around * direction, direction
    try:
        hull = outline[ConvexHull(outline).vertices]
    except QhullError as error:
        raise DressingError("a disk's section is too thin to go around; move the disk") from error
    # the hull's corners with their outward normals, at every angle of the normal: widened, they make a convex rim
    return hull[(direction @ hull.T).argmax(axis=1)], direction


def _free_ease(section: _Section, rim: np.ndarray, outward: np.ndarray, ease: float) -> np.ndarray:
    """Ease (SIDES,) [m] at each point of a rim: less than wanted where another part of the body is near.

    The cloth of both parts must fit between them, so each gets no more than ``SHARE`` of the room.
    """
    reach = np.linspace(2e-3, 2.5 * ease + 2e-3, 40)
    body = _Section(section.balls, None, section.origin, section.start, section.left)
    blocked = body.inside(rim + reach[:, None, None] * outward)
    room = np.where(blocked.any(axis=0), reach[blocked.argmax(axis=0)], np.inf)
    return np.minimum(ease, SHARE * room)


def _from_start(rim: np.ndarray, center: np.ndarray, half: bool) -> np.ndarray:
    """The rim as an open line (k, 2) that starts and ends on the direction of theta = 0 (half: ends opposite)."""
    angle = np.unwrap(np.arctan2(*(rim - center).T[::-1]))
    turns = np.concatenate([angle - 2 * np.pi, angle, angle + 2 * np.pi])
    points = np.concatenate([rim, rim, rim])
    end = np.pi if half else 2 * np.pi
    inner = (turns > 1e-9) & (turns < end - 1e-9)
    ends = np.stack([np.interp([0, end], turns, points[:, k]) for k in range(2)], axis=1)
    return np.concatenate([ends[:1], points[inner], ends[1:]])


def _resample(line: np.ndarray) -> np.ndarray:
    """SIDES + 1 points (.., 2) at equal arc length along a line."""
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.linspace(0, length[-1], SIDES + 1)
    return np.stack([np.interp(at, length, line[:, k]) for k in range(2)], axis=1)
