"""From a scene to everything the simulation starts from, in plain arrays: body, motion, sewn and dressed garments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_tryon.body.model import Body
from taichi_tryon.body.skeleton import Motion, Pose
from taichi_tryon.cloth.model import Cloth
from taichi_tryon.dressing.place import Dressed, dress
from taichi_tryon.fabric import Moduli
from taichi_tryon.mesh.garment import GarmentMesh, build
from taichi_tryon.pattern.panel import Pattern
from taichi_tryon.scene.models import GarmentSpec, SceneSpec
from taichi_tryon.timing import Stopwatch
from taichi_tryon.units import MM


@dataclass(frozen=True)
class Garment:
    """One garment, sewn and laid around the body."""

    spec: GarmentSpec
    mesh: GarmentMesh
    dressed: Dressed

    @property
    def name(self) -> str:
        return self.spec.name


@dataclass(frozen=True)
class Setup:
    """What a simulation starts from. ``positions`` (nv, 3) [m] are those of all garments, in the cloth's order."""

    scene: SceneSpec
    body: Body
    motion: Motion
    garments: tuple[Garment, ...]
    cloth: Cloth
    positions: np.ndarray


def prepare(scene: SceneSpec, clock: Stopwatch) -> Setup:
    """Build body, meshes and start. Raises PatternError or DressingError where a garment cannot be made or put on."""
    with clock("body"):
        body = Body.from_spec(scene.body)
        poses = [Pose.from_spec(scene.pose), *(Pose.from_spec(step.pose) for step in scene.motion)]
        times = np.cumsum([0.0, *(step.duration_s for step in scene.motion)])
        motion = Motion(body.skeleton, tuple(times.tolist()), tuple(poses))
        start = motion.transforms(0.0)
    garments = []
    for layer, spec in enumerate(scene.garments):
        with clock("mesh"):
            pattern = Pattern.from_spec(spec.pattern)
            mesh = build(pattern, scene.mesh.edge_length_mm * MM, spec.name)
        with clock("dressing"):
            garments.append(Garment(spec, mesh, dress(pattern, mesh, spec.dressing, body, start, layer)))
    with clock("mesh"):
        cloth = Cloth.join([(garment.mesh, Moduli.from_spec(garment.spec.fabric)) for garment in garments])
    positions = np.concatenate([garment.dressed.positions for garment in garments])
    return Setup(scene, body, motion, tuple(garments), cloth, positions)
