"""A scene: who wears what, made of which fabric, in which pose and motion, computed and shown how."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from taichi_tryon.body.spec import BodySpec, PoseSpec
from taichi_tryon.cloth.model import Bending, Membrane
from taichi_tryon.dressing.spec import DressingSpec
from taichi_tryon.fabric import FabricSpec
from taichi_tryon.holds.spec import HoldSpec
from taichi_tryon.pattern.changes import OpeningSpec
from taichi_tryon.pattern.spec import BandSpec, PatternSpec
from taichi_tryon.scene.references import REFERENCE
from taichi_tryon.scene.skip import SkipSpec
from taichi_tryon.sheet.spec import SheetSpec
from taichi_tryon.spec import Spec, fault

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=80)]
Drawn = Literal["auto", "ggui", "raster"]
View = Literal["front", "back", "right", "left", "top", "three_quarter"]
FrameFormat = Literal["vtu", "obj", "ply", "stl"]
Map = Literal["strain_warp", "strain_weft", "shear", "pressure", "body_pressure", "gap"]


class AppearanceSpec(Spec):
    """How a garment looks in pictures."""

    color: str = Field("#8fb3d9", pattern=r"^#[0-9a-fA-F]{6}$", description="colour of the cloth, red green blue")
    checker_mm: float | None = Field(
        None, ge=0.1, le=500, description="squares of this size along warp and weft show the grain; null: plain"
    )


class GarmentSpec(Spec):
    """A garment: its pattern, how it is laid around the body, and its fabric; or a plain sheet."""

    name: Name = Field(description="name in files and report")
    pattern: Annotated[PatternSpec | None, REFERENCE] = Field(None, description="the sewing pattern; none of a sheet")
    dressing: Annotated[DressingSpec | None, REFERENCE] = Field(
        None, description="how the panels are laid around the body; none of a sheet"
    )
    sheet: SheetSpec | None = Field(None, description="a plain sheet instead of pattern and dressing")
    fabric: Annotated[FabricSpec, REFERENCE] = Field(description="the measured fabric")
    open: list[OpeningSpec] = Field([], description="closures of the pattern that are left open, whole or in part")
    bands: list[BandSpec] = Field(
        [],
        description="tapes sewn on besides the pattern's; one that is called as one of the pattern takes its place; on "
        "a sheet, edges are [sheet, top] and so on",
    )
    holds: dict[Name, HoldSpec] = Field({}, description="parts held fixed or led along a path")
    appearance: AppearanceSpec = Field(AppearanceSpec(), description="colour and checker")

    @model_validator(mode="after")
    def _dressed_or_placed(self) -> GarmentSpec:
        for key, what in (("pattern", "the sewing pattern"), ("dressing", "how the panels are laid around the body")):
            if self.sheet is None and getattr(self, key) is None:
                raise fault(f"this key is required ({what}); only a plain sheet has none", key)
            if self.sheet is not None and getattr(self, key) is not None:
                raise fault(f"a plain sheet has no {key}: leave out one of the two", "sheet")
        if self.sheet is not None and self.open:
            raise fault("a plain sheet has no closures", "open")
        return self


class MotionStepSpec(Spec):
    """A pose to reach from the one before."""

    pose: Annotated[PoseSpec, REFERENCE] = Field(description="pose at the end of this step")
    duration_s: float = Field(ge=1e-3, le=600, description="time from the pose before")


class MeshSpec(Spec):
    """The triangles."""

    edge_length_mm: float = Field(
        6.0,
        ge=1,
        le=100,
        description="mean edge length aimed at; 12 shows how a garment hangs several times as fast, strains take 6",
    )
    bending: Bending = Field(
        "mid_edge",
        description="how curvature is found on the triangles; mid_edge: by normals at the edges' middles, converges on "
        "every mesh; constant: by one matrix, quadratic in the positions, cheaper, less exact on coarse triangles",
    )
    membrane: Membrane = Field(
        "plain",
        description="whose strain resists; plain: each triangle's; nodal: for nine tenths the mean around each vertex, "
        "so that folds of few triangles do not resist by stretching",
    )


class LayersSpec(Spec):
    """Contact of cloth with cloth."""

    thickness_mm: float = Field(
        1.0,
        ge=0.01,
        le=10,
        description="distance t between the middle surfaces of two layers at which they begin to touch",
    )
    stiffness_N_per_m3: float = Field(
        1.0e8, ge=1e4, le=1e11, description="k: at a distance d little below t the pressure is about 3 k (t - d)^2 / t"
    )
    friction: float = Field(0.3, ge=0, le=2, description="Coulomb friction coefficient of cloth on cloth")


class ContactSpec(Spec):
    """Contact of cloth and body."""

    friction: float = Field(0.3, ge=0, le=2, description="Coulomb friction coefficient of cloth on body")
    thickness_mm: float = Field(
        0.5,
        ge=0.01,
        le=10,
        description="distance t from the skin at which the cloth's middle surface begins to feel it",
    )
    stiffness_N_per_m3: float = Field(
        1.0e7,
        ge=1e4,
        le=1e10,
        description="k: at a depth d little below t the pressure is k d^2 / t, at the skin 7 k t",
    )
    layers: LayersSpec | None = Field(
        None, description="contact of cloth with cloth, of one garment and between garments; null: they do not meet"
    )


class SolverSpec(Spec):
    """Time stepping and linear solver."""

    step_s: float = Field(1 / 60, ge=1e-7, le=0.1, description="time step, where nothing asks for a smaller one")
    min_step_s: float = Field(1e-5, ge=1e-9, le=0.1, description="smaller steps are not tried: the run fails")
    scheme: Literal["backward_euler", "tr_bdf2"] = Field(
        "backward_euler",
        description="time integration of drape and motion; backward_euler: first order, damps much; tr_bdf2: second "
        "order, two solves a step",
    )
    error_mm: float | None = Field(
        None,
        gt=0,
        le=100,
        description="steps of drape and motion are as long as keeps their estimated local error (root mean square over "
        "the mass) below this, and no longer than step_s; null: step_s",
    )
    max_newton_iterations: int = Field(
        2, ge=1, le=200, description="Newton iterations a step, twice as many while settling; 1: linearly implicit"
    )
    max_newton_inside: int | None = Field(
        None,
        ge=1,
        le=800,
        description="Newton iterations a step at most where it would else end with cloth in the body, in drape and "
        "motion; no more than max_newton_iterations: it stays there until later steps move it out; null: twenty times "
        "max_newton_iterations",
    )
    newton_tolerance: float = Field(
        0.05, gt=0, lt=1, description="a step is solved when its out-of-balance force is this part of the weight"
    )
    longest_move_mm: float = Field(
        20.0,
        ge=1e-3,
        le=100,
        description="no vertex goes further in one Newton iteration: it must not jump over a limb",
    )
    linear_tolerance: float = Field(1e-2, gt=0, lt=1, description="relative residual at which conjugate gradients stop")
    max_linear_iterations: int = Field(500, ge=1, le=100_000, description="conjugate-gradient steps a Newton iteration")
    preconditioner: Literal["coarse", "block_jacobi"] = Field(
        "coarse", description="block_jacobi: 3x3 blocks alone; coarse: with a coarse space of rigid motions"
    )
    precision: Literal["f64", "f32"] = Field("f64", description="floating-point numbers of the simulation")
    threads: int | None = Field(
        None,
        ge=1,
        le=1024,
        description="CPU threads at most, one where the cloth has few vertices; null: all there are",
    )

    @model_validator(mode="after")
    def _steps_in_order(self) -> SolverSpec:
        if self.min_step_s > self.step_s:
            raise fault(f"must not exceed step_s = {self.step_s:g} (got {self.min_step_s:g})", "min_step_s")
        return self


class DrapeSpec(Spec):
    """The first relaxation of the dressed garment, from the start that the dressing gives."""

    duration_s: float = Field(1.0, ge=0, le=600, description="time before the motion, or the settling, begins")


class SettleSpec(Spec):
    """When the worn shape counts as found."""

    residual: float = Field(1e-2, gt=0, le=1, description="net force on free vertices over weight, 2-norms")
    max_steps: int = Field(200, ge=0, le=100_000, description="steps given to reach it; 0: do not settle")


class OutputSpec(Spec):
    """What is written."""

    frames_per_s: float = Field(30.0, ge=0.01, le=1000, description="frames for each second simulated")
    formats: list[FrameFormat] = Field(["vtu"], description="mesh files; all but vtu hold positions only")
    views: list[View] = Field(["front", "right"], description="cameras; 'right' looks at the wearer's right side")
    image_size: Annotated[list[Annotated[int, Field(ge=16, le=8192)]], Field(min_length=2, max_length=2)] = Field(
        [720, 960], description="width and height in pixels, even numbers"
    )
    renderer: Drawn = Field(
        "auto", description="who draws: GGUI, which needs Vulkan, or the rasteriser; auto: GGUI on a graphics card"
    )
    images: bool = Field(True, description="write PNG pictures")
    video: bool = Field(True, description="write the film")
    checkpoint_s: float = Field(
        30.0, ge=0, le=1e6, description="wall-clock time between checkpoints, from which a run that was killed goes on"
    )
    maps: list[Map] = Field(
        [], description="pictures of the last frame coloured by these; body_pressure: on the body, without the cloth"
    )
    body_pressure: bool = Field(
        False, description="write the body's surface with every frame, with the pressure of the cloth on it"
    )

    @field_validator("image_size")
    @classmethod
    def _even(cls, size: list[int]) -> list[int]:
        for index, length in enumerate(size):
            if length % 2:
                raise fault(f"must be an even number, as films want (got {length})", index)
        return size

    @field_validator("formats", "views", "maps")
    @classmethod
    def _once(cls, names: list[str]) -> list[str]:
        for index, name in enumerate(names):
            if name in names[:index]:
                raise fault(f"{name} is named twice", index)
        return names


class SceneSpec(Spec):
    """Everything a run needs; the name also names the output folder."""

    scene: Name = Field(description="name of the scene")
    body: Annotated[BodySpec | None, REFERENCE] = Field(None, description="who is dressed; null: plain sheets alone")
    pose: Annotated[PoseSpec | None, REFERENCE] = Field(
        None, description="pose in which the body is dressed; null: the rest pose"
    )
    motion: list[MotionStepSpec] = Field([], description="poses to go through after the drape, in turn")
    garments: list[GarmentSpec] = Field(min_length=1, max_length=10, description="garments, from the skin outwards")
    mesh: MeshSpec = Field(MeshSpec(), description="the triangles")
    contact: ContactSpec = Field(ContactSpec(), description="contact of cloth and body")
    gravity_m_s2: Annotated[list[Annotated[float, Field(ge=-1000, le=1000)]], Field(min_length=3, max_length=3)] = (
        Field([0.0, -9.81, 0.0], description="acceleration of gravity: x, y (up), z")
    )
    solver: SolverSpec = Field(SolverSpec(), description="time stepping and linear solver")
    drape: DrapeSpec = Field(DrapeSpec(), description="the first relaxation")
    settle: SettleSpec = Field(SettleSpec(), description="when the worn shape counts as found")
    output: OutputSpec = Field(OutputSpec(), description="what is written")
    skip: SkipSpec = Field(SkipSpec(), description="what is left out because the scene does not need it")
