"""How a garment is laid around the body: disks, the surfaces between them and where each panel goes."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from taichi_tryon.spec import Number, Spec, Vector, fault, require_direction

Corner = Annotated[str, Field(pattern=r"^\w+\.(start|end)$", description="End of a panel's edge: `shoulder.start`")]
RowEnd = Number | Corner


class DiskSpec(Spec):
    """A plane section of the body, widened by an ease: cloth is laid on its rim (paper, 5.1)."""

    at: str = Field(min_length=1, description="Landmark of the body, or bone whose joint the disk's plane goes through")
    offset_cm: Vector = Field([0.0, 0.0, 0.0], description="Shift of that point in the rest pose")
    turns_with: str = Field(min_length=1, description="Bone that carries the disk: the one before the disk's own joint")
    normal: Vector = Field(description="Normal in the rest pose, along the garment from top to hem")
    bisects_with: str | None = Field(None, description="Second bone: the disk turns by the mean of both bones' turns")
    start: Vector = Field(description="Direction of theta = 0 from the centre, in the rest pose")
    groups: list[str] = Field(min_length=1, description="Ball groups that make the section")
    reach_cm: float = Field(30.0, ge=0.1, le=100, description="The section is looked for within this distance of `at`")
    outline: Literal["tape", "ellipse", "circle"] = Field(
        "tape", description="Rim: convex hull of the section, ellipse about it, or circle of its largest radius"
    )
    ease_cm: float = Field(ge=0.01, le=60, description="Distance from the section to the rim")
    lift_cm: float = Field(0.0, ge=-100, le=100, description="Shift of the rim against the normal")
    pulled_up_cm: float = Field(
        0.0, ge=-20, le=20, description="As lift_cm, but beyond where the garment belongs: it slides back as it sits"
    )
    half: bool = Field(False, description="Only the half of the rim from `start` leftwards to the opposite point")

    @model_validator(mode="after")
    def _directions(self):
        n, s = self.normal, self.start
        for key, v in (("normal", n), ("start", s)):
            require_direction(v, key)
        cross = [n[1] * s[2] - n[2] * s[1], n[2] * s[0] - n[0] * s[2], n[0] * s[1] - n[1] * s[0]]
        if sum(c * c for c in cross) < 1e-4 * sum(c * c for c in n) * sum(c * c for c in s):
            raise fault("start must not be parallel to the normal", "start")
        return self


class PanelSpec(Spec):
    """Where one panel goes; its left and right sides are the edges between `top` and `bottom`."""

    surface: str = Field(min_length=1, description="Surface that carries the panel")
    around: Annotated[
        list[float],
        Field(min_length=2, max_length=2, description="Part of the way round, from theta = 0 leftwards, 0 to 1"),
    ]
    top: list[str] = Field(min_length=1, description="Edges laid on the first disk")
    bottom: list[str] = Field(min_length=1, description="Edges laid on the last disk")
    first: str | None = Field(None, description="Disk that carries the top, if not the surface's first")
    last: str | None = Field(None, description="Disk that carries the bottom, if not the surface's last")
    rows: dict[str, RowEnd | Annotated[list[RowEnd], Field(min_length=2, max_length=2)]] = Field(
        default_factory=dict,
        description="For each disk in between, the straight line of the panel that lies on it: "
        "a height in cm, or [left end, right end], each a height on that side or an edge's end",
    )

    @model_validator(mode="after")
    def _part(self):
        a, b = self.around
        if not 0 <= a < b <= 1:
            raise fault("the two numbers must rise and lie between 0 and 1", "around")
        return self


class DressingSpec(Spec):
    """A file of `configs/dressings`: everything needed to lay one pattern around a body in any pose."""

    dressing: str = Field(min_length=1, description="Name of the dressing")
    disks: dict[str, DiskSpec] = Field(min_length=1, description="Disks by name")
    surfaces: dict[str, Annotated[list[str], Field(min_length=2)]] = Field(
        min_length=1, description="Ruled surfaces: the disks they go through, from top to hem"
    )
    panels: dict[str, PanelSpec] = Field(min_length=1, description="Panels of the pattern by name")
    lines: dict[str, str] = Field(
        default_factory=dict, description="Openings to follow in the report (hem, cuffs): name and the disk they lie on"
    )
    stretched_seams: list[str] = Field(
        default_factory=list,
        description="Edges sewn across a gap of the surfaces (crotch): crossings beside them are told, not refused",
    )
    held_up: bool = Field(
        False, description="hands hold the garment up until it sits (trousers): it bears no weight while dressed"
    )
    clearance_mm: float = Field(5.0, ge=0.1, le=100, description="Least distance of the start from the body")
    layer_mm: float = Field(
        3.0,
        ge=0.1,
        le=100,
        description="Further distance from the body for each garment underneath, and least distance from that garment",
    )

    @model_validator(mode="after")
    def _references(self):
        for name, disks in self.surfaces.items():
            for i, disk in enumerate(disks):
                if disk not in self.disks:
                    raise fault(f"no disk is named '{disk}'; there are {', '.join(self.disks)}", "surfaces", name, i)
            if len(set(disks)) < len(disks):
                raise fault("a disk is named twice", "surfaces", name)
        for name, panel in self.panels.items():
            self._check_panel(name, panel)
        for line, disk in self.lines.items():
            if disk not in self.disks:
                raise fault(f"no disk is named '{disk}'; there are {', '.join(self.disks)}", "lines", line)
        return self

    def _check_panel(self, name: str, panel: PanelSpec) -> None:
        if panel.surface not in self.surfaces:
            known = ", ".join(self.surfaces)
            raise fault(f"no surface is named '{panel.surface}'; there are {known}", "panels", name, "surface")
        disks = self.surfaces[panel.surface]
        for key, disk in (("first", panel.first), ("last", panel.last)):
            if disk is not None and disk not in disks:
                raise fault(f"'{disk}' is no disk of its surface: {', '.join(disks)}", "panels", name, key)
        between = self.disks_of(name)[1:-1]
        if len(self.disks_of(name)) < 2:
            raise fault("the first disk must come before the last", "panels", name, "first")
        for disk in panel.rows:
            if disk not in between:
                allowed = ", ".join(between) or "none"
                raise fault(f"'{disk}' is not between top and bottom; allowed: {allowed}", "panels", name, "rows", disk)
        for disk in between:
            if disk not in panel.rows:
                raise fault(f"the line that lies on disk '{disk}' is missing", "panels", name, "rows")

    def disks_of(self, panel: str) -> list[str]:
        """Disks that a panel goes through, from its top to its bottom."""
        spec = self.panels[panel]
        disks = self.surfaces[spec.surface]
        first = disks.index(spec.first) if spec.first else 0
        last = disks.index(spec.last) if spec.last else len(disks) - 1
        return disks[first : last + 1]
