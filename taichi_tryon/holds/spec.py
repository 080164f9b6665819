"""Holds as they stand in YAML: centimetres, degrees, seconds."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from taichi_tryon.body.spec import DEGREES
from taichi_tryon.spec import Number, Pair, Spec, Vector, fault

CHOICES = ("points_cm", "edge", "area_cm", "disk_cm")


class HoldStepSpec(Spec):
    """A place to reach from the one before, seen from the start."""

    duration_s: float = Field(ge=1e-3, le=600, description="time from the place before")
    translation_cm: Vector = Field([0.0, 0.0, 0.0], description="shift from the start")
    rotation_degree: Vector = Field([0.0, 0.0, 0.0], description=f"turn from the start about about_cm, {DEGREES}")


class HoldSpec(Spec):
    """Vertices that are held where they start, or led along a path that begins with the motion of the body. They are
    chosen by one of points_cm, edge, area_cm and disk_cm."""

    points_cm: Annotated[list[Pair], Field(min_length=1)] | None = Field(
        None, description="the vertices nearest to these points [x, y] of the flat panel"
    )
    edge: str | None = Field(None, description="all vertices along this edge of the panel")
    area_cm: Annotated[list[Pair], Field(min_length=2, max_length=2)] | None = Field(
        None, description="all vertices between the corners [x, y] and [x, y] of the flat panel: holds the slope too"
    )
    disk_cm: Annotated[list[Number], Field(min_length=3, max_length=3)] | None = Field(
        None, description="all vertices in the disk [x, y, diameter] of the flat panel: holds the slope too"
    )
    panel: str | None = Field(None, description="which panel; null: the only one")
    axes: Annotated[list[Literal["x", "y", "z"]], Field(min_length=1)] = Field(
        ["x", "y", "z"], description="world axes along which they are held; along the others they slide"
    )
    about_cm: Vector = Field([0.0, 0.0, 0.0], description="point about which the path turns them")
    path: list[HoldStepSpec] = Field([], description="places to go to in turn, coming to rest at each")

    @model_validator(mode="after")
    def _one_choice(self) -> HoldSpec:
        chosen = [key for key in CHOICES if getattr(self, key) is not None]
        if len(chosen) != 1:
            raise fault(f"give one of {', '.join(CHOICES)} (got {', '.join(chosen) or 'none'})")
        return self
