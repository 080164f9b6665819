"""``check``: everything that a run would read is read, meshes and start are built, nothing is simulated."""

from __future__ import annotations

import numpy as np

from taichi_tryon.cloth.model import Part
from taichi_tryon.figures import fit_lines
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.setup import Garment, Setup, prepare
from taichi_tryon.skipped import skipped
from taichi_tryon.timing import Stopwatch
from taichi_tryon.units import MM


def check_scene(scene: SceneSpec) -> list[str]:
    """Lines on the sizes of a scene, on how its garments lie at the start, and on what a run would skip.

    Raises InputError, PatternError or DressingError as ``run`` would.
    """
    setup = prepare(scene, Stopwatch())
    poses = " to ".join(pose.name for pose in setup.motion.poses)
    lengths = np.concatenate([garment.mesh.edge_lengths for garment in setup.garments])
    angle = min(garment.mesh.min_angle_deg for garment in setup.garments)
    lines = [
        f"{scene.scene}: {setup.body.name}, {poses}",
        f"mesh: {setup.cloth.vertex_count} vertices, {len(setup.cloth.triangles)} triangles, mean edge "
        f"{lengths.mean() / MM:.1f} mm ({scene.mesh.edge_length_mm:g} asked for), least angle {angle:.1f} degrees",
    ]
    for part, garment in zip(setup.cloth.parts, setup.garments, strict=True):
        lines += _garment(setup, part, garment)
    lines += [f"note: {note}" for note in setup.notes]
    lines += [f"hold {hold.name}: {len(hold.vertices)} vertices" for hold in setup.holds.holds]
    lines.append(f"frames: {_frames(scene, setup.end_time)}")
    lines += [f"skipped: {item['what']}: {item['why']}" for item in skipped(setup)]
    return lines


def _garment(setup: Setup, part: Part, garment: Garment) -> list[str]:
    area, mass = setup.cloth.areas[part.triangles].sum(), setup.cloth.masses[part.vertices].sum()
    panels, triangles = len(garment.mesh.panel_names), len(garment.mesh.triangles)
    lines = [
        f"garment {part.name}: {panels} panels, {garment.mesh.vertex_count} vertices, {triangles} triangles, "
        f"{area:.3f} m2, {1000 * mass:.0f} g"
    ]
    off = fit_lines(setup, garment, setup.positions, setup.motion.transforms(0.0))
    for line in garment.dressed.lines:
        lines.append(
            f"  {line.name}: {len(line.vertices)} vertices on disk {line.disk}, "
            f"{off[line.name]['min']:.1f} to {off[line.name]['max']:.1f} mm from its plane"
        )
    return lines


def _frames(scene: SceneSpec, moving: float) -> str:
    duration = scene.drape.duration_s + moving
    # no more than one frame a step
    rate = min(scene.output.frames_per_s, 1 / scene.solver.step_s)
    return f"about {2 + int(duration * rate + 1e-9)} for {duration:g} s of drape and motion, and some while dressing"
