"""Plain sheets as they stand in YAML: centimetres, degrees."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from taichi_tryon.body.spec import DEGREES
from taichi_tryon.spec import Number, Pair, Spec, Vector, fault

Length = Annotated[float, Field(ge=0.01, le=10_000)]
MeshKind = Literal["delaunay", "regular", "alternating", "jittered"]


class WavesSpec(Spec):
    """A start a little off the plane, for what would else be too symmetric to choose its folds, the same in every run
    and on every mesh: plane waves of a length, of random directions and phases, or a number of folds around a disk's
    rim."""

    height_mm: float = Field(gt=0, le=100, description="root mean square of the height, of folds: along the rim")
    length_cm: Length | None = Field(None, description="wave length of plane waves")
    folds: int | None = Field(None, ge=2, le=100, description="folds around the rim; towards the middle they fade")
    seed: int = Field(0, ge=0, lt=2**32, description="another seed: other plane waves")

    @model_validator(mode="after")
    def _one_kind(self) -> WavesSpec:
        if (self.length_cm is None) == (self.folds is None):
            raise fault("give one of length_cm, folds")
        return self


class SheetSpec(Spec):
    """A flat piece of cloth in the plane of its own axes x and y, its outer side towards its own z; it is not dressed,
    but starts where it is placed. Its shape is one of size_cm, diameter_cm and outline_cm."""

    size_cm: Annotated[list[Length], Field(min_length=2, max_length=2)] | None = Field(
        None, description="rectangle from the sheet's origin: width along its x, height along its y"
    )
    diameter_cm: Length | None = Field(None, description="disk around the sheet's origin")
    inner_diameter_cm: Length | None = Field(
        None, description="circle around a disk's origin that the mesh follows, such as the border of what carries it"
    )
    outline_cm: Annotated[list[Pair], Field(min_length=3)] | None = Field(
        None, description="polygon of corners [x, y], not repeating the first"
    )
    grain_degree: Number = Field(90.0, description="direction of the warp, from the sheet's x towards its y")
    mesh: MeshKind = Field(
        "delaunay",
        description="delaunay: as garments are meshed; of a rectangle also regular: squares cut by parallel diagonals, "
        "alternating: by diagonals in turn, jittered: regular with the inner vertices shifted at random",
    )
    lines_cm: list[Length] = Field(
        [], description="x of lines across a rectangle that the mesh follows, such as the end of a clamp"
    )
    tube_radius_cm: Length | None = Field(
        None,
        description="roll a rectangle about its y axis to a tube of this radius, its right edge sewn to its left; "
        "stretched where the circumference exceeds the width",
    )
    waves: WavesSpec | None = Field(None, description="start a little off the plane; null: flat")
    origin_cm: Vector = Field([0.0, 0.0, 0.0], description="where the sheet's origin (of a tube: its axis) is placed")
    rotation_degree: Vector = Field([0.0, 0.0, 0.0], description=f"turns the sheet's axes, {DEGREES}")
    velocity_m_s: Vector = Field([0.0, 0.0, 0.0], description="velocity at the start")
    spin_rad_s: Vector = Field([0.0, 0.0, 0.0], description="angular velocity at the start, about the centre of mass")

    @property
    def edges(self) -> tuple[str, ...]:
        """Names of the edges of its outline."""
        if self.diameter_cm is not None:
            return ("rim",)
        if self.size_cm is not None:
            return ("bottom", "right", "top", "left")
        return tuple(f"side_{i}" for i in range(len(self.outline_cm)))

    @model_validator(mode="after")
    def _one_shape(self) -> SheetSpec:
        shapes = [key for key in ("size_cm", "diameter_cm", "outline_cm") if getattr(self, key) is not None]
        if len(shapes) != 1:
            raise fault(f"give one of size_cm, diameter_cm, outline_cm (got {', '.join(shapes) or 'none'})")
        for key in ("mesh", "tube_radius_cm"):
            if self.size_cm is None and getattr(self, key) not in ("delaunay", None):
                raise fault(f"needs a rectangle, size_cm (got {shapes[0]})", key)
        if self.waves is not None and self.tube_radius_cm is not None:
            raise fault("a tube is no plane to start off from: leave out tube_radius_cm or waves", "waves")
        if self.waves is not None and self.waves.folds is not None and self.diameter_cm is None:
            raise fault("folds need a disk, diameter_cm", "waves")
        if self.inner_diameter_cm is not None and not self.inner_diameter_cm < (self.diameter_cm or 0.0):
            raise fault("must lie within a disk, diameter_cm", "inner_diameter_cm")
        marks = [0.0, *self.lines_cm, self.size_cm[0] if self.size_cm else 0.0]
        if self.lines_cm and not all(a < b for a, b in zip(marks, marks[1:], strict=False)):
            raise fault("must rise, and lie within the width of a rectangle, size_cm", "lines_cm")
        return self
