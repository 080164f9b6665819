"""A body: metaballs carried by a skeleton, as arrays."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from taichi_tryon.body.skeleton import Skeleton, rotation_matrix
from taichi_tryon.body.spec import BodySpec
from taichi_tryon.errors import InputError
from taichi_tryon.units import CM


@dataclass(frozen=True)
class Balls:
    """n ellipsoidal metaballs in g groups, in one pose.

    A ball's density at x is w (1 - s)^3 where s = |diag(1/radii) axes^T (x - center)|^2 < 1, and 0 elsewhere.
    """

    centers: np.ndarray  # (n, 3) [m]
    radii: np.ndarray  # (n, 3) [m]; np.inf along an axis: cylinder, along two: slab
    axes: np.ndarray  # (n, 3, 3) columns are the ball's own axes
    weights: np.ndarray  # (n,) density at the centre
    membership: np.ndarray  # (n, g) bool; a ball in several groups stands for the paper's copies A'
    bones: np.ndarray  # (n, 2) int, the bones that carry it
    bone_weights: np.ndarray  # (n, 2) sum to 1

    @property
    def quadratics(self) -> np.ndarray:
        """(n, 3, 3) symmetric Q [1/m^2] of s = (x - c)^T Q (x - c); zero along infinite radii."""
        return np.einsum("nij,nj,nkj->nik", self.axes, self.radii**-2.0, self.axes)

    @property
    def extents(self) -> np.ndarray:
        """(n, 3) half sizes [m] of the world-axis boxes outside which the balls' densities are zero; may be np.inf."""
        reach = np.zeros_like(self.radii)
        for axis in range(3):
            share = np.abs(self.axes[:, :, axis])
            share[share < 1e-12] = 0.0
            radius = self.radii[:, axis, None]
            with np.errstate(invalid="ignore"):
                reach += np.where(share > 0, (share * radius) ** 2, 0.0)
        return np.sqrt(reach)


@dataclass(frozen=True)
class Landmark:
    """A named point (3,) [m] of the rest pose that moves with a bone."""

    bone: str
    position: np.ndarray


@dataclass(frozen=True)
class Measurement:
    """Groups a tape goes around, in a plane carried by a bone: ``point`` (3,) [m] and unit ``normal`` (3,) at rest."""

    bone: str
    point: np.ndarray
    normal: np.ndarray
    groups: tuple[int, ...]
    published: float | None  # [m]


@dataclass(frozen=True)
class Body:
    """The wearer in the rest pose; ``posed`` gives the balls in another one."""

    name: str
    skeleton: Skeleton
    balls: Balls
    group_names: tuple[str, ...]
    landmarks: dict[str, Landmark]
    measurements: dict[str, Measurement]

    @staticmethod
    def from_spec(spec: BodySpec) -> Body:
        names = tuple(spec.bones)
        parents = [-1 if bone.parent is None else names.index(bone.parent) for bone in spec.bones.values()]
        heads = np.array([bone.head_cm for bone in spec.bones.values()], float) * CM
        landmarks = {
            name: Landmark(mark.bone, np.array(mark.position_cm, float) * CM) for name, mark in spec.landmarks.items()
        }
        groups = tuple(spec.groups)
        measurements = {
            name: Measurement(
                bone=measure.bone,
                point=np.array(measure.point_cm, float) * CM,
                normal=np.array(measure.normal, float) / np.linalg.norm(measure.normal),
                groups=tuple(groups.index(group) for group in measure.groups),
                published=None if measure.published_cm is None else measure.published_cm * CM,
            )
            for name, measure in spec.measurements.items()
        }
        skeleton = Skeleton(names, np.array(parents), heads)
        return Body(spec.name, skeleton, _balls(spec, names), groups, landmarks, measurements)

    @staticmethod
    def absent() -> Body:
        """The body of a scene that has none: no bones, no balls."""
        none = np.zeros((0, 3))
        balls = Balls(none, none, np.zeros((0, 3, 3)), none[:, 0], np.zeros((0, 1), bool), np.zeros((0, 2), int),
                      np.zeros((0, 2)))  # fmt: skip
        return Body("no body", Skeleton((), np.zeros(0, int), none), balls, (), {}, {})

    def groups(self, *names: str) -> tuple[int, ...]:
        """Indices of groups; InputError names one that the body lacks."""
        for name in names:
            if name not in self.group_names:
                raise InputError(f"body {self.name}: no group '{name}'; groups: {', '.join(self.group_names)}")
        return tuple(self.group_names.index(name) for name in names)

    def landmark(self, name: str, transforms: np.ndarray) -> np.ndarray:
        """Position (3,) [m] of a landmark where the bones stand at ``transforms`` (b, 4, 4)."""
        if name not in self.landmarks:
            raise InputError(f"body {self.name}: no landmark '{name}'; landmarks: {', '.join(self.landmarks)}")
        mark = self.landmarks[name]
        motion = transforms[self.skeleton.index(mark.bone)]
        return motion[:3, :3] @ mark.position + motion[:3, 3]

    def posed(self, transforms: np.ndarray) -> Balls:
        """The balls where the bones stand at ``transforms`` (b, 4, 4).

        A centre goes to the bones' blend sum_b w_b T_b c, the axes turn by the rotation nearest to sum_b w_b R_b: a
        ball at a joint takes a part of the turn and keeps its shape.
        """
        rest = self.balls
        blend = np.einsum("nb,nbij->nij", rest.bone_weights, transforms[rest.bones])
        centers = np.einsum("nij,nj->ni", blend[:, :3, :3], rest.centers) + blend[:, :3, 3]
        return replace(rest, centers=centers, axes=_nearest_rotations(blend[:, :3, :3]) @ rest.axes)


def _balls(spec: BodySpec, bone_names: tuple[str, ...]) -> Balls:
    balls = spec.balls.values()
    bones, shares = np.zeros((len(balls), 2), int), np.zeros((len(balls), 2))
    for k, ball in enumerate(balls):
        for slot, (bone, share) in enumerate(ball.bones.items()):
            bones[k, slot], shares[k, slot] = bone_names.index(bone), share
    return Balls(
        centers=np.array([ball.center_cm for ball in balls], float) * CM,
        radii=np.array([ball.radii_cm for ball in balls], float) * CM,
        axes=np.array([rotation_matrix(ball.rotation_degree) for ball in balls]),
        weights=np.array([ball.weight for ball in balls], float),
        membership=np.array([[group in ball.groups for group in spec.groups] for ball in balls]),
        bones=bones,
        bone_weights=shares / shares.sum(axis=1, keepdims=True),
    )


def _nearest_rotations(matrices: np.ndarray) -> np.ndarray:
    """The rotations (n, 3, 3) nearest to matrices (n, 3, 3) in the Frobenius norm: orthogonal polar factors."""
    left, _, right = np.linalg.svd(matrices)
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
    return left @ right
