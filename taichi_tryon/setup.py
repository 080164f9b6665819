"""From a scene to everything the simulation starts from, in plain arrays: body, motion, sewn and dressed garments."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from taichi_tryon import blas
from taichi_tryon.body.model import Balls, Body
from taichi_tryon.body.ranges import beyond
from taichi_tryon.body.skeleton import Motion, Pose
from taichi_tryon.body.spec import PoseSpec
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.dressing.check import crossings
from taichi_tryon.dressing.layers import Layer, beneath, touching
from taichi_tryon.dressing.place import Dressed, dress
from taichi_tryon.errors import DressingError, below
from taichi_tryon.fabric import Moduli
from taichi_tryon.holds.held import Hold, Holds
from taichi_tryon.mesh.garment import GarmentMesh, build
from taichi_tryon.pattern.changes import changed, joined
from taichi_tryon.pattern.panel import Pattern
from taichi_tryon.scene.models import GarmentSpec, SceneSpec
from taichi_tryon.sheet.clear import parted
from taichi_tryon.sheet.mesh import PANEL, sheet_mesh
from taichi_tryon.sheet.place import place
from taichi_tryon.timing import Stopwatch
from taichi_tryon.units import CM, MM

# part of the layers' thickness that layers must be apart at the start
LEAST_DISTANCE = 0.01


@dataclass(frozen=True)
class Garment:
    """One garment, sewn and laid around the body, or a plain sheet where it was placed; it starts with ``velocities``
    (nv, 3) [m/s]."""

    spec: GarmentSpec
    mesh: GarmentMesh
    dressed: Dressed
    velocities: np.ndarray

    @property
    def name(self) -> str:
        return self.spec.name


@dataclass(frozen=True)
class Setup:
    """What a simulation starts from. ``positions`` (nv, 3) [m] and ``velocities`` (nv, 3) [m/s] are those of all
    garments, in the cloth's order."""

    scene: SceneSpec
    body: Body
    motion: Motion
    garments: tuple[Garment, ...]
    cloth: Cloth
    positions: np.ndarray
    velocities: np.ndarray
    holds: Holds

    @property
    def end_time(self) -> float:
        """How long body and holds move [s]."""
        return max(self.motion.end_time, self.holds.end_time)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know of the start: poses beyond the joints' ranges, and what the dressing has to say."""
        scene = self.scene
        poses = [pose for pose in (scene.pose, *(step.pose for step in scene.motion)) if pose]
        turns = (line for pose in poses for line in beyond(pose, scene.body))
        return (*dict.fromkeys(turns), *(note for garment in self.garments for note in garment.dressed.notes))


def prepare(scene: SceneSpec, clock: Stopwatch) -> Setup:
    """Build body, meshes and start. Raises PatternError or DressingError where a garment cannot be made or put on,
    also where layers that shall not pass through each other do, InputError where a hold finds nothing to hold."""
    blas.stay_on_one_thread()
    with clock("body"):
        body = Body.from_spec(scene.body) if scene.body else Body.absent()
        rest = PoseSpec(name="rest")
        poses = [Pose.from_spec(scene.pose or rest), *(Pose.from_spec(step.pose) for step in scene.motion)]
        times = np.cumsum([0.0, *(step.duration_s for step in scene.motion)])
        motion = Motion(body.skeleton, tuple(times.tolist()), tuple(poses))
        start = motion.transforms(0.0)
    garments = []
    for number, spec in enumerate(scene.garments):
        edge_length = scene.mesh.edge_length_mm * MM
        with below("garments", number):
            if spec.sheet:
                garments.append(_placed(spec, edge_length, clock, body, start))
            else:
                garments.append(_dressed(spec, edge_length, clock, body, start, _layers(garments)))
    with clock("mesh"):
        fabrics = [(garment.mesh, Moduli.from_spec(garment.spec.fabric)) for garment in garments]
        cloth = Cloth.join(fabrics, scene.mesh.bending, scene.mesh.membrane)
    positions = np.concatenate([garment.dressed.positions for garment in garments])
    velocities = np.concatenate([garment.velocities for garment in garments])
    garments = [
        _shared(garment, positions[part.vertices], velocities[part.vertices])
        for garment, part in zip(garments, cloth.parts, strict=True)
    ]
    if scene.contact.layers:
        with clock("dressing"):
            _require_order(garments)
            _require_apart(garments, cloth, positions, scene.contact.layers.thickness_mm * MM)
    holds = []
    for number, (garment, part) in enumerate(zip(garments, cloth.parts, strict=True)):
        for name, spec in garment.spec.holds.items():
            with below("garments", number, "holds", name):
                holds.append(Hold.from_spec(name, spec, garment.mesh, part.vertices.start))
    held = Holds.of(holds, positions)
    cloth = cloth.clamped(~held.free.any(axis=1))
    return Setup(scene, body, motion, tuple(garments), cloth, positions, velocities, held)


def _shared(garment: Garment, positions: np.ndarray, velocities: np.ndarray) -> Garment:
    """A garment whose start is a part of the cloth's, and whose mesh has forgotten what it was asked for so far."""
    dressed = replace(garment.dressed, positions=positions)
    return replace(garment, mesh=replace(garment.mesh), dressed=dressed, velocities=velocities)


def _require_apart(garments: list[Garment], cloth: Cloth, positions: np.ndarray, thickness: float) -> None:
    """Raise DressingError where cloth passes through cloth at the start, or lies on it without a distance: layers that
    cross can never be parted, and of those that touch nothing says which is the upper one."""
    triangles = cloth.triangles
    pairs, what = crossings(positions, triangles), "pairs of triangles cross"
    if not len(pairs):
        near = touching(positions, triangles, LEAST_DISTANCE * thickness)
        of_vertex = np.zeros(cloth.vertex_count, int)
        of_vertex[triangles] = np.arange(len(triangles))[:, None]
        pairs, what = np.column_stack([of_vertex[near[:, 0]], near[:, 1]]), "vertices touch other cloth"
    if len(pairs):
        names = np.concatenate([[f"{g.name}.{g.mesh.panel_names[p]}" for p in g.mesh.panel] for g in garments])
        one, other = names[pairs[0]]
        place = ", ".join(f"{x:.1f}" for x in positions[triangles[pairs[0]]].mean(axis=(0, 1)) / CM)
        sheet = any(garment.spec.sheet for garment in garments if f"{garment.name}.{PANEL}" in (one, other))
        mend = "move the sheet" if sheet else "change the dressing there, raise dressing.layer_mm of the outer garment"
        raise DressingError(
            f"{len(pairs)} {what} at the start, the first of {one} and {other} at [{place}] cm; {mend}, or leave "
            "contact.layers out",
            at=("contact", "layers"),
        )


def _layers(garments: list[Garment]) -> tuple[Layer, ...]:
    """Those of the garments that are worn, and so have an inside."""
    return tuple((g.dressed.positions, g.mesh.triangles) for g in garments if not g.spec.sheet)


def _require_order(garments: list[Garment]) -> None:
    """Raise DressingError where a garment starts on the inner side of one that is worn underneath it."""
    worn = [garment for garment in garments if not garment.spec.sheet]
    for index, outer in enumerate(worn):
        for inner, layer in zip(worn[:index], _layers(worn), strict=False):
            low = beneath(outer.dressed.positions, layer)
            if low.any():
                panel = outer.mesh.panel[low[outer.mesh.triangles].any(axis=1)][0]
                raise DressingError(
                    f"garment {outer.name} starts beneath {inner.name}, which stands before it in "
                    f"garments, at {low.sum()} vertices, the first of panel {outer.mesh.panel_names[panel]}; widen the "
                    f"disks of {outer.name} there, raise its dressing.layer_mm, or let the two change places",
                    at=("contact", "layers"),
                )


def _dressed(spec: GarmentSpec, edge_length: float, clock, body: Body, transforms: np.ndarray, under) -> Garment:
    with clock("mesh"), below("pattern"):
        pattern = changed(Pattern.from_spec(spec.pattern), spec.open, spec.bands)
        mesh = build(pattern, edge_length, spec.name)
    with clock("dressing"), below("dressing"):
        dressed = dress(pattern, mesh, spec.dressing, body, transforms, under)
    return Garment(spec, mesh, dressed, np.zeros_like(dressed.positions))


def _placed(spec: GarmentSpec, edge_length: float, clock, body: Body, transforms: np.ndarray) -> Garment:
    with clock("mesh"), below("sheet"):
        mesh = sheet_mesh(spec.sheet, edge_length, spec.name, joined((), spec.bands))
    positions, velocities = place(spec.sheet, mesh)
    with clock("dressing"), below("sheet"):
        _require_one_side(spec.name, positions, mesh.triangles, body.posed(transforms))
    return Garment(spec, mesh, Dressed(positions, (), ()), velocities)


def _require_one_side(name: str, positions: np.ndarray, triangles: np.ndarray, balls: Balls) -> None:
    """Raise DressingError where a sheet starts so deep in the body that a limb would be left in it."""
    found, depth = parted(positions, triangles, balls)
    if len(found):
        place = ", ".join(f"{x:.1f}" for x in positions[triangles[found[0]]].mean(axis=0) / CM)
        raise DressingError(
            f"sheet '{name}' starts {depth[0] / MM:.1f} mm inside the body at [{place}] cm, where parts of it would "
            "leave the body on different sides; move it off the body, or nearer to the skin that it shall lie on",
            at=("origin_cm",),
        )
