"""Bodies and poses as they stand in YAML: centimetres, degrees, names."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, field_validator, model_validator

from taichi_tryon.spec import LARGEST, Pair, Spec, Vector, fault, require_direction

Radius = Annotated[float, Field(ge=0.01, allow_inf_nan=True)]
Share = Annotated[float, Field(ge=0, le=1)]

DEGREES = "about the world axes x, y, z: first x, then y, then z, each about the unturned axis"


class RangeSpec(Spec):
    """How far a joint turns about each axis, [least, greatest]; an axis that is not named is not judged."""

    x: Pair | None = Field(default=None, description="turn about x that a pose may give, [least, greatest]")
    y: Pair | None = Field(default=None, description="the same about y")
    z: Pair | None = Field(default=None, description="the same about z")

    @field_validator("x", "y", "z")
    @classmethod
    def _holds_rest(cls, limits: list[float] | None) -> list[float] | None:
        if limits is not None and not limits[0] <= 0 <= limits[1]:
            raise fault(f"must hold 0, the rest pose (got {limits[0]:g} to {limits[1]:g})")
        return limits

    @property
    def axes(self) -> dict[str, list[float]]:
        """Limits [degree] of the axes that have any."""
        return {axis: limits for axis in "xyz" if (limits := getattr(self, axis)) is not None}


class BoneSpec(Spec):
    """A joint, and what turns with it."""

    parent: str | None = Field(description="bone that carries this one, listed before it; null for the root")
    head_cm: Vector = Field(description="the joint in the rest pose")
    range_degree: RangeSpec = Field(
        default=RangeSpec(),
        description="how far the joint turns; a pose beyond it is computed, and a warning tells of it",
    )


class BallSpec(Spec):
    """An ellipsoidal metaball of density weight (1 - s)^3, s = (distance from the centre in radii)^2."""

    center_cm: Vector = Field(description="centre in the rest pose")
    radii_cm: Annotated[list[Radius], Field(min_length=3, max_length=3)] = Field(
        description="where the density ends along the ball's own axes; .inf along one: a cylinder, along two: a slab"
    )
    rotation_degree: Vector = Field(default=[0.0, 0.0, 0.0], description=f"turns the ball's axes, {DEGREES}")
    weight: float = Field(
        ge=1e-6, le=1e6, description="density at the centre; the skin of a ball alone needs more than 1"
    )
    groups: list[str] = Field(min_length=1, description="groups in which it fuses; a second one is the paper's copy A'")
    bones: dict[str, Share] = Field(
        min_length=1, max_length=2, description="bone or two bones that carry the ball, with shares that sum to 1"
    )

    @field_validator("radii_cm")
    @classmethod
    def _bounded_somewhere(cls, radii: list[float]) -> list[float]:
        if any(r != r for r in radii):
            raise fault("a radius is not a number; give centimetres or .inf")
        if any(LARGEST < r < float("inf") for r in radii):
            raise fault(f"a finite radius must not exceed {LARGEST:g} (got {max(radii):g}); .inf makes a cylinder")
        if all(r == float("inf") for r in radii):
            raise fault("all three radii are infinite; at least one must be finite")
        return radii

    @field_validator("bones")
    @classmethod
    def _shares(cls, bones: dict[str, float]) -> dict[str, float]:
        if abs(sum(bones.values()) - 1) > 1e-3:
            raise fault(f"the bones' shares sum to {sum(bones.values()):g}; they must sum to 1")
        return bones


class LandmarkSpec(Spec):
    """A named point of the body, or of a level of it."""

    bone: str = Field(description="bone that carries the point")
    position_cm: Vector = Field(description="the point in the rest pose")


class MeasurementSpec(Spec):
    """A girth as a tape takes it: convex hull of the section of some groups by a plane."""

    bone: str = Field(description="bone that carries the plane")
    point_cm: Vector = Field(description="a point of the plane inside the body, in the rest pose")
    normal: Vector = Field(description="normal of the plane in the rest pose, any length")
    groups: list[str] = Field(min_length=1, description="groups that the tape goes around")
    published_cm: float | None = Field(
        default=None, gt=0, le=LARGEST, description="the girth this body was made to have"
    )

    @field_validator("normal")
    @classmethod
    def _direction(cls, normal: list[float]) -> list[float]:
        require_direction(normal)
        return normal


class BodySpec(Spec):
    """A skeleton and the metaballs it carries, in the rest pose: y up, facing +z, its left at +x, floor at y = 0."""

    name: str = Field(min_length=1, description="name in reports")
    provenance: str = Field(default="", description="source of the figures, and licence")
    bones: dict[str, BoneSpec] = Field(min_length=1, description="the skeleton")
    groups: list[str] = Field(min_length=1, max_length=16, description="groups of balls; the body is their union")
    balls: dict[str, BallSpec] = Field(min_length=1, description="the metaballs")
    landmarks: dict[str, LandmarkSpec] = Field(default={}, description="points that dressings and reports refer to")
    measurements: dict[str, MeasurementSpec] = Field(default={}, description="girths to measure")

    @model_validator(mode="after")
    def _names_exist(self) -> BodySpec:
        known: set[str] = set()
        for name, bone in self.bones.items():
            if bone.parent is None and known:
                raise fault(f"a second root beside '{next(iter(self.bones))}'; give a parent", "bones", name, "parent")
            if bone.parent is not None and bone.parent not in known:
                raise fault(f"no bone '{bone.parent}' stands before '{name}'", "bones", name, "parent")
            known.add(name)
        for kind, parts in (("balls", self.balls), ("measurements", self.measurements)):
            for name, part in parts.items():
                for group in part.groups:
                    if group not in self.groups:
                        raise fault(f"no group '{group}'; groups: {', '.join(self.groups)}", kind, name, "groups")
        self._check_groups()
        for name, ball in self.balls.items():
            for bone in ball.bones:
                _require_bone(bone, known, "balls", name, "bones")
        for kind, parts in (("landmarks", self.landmarks), ("measurements", self.measurements)):
            for name, part in parts.items():
                _require_bone(part.bone, known, kind, name, "bone")
        return self

    def _check_groups(self) -> None:
        filled = {group for ball in self.balls.values() for group in ball.groups}
        for index, group in enumerate(self.groups):
            if group in self.groups[:index]:
                raise fault(f"{group} is named twice", "groups", index)
            if group not in filled:
                raise fault(f"no ball is in group '{group}'", "groups", index)


class PoseSpec(Spec):
    """How far each joint is turned from the rest pose; joints not named are not turned."""

    name: str = Field(min_length=1, description="name in reports")
    rotations_degree: dict[str, Vector] = Field(
        default={}, description=f"bone: [x, y, z], turned at its joint together with all it carries, {DEGREES}"
    )
    translation_cm: Vector = Field(default=[0.0, 0.0, 0.0], description="shift of the whole body")


def _require_bone(bone: str, known: set[str], *location: str) -> None:
    if bone not in known:
        raise fault(f"no bone '{bone}'; bones: {', '.join(sorted(known))}", *location)
