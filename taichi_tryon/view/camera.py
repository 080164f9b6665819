"""Where a picture is taken from. Left of the renderers: plain NumPy."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from taichi_tryon.errors import InputError

# Direction from the body to the camera: the body faces +z and its left is +x.
VIEWS = {
    "front": (0.0, 0.0, 1.0),
    "back": (0.0, 0.0, -1.0),
    "right": (-1.0, 0.0, 0.0),
    "left": (1.0, 0.0, 0.0),
    "top": (0.0, 1.0, 0.0),
    "three_quarter": (-0.62, 0.18, 0.76),
}
FOV_DEG = 18.0  # a long lens, as for a fashion plate: little perspective, true proportions


@dataclass(frozen=True)
class Camera:
    """A perspective camera.

    Attributes:
        eye, target, up: (3,) m.
        fov_deg: vertical angle of view.
    """

    eye: np.ndarray
    target: np.ndarray
    up: np.ndarray = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))
    fov_deg: float = FOV_DEG

    @property
    def axes(self) -> np.ndarray:
        """(3, 3) rows: the directions right, up and towards the viewer, orthonormal."""
        back = np.asarray(self.eye, float) - np.asarray(self.target, float)
        back /= np.linalg.norm(back)
        right = np.cross(self.up, back)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back])

    @property
    def distance(self) -> float:
        """From eye to target, m."""
        return float(np.linalg.norm(np.asarray(self.eye, float) - self.target))

    def project(self, points: np.ndarray, size: tuple[int, int]) -> np.ndarray:
        """Pixel coordinates (n, 2), x to the right and y down, of points (n, 3) in an image of (width, height)."""
        local = (np.asarray(points, float) - self.eye) @ self.axes.T
        width, height = size
        focal = 0.5 * height / np.tan(np.radians(self.fov_deg) / 2)
        return np.stack(
            [0.5 * width + focal * local[:, 0] / -local[:, 2], 0.5 * height + focal * local[:, 1] / local[:, 2]], axis=1
        )

    def metres_per_pixel(self, height: int) -> float:
        """Size of a pixel in the plane of the target, for an image of that height."""
        return 2.0 * self.distance * float(np.tan(np.radians(self.fov_deg) / 2)) / height


def view_camera(
    name: str,
    bounds: tuple[np.ndarray, np.ndarray],
    aspect: float,
    fov_deg: float = FOV_DEG,
    margin: float = 0.05,
) -> Camera:
    """The camera of a named view, as near as the box fits into the picture.

    Args:
        name: one of ``VIEWS``; "right" is seen from the wearer's right.
        bounds: (lowest, highest) corner of what is to be seen, m.
        aspect: width / height of the picture.
        margin: free border, as a part of the picture.

    Raises:
        InputError: unknown view.
    """
    if name not in VIEWS:
        raise InputError(f"views: unknown view {name!r}; allowed are {', '.join(VIEWS)}")
    low, high = (np.asarray(corner, float) for corner in bounds)
    direction = np.array(VIEWS[name]) / np.linalg.norm(VIEWS[name])
    up = np.array([0.0, 0.0, -1.0]) if name == "top" else np.array([0.0, 1.0, 0.0])
    target = (low + high) / 2
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    local = (corners - target) @ Camera(target + direction, target, up, fov_deg).axes.T
    tangent = np.tan(np.radians(fov_deg) / 2) * (1 - 2 * margin)
    distance = np.max(np.maximum(np.abs(local[:, 0]) / (tangent * aspect), np.abs(local[:, 1]) / tangent) + local[:, 2])
    return Camera(target + max(distance, 1e-3) * direction, target, up, fov_deg)


def view_cameras(names: Iterable[str], bounds: tuple[np.ndarray, np.ndarray], aspect: float) -> dict[str, Camera]:
    """``view_camera`` for several views, all from the same distance: side by side the scale is the same."""
    cameras = {name: view_camera(name, bounds, aspect) for name in names}
    farthest = max(camera.distance for camera in cameras.values())
    return {name: replace(camera, eye=camera.target + farthest * camera.axes[2]) for name, camera in cameras.items()}


def bounds_of(points: Iterable[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """(lowest, highest) corner of several arrays of points (n, 3)."""
    stacked = np.concatenate([np.asarray(each, float) for each in points])
    return stacked.min(axis=0), stacked.max(axis=0)
