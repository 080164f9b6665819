"""What mouse and keys do in the window, without the window: a camera on a sphere and the flow of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from taichi_tryon.view.camera import FOV_DEG, Camera, view_camera

HELP = (
    "mouse left: turn, right: move",
    "UP DOWN: nearer, farther",
    "LEFT RIGHT: views",
    "SPACE: pause   N: next step",
    "R: reset   ESC: quit",
)


@dataclass(frozen=True)
class Orbit:
    """A camera on a sphere around a target.

    Attributes:
        target: (3,) m.
        distance: m.
        azimuth: rad about +y; 0 looks at the front, positive from the wearer's left.
        elevation: rad above the horizon.
    """

    target: np.ndarray
    distance: float
    azimuth: float = 0.0
    elevation: float = 0.0

    STEEPEST = np.radians(89.0)  # straight above, "up" would be undefined

    @staticmethod
    def of(camera: Camera) -> Orbit:
        """The orbit that passes through a camera's eye."""
        back = camera.axes[2]
        elevation = float(np.clip(np.arcsin(np.clip(back[1], -1, 1)), -Orbit.STEEPEST, Orbit.STEEPEST))
        azimuth = float(np.arctan2(back[0], back[2])) if abs(back[1]) < 0.9999 else 0.0
        return Orbit(np.asarray(camera.target, float), camera.distance, azimuth, elevation)

    @property
    def camera(self) -> Camera:
        """The camera at this place."""
        flat = np.cos(self.elevation)
        back = np.array([flat * np.sin(self.azimuth), np.sin(self.elevation), flat * np.cos(self.azimuth)])
        return Camera(self.target + self.distance * back, self.target)

    def turned(self, dx: float, dy: float) -> Orbit:
        """After the mouse moved by parts of the window's size: the object follows the hand."""
        elevation = float(np.clip(self.elevation - np.pi * dy, -self.STEEPEST, self.STEEPEST))
        return replace(self, azimuth=self.azimuth - 2 * np.pi * dx, elevation=elevation)

    def moved(self, dx: float, dy: float, aspect: float) -> Orbit:
        """The object moves with the hand, in the picture's plane."""
        height = 2 * self.distance * np.tan(np.radians(FOV_DEG) / 2)
        right, up, _ = self.camera.axes
        return replace(self, target=self.target - height * (aspect * dx * right + dy * up))

    def nearer(self, factor: float) -> Orbit:
        """Distance divided by ``factor``, between 0.3 m and 100 m."""
        return replace(self, distance=float(np.clip(self.distance / factor, 0.3, 100.0)))


class Controls:
    """The state that keys and mouse change; the window asks it what to do in each round.

    Args:
        bounds: (lowest, highest) corner of what is seen, m.
        aspect: width / height of the window.
        views: those that LEFT and RIGHT go through; the first is shown first.
    """

    ZOOM = 1.15

    def __init__(
        self,
        bounds: tuple[np.ndarray, np.ndarray],
        aspect: float,
        views: Sequence[str] = ("front", "right", "back", "left", "three_quarter"),
    ):
        self.aspect = aspect
        self.views = tuple(views)
        self._orbits = [Orbit.of(view_camera(view, bounds, aspect)) for view in self.views]
        self._view = 0
        self.orbit = self._orbits[0]
        self.paused = False
        self.quit = False
        self._single_step = False
        self._reset = False
        self._cursor: tuple[float, float] | None = None

    def press(self, key: str) -> None:
        """A key went down, by GGUI's name; GGUI tells of letters, SPACE and arrows, not of digits and signs."""
        if key == " ":
            self.paused = not self.paused
        elif key == "n":
            self.paused = self._single_step = True
        elif key == "r":
            self._reset = True
        elif key == "Escape":
            self.quit = True
        elif key == "Up":
            self.orbit = self.orbit.nearer(self.ZOOM)
        elif key == "Down":
            self.orbit = self.orbit.nearer(1 / self.ZOOM)
        elif key in ("Left", "Right"):
            self._view = (self._view + (1 if key == "Right" else -1)) % len(self.views)
            self.orbit = self._orbits[self._view]

    def mouse(self, cursor: tuple[float, float], turning: bool, moving: bool) -> None:
        """The cursor is here (parts of the window, y up) and these buttons are down."""
        if self._cursor is not None and (turning or moving):
            dx, dy = cursor[0] - self._cursor[0], cursor[1] - self._cursor[1]
            self.orbit = self.orbit.turned(dx, dy) if turning else self.orbit.moved(dx, dy, self.aspect)
        self._cursor = cursor if turning or moving else None

    def take_reset(self) -> bool:
        """Whether a reset was asked for since the last call."""
        asked, self._reset = self._reset, False
        return asked

    def take_step(self) -> bool:
        """Whether to simulate a step in this round."""
        single, self._single_step = self._single_step, False
        return single or not self.paused
