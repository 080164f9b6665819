"""The YAML form of a pattern: what a pattern maker writes, in centimetres, every panel seen from outside the wearer."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, PlainValidator, ValidationError, WithJsonSchema, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from taichi_tryon.pattern import check
from taichi_tryon.pattern.edge import Edge
from taichi_tryon.pattern.panel import Band, Closure, Panel, Pattern, Seam
from taichi_tryon.spec import LARGEST, Number, Pair, Spec, fault
from taichi_tryon.units import CM

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
EdgeReference = Annotated[list[Name], Field(min_length=2, max_length=2)]


def _point(value: Any) -> str | list[float]:
    """A point's name, or its coordinates; one message instead of one for each kind."""
    if isinstance(value, str):
        return value
    is_pair = isinstance(value, list) and len(value) == 2
    if is_pair and all(isinstance(x, int | float) and not isinstance(x, bool) and abs(x) <= LARGEST for x in value):
        return [float(x) for x in value]
    raise fault(f"a point is a name from points_cm or two coordinates [x, y] in cm up to {LARGEST:g}, got {value!r}")


PointReference = Annotated[
    Any,
    PlainValidator(_point),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "number"}}]}),
]


def _points(count: int, what: str) -> Any:
    return Field(default=None, min_length=count, max_length=count, description=what)


class EdgeSpec(Spec):
    """One edge of the outline, in the direction of the loop; exactly one of line, curve and arc is given."""

    name: Name = Field(description="name by which seams and dressings refer to the edge")
    line: list[PointReference] | None = _points(2, "straight from the first point to the second")
    curve: list[PointReference] | None = _points(4, "cubic Bezier curve: start, its handle, the end's handle, end")
    arc: list[PointReference] | None = _points(3, "circular arc: start, any point on the way, end")

    @model_validator(mode="after")
    def _one_shape(self) -> EdgeSpec:
        if sum(shape is not None for shape in (self.line, self.curve, self.arc)) != 1:
            raise fault(f"edge '{self.name}': give exactly one of line, curve and arc")
        return self

    @property
    def shape(self) -> tuple[str, str, list]:
        """Its key in the YAML, its kind, and its points."""
        if self.line is not None:
            return "line", "line", self.line
        return ("curve", "cubic", self.curve) if self.curve is not None else ("arc", "arc", self.arc)


class PanelSpec(Spec):
    """A panel drawn from outside the wearer, y up; its edges follow each other round the outline."""

    note: str = Field(default="", description="what the panel is, in words")
    points_cm: dict[Name, Pair] = Field(default_factory=dict, description="named points [x, y] of the draft")
    grain: Pair = Field(default=[0, 1], description="warp direction [x, y], of any length")
    levels_cm: dict[Name, Number] = Field(default_factory=dict, description="heights y of lines: bust, waist ...")
    edges: list[EdgeSpec] = Field(min_length=2, description="the outline, edge after edge")

    def coordinates(self, point: str | list[float]) -> np.ndarray:
        """A point's place (2,) [m]."""
        return np.asarray(self.points_cm[point] if isinstance(point, str) else point, dtype=float) * CM

    def build(self, name: str) -> Panel:
        edges = []
        for edge in self.edges:
            _, kind, points = edge.shape
            edges.append(Edge(edge.name, kind, np.stack([self.coordinates(point) for point in points])))
        grain = np.asarray(self.grain, dtype=float)
        levels = {level: y * CM for level, y in self.levels_cm.items()}
        return Panel(name, tuple(edges), grain / (np.linalg.norm(grain) or 1.0), levels)


class SeamSpec(Spec):
    """Two chains of edges that are sewn together; the two legs of a dart are a seam too."""

    name: Name = Field(description="name of the seam, for messages and drawings")
    a: list[EdgeReference] = Field(min_length=1, description="edges [panel, edge] of one side, in their running order")
    b: list[EdgeReference] = Field(min_length=1, description="edges of the other side, in their own running order")
    direction: Literal["reverse", "same"] = Field(
        default="reverse", description="reverse: the end of b meets the start of a; same: start meets start"
    )
    ease_cm: float = Field(default=0.0, ge=0, le=1000, description="how much the lengths of the two sides may differ")
    closure: Closure | None = Field(
        default=None,
        description="scenes may open it; zip: closed all along; buttons: only at buttons_cm; null: sewn for good",
    )
    buttons_cm: list[float] | None = Field(
        default=None, min_length=1, description="places of the buttons along side a, rising from its start"
    )

    @model_validator(mode="after")
    def _buttons(self) -> SeamSpec:
        if (self.closure == "buttons") != (self.buttons_cm is not None):
            raise fault("closure: buttons and buttons_cm, their places, go together", "closure")
        if self.buttons_cm is not None and sorted({*self.buttons_cm}) != self.buttons_cm:
            raise fault("the places must rise", "buttons_cm")
        return self

    def build(self) -> Seam:
        a, b = (tuple((panel, edge) for panel, edge in side) for side in (self.a, self.b))
        buttons = tuple(place * CM for place in self.buttons_cm or ())
        return Seam(self.name, a, b, self.direction == "reverse", self.ease_cm * CM, self.closure, buttons)


class BandSpec(Spec):
    """A tape sewn along edges, such as a waistband or an elastic: it resists stretch, weighs and bends nothing."""

    name: Name = Field(description="name of the band, for messages")
    edges: list[EdgeReference] = Field(min_length=1, description="edges [panel, edge] that it is sewn to")
    length_cm: float | None = Field(
        default=None, ge=0.1, le=1000, description="its length at rest; null: that of the edges; shorter gathers them"
    )
    stiffness_N: float | None = Field(
        default=None,
        ge=1e-6,
        le=1e5,
        description="tension over stretch, or else give tension_N and at_stretch_percent; a doubled band of cloth: "
        "2 x width x tensile rigidity",
    )
    tension_N: float | None = Field(default=None, gt=0, le=1e4, description="of an elastic: its pull ...")
    at_stretch_percent: float | None = Field(default=None, gt=0, le=1000, description="... at this stretch")

    @model_validator(mode="after")
    def _one_stiffness(self) -> BandSpec:
        pulls = (self.tension_N is None, self.at_stretch_percent is None)
        if pulls not in ((True, True), (False, False)) or pulls[0] == (self.stiffness_N is None):
            raise fault(f"band '{self.name}': give stiffness_N, or tension_N with at_stretch_percent")
        return self

    def build(self) -> Band:
        length = None if self.length_cm is None else self.length_cm * CM
        stiffness = self.stiffness_N if self.tension_N is None else 100 * self.tension_N / self.at_stretch_percent
        return Band(self.name, tuple((panel, edge) for panel, edge in self.edges), length, stiffness)


class DraftSpec(Spec):
    """Where the pattern comes from: kept for the reader, not used in computing."""

    body: str = Field(description="the body it was drafted for")
    measurements_cm: dict[str, Number] = Field(default_factory=dict, description="measurements of that body")
    design_cm: dict[str, Number] = Field(default_factory=dict, description="chosen eases and lengths")
    reasons: dict[str, str] = Field(default_factory=dict, description="for each point or line, how it was found")


class PatternSpec(Spec):
    """A sewing pattern."""

    pattern: Name = Field(description="name of the pattern")
    drafted_from: DraftSpec | None = Field(default=None, description="measurements and reasons")
    panels: dict[Name, PanelSpec] = Field(min_length=1, description="panels by name")
    mirrored_panels: dict[Name, Name] = Field(
        default_factory=dict, description="panels that are mirror images in the y axis: {new panel: panel it mirrors}"
    )
    seams: list[SeamSpec] = Field(default_factory=list, description="what is sewn to what, darts included")
    bands: list[BandSpec] = Field(default_factory=list, description="tapes along edges: waistband, elastic")

    @model_validator(mode="after")
    def _can_be_sewn(self) -> PatternSpec:
        faults = _unknown_names(self) or check.faults(Pattern.from_spec(self))
        if faults:
            raise ValidationError.from_exception_data(
                "PatternSpec", [_error_details(message, place) for place, message in faults]
            )
        return self


def _unknown_names(spec: PatternSpec) -> list[check.Fault]:
    """Points and panels that are referred to and not there: without them no pattern can be built."""
    faults = []
    for name, panel in spec.panels.items():
        for i, edge in enumerate(panel.edges):
            key, _, points = edge.shape
            for j, point in enumerate(points):
                if isinstance(point, str) and point not in panel.points_cm:
                    message = f"panel '{name}', edge '{edge.name}': no point '{point}' in points_cm"
                    faults.append(check.Fault(("panels", name, "edges", i, key, j), message))
    for name, original in spec.mirrored_panels.items():
        if name in spec.panels:
            faults.append(check.Fault(("mirrored_panels", name), f"panel '{name}' is drawn under panels already"))
        if original not in spec.panels:
            message = f"no panel '{original}' under panels; there are {', '.join(spec.panels)}"
            faults.append(check.Fault(("mirrored_panels", name), message))
    return faults


def _error_details(message: str, place: tuple[str | int, ...]) -> InitErrorDetails:
    error = PydanticCustomError("fault", "{message}", {"message": message})
    return InitErrorDetails(type=error, loc=place, input=None)
