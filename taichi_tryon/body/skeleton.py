"""Joints, poses, forward kinematics, and motion between poses."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from taichi_tryon.body.spec import PoseSpec
from taichi_tryon.errors import InputError
from taichi_tryon.units import CM


def rotation_matrix(degrees: list[float]) -> np.ndarray:
    """Rotation (3, 3) about the world axes: first x, then y, then z, each about the unturned axis."""
    return Rotation.from_euler("xyz", degrees, degrees=True).as_matrix()


@dataclass(frozen=True)
class Pose:
    """Turns (3, 3) of joints from the rest pose, relative to the parent bone, and a shift (3,) [m] of it all."""

    name: str
    rotations: dict[str, np.ndarray] = field(default_factory=dict)
    translation: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @staticmethod
    def from_spec(spec: PoseSpec) -> Pose:
        rotations = {bone: rotation_matrix(degrees) for bone, degrees in spec.rotations_degree.items()}
        return Pose(spec.name, rotations, np.array(spec.translation_cm) * CM)


@dataclass(frozen=True)
class Skeleton:
    """A tree of bones: parents before their children, the root's parent is -1; heads (b, 3) [m] are joints at rest."""

    names: tuple[str, ...]
    parents: np.ndarray
    heads: np.ndarray

    def index(self, name: str) -> int:
        """Position of a bone among the names; InputError if there is none."""
        if name not in self.names:
            raise InputError(f"the skeleton has no bone '{name}'; bones: {', '.join(self.names)}")
        return self.names.index(name)

    def transforms(self, pose: Pose) -> np.ndarray:
        """Rigid motions (b, 4, 4) that take material carried by each bone from the rest pose to ``pose``.

        A joint turns all it carries: T_bone = T_parent (turn about the joint at rest); the root is shifted as well.
        Raises InputError where the pose turns a bone that the skeleton lacks.
        """
        for name in pose.rotations:
            if name not in self.names:
                raise InputError(f"pose {pose.name}: no bone '{name}'; bones: {', '.join(self.names)}")
        transforms = np.empty((len(self.names), 4, 4))
        root = np.eye(4)
        root[:3, 3] = pose.translation
        for bone, name in enumerate(self.names):
            turn = np.eye(4)
            turn[:3, :3] = pose.rotations.get(name, np.eye(3))
            turn[:3, 3] = self.heads[bone] - turn[:3, :3] @ self.heads[bone]
            parent = self.parents[bone]
            transforms[bone] = (root if parent < 0 else transforms[parent]) @ turn
        return transforms


@dataclass(frozen=True)
class Motion:
    """Poses at given times [s], joined smoothly: every joint turns about one axis and comes to rest at each pose.

    Between two poses the share of the way is 3u^2 - 2u^3, so that positions and velocities are continuous (C1).
    """

    skeleton: Skeleton
    times: tuple[float, ...]
    poses: tuple[Pose, ...]

    def __post_init__(self):
        if not self.times or len(self.times) != len(self.poses):
            raise ValueError(f"{len(self.times)} times for {len(self.poses)} poses; give one for each")
        if (np.diff(self.times) <= 0).any():
            raise ValueError(f"times of the poses must grow, got {self.times}")

    @staticmethod
    def still(skeleton: Skeleton, pose: Pose) -> Motion:
        """One pose for ever."""
        return Motion(skeleton, (0.0,), (pose,))

    @property
    def end_time(self) -> float:
        """When the last pose is reached [s]."""
        return self.times[-1]

    def pose(self, time: float) -> Pose:
        """The pose at a time [s]; before the first and after the last it stands still."""
        if time <= self.times[0]:
            return self.poses[0]
        if time >= self.times[-1]:
            return self.poses[-1]
        k = int(np.searchsorted(self.times, time, side="right")) - 1
        u = (time - self.times[k]) / (self.times[k + 1] - self.times[k])
        return _between(self.poses[k], self.poses[k + 1], u * u * (3 - 2 * u))

    def transforms(self, time: float) -> np.ndarray:
        """Rigid motions of the bones (b, 4, 4) from the rest pose at a time [s]."""
        return self.skeleton.transforms(self.pose(time))


def _between(a: Pose, b: Pose, share: float) -> Pose:
    """The pose at a share of the way from ``a`` to ``b``, every joint by spherical linear interpolation."""
    rotations = {}
    for bone in a.rotations | b.rotations:
        start, end = (pose.rotations.get(bone, np.eye(3)) for pose in (a, b))
        way = Rotation.from_matrix(start.T @ end).as_rotvec()
        rotations[bone] = start @ Rotation.from_rotvec(share * way).as_matrix()
    return Pose(f"{a.name} to {b.name}", rotations, (1 - share) * a.translation + share * b.translation)
