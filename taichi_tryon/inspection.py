"""Looking at one part alone: what the commands ``body`` and ``pattern`` print and write."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from taichi_tryon.body.measure import measure
from taichi_tryon.body.model import Body
from taichi_tryon.body.ranges import beyond
from taichi_tryon.body.skeleton import Pose
from taichi_tryon.body.spec import BodySpec, PoseSpec
from taichi_tryon.body.surface import surface_mesh
from taichi_tryon.errors import InputError
from taichi_tryon.output.files import replace_atomically
from taichi_tryon.pattern.draw import draw
from taichi_tryon.pattern.measure import panel_rows, seam_rows
from taichi_tryon.pattern.panel import Pattern
from taichi_tryon.pattern.spec import PatternSpec
from taichi_tryon.units import CM

MESH_SUFFIXES = (".obj", ".ply", ".stl", ".vtu")
PICTURE_SIZE = (720, 960)
"""Width and height of each of the views (front and right) of a body's picture."""


def inspect_body(spec: BodySpec, pose_spec: PoseSpec | None, measured: bool, output: Path | None) -> list[str]:
    """Lines on a body in a pose (None: the rest pose), with its girths where ``measured``.

    ``output`` gets a mesh or, as PNG, a picture. Raises InputError where the pose or the kind of file does not fit.
    """
    if output and output.suffix not in (*MESH_SUFFIXES, ".png"):
        raise InputError(f"--output {output}: the name must end in one of .png, {', '.join(MESH_SUFFIXES)}")
    body = Body.from_spec(spec)
    pose = Pose.from_spec(pose_spec or PoseSpec(name="rest"))
    transforms = body.skeleton.transforms(pose)
    bones, landmarks = len(body.skeleton.names), len(body.landmarks)
    lines = [
        f"{body.name}, {pose.name}: {len(body.balls.centers)} balls in {len(body.group_names)} groups, "
        f"{bones} bones, {landmarks} landmarks"
    ]
    lines += [f"note: {note}" for note in beyond(pose_spec, spec)] if pose_spec else []
    if measured:
        lines += [_girth(*girth) for girth in measure(body, transforms)]
    if output:
        vertices, triangles = surface_mesh(body.posed(transforms))
        (_write_picture if output.suffix == ".png" else _write_mesh)(output, vertices, triangles)
        lines.append(f"{output}: {len(vertices)} vertices, {len(triangles)} triangles")
    return lines


def inspect_pattern(spec: PatternSpec, output: Path | None) -> list[str]:
    """Lines on a pattern: area of each panel, lengths of both sides of each seam; ``output`` gets a drawing."""
    pattern = Pattern.from_spec(spec)
    lines = [f"{pattern.name}: {len(pattern.panels)} panels, {len(pattern.seams)} seams"]
    for panel in panel_rows(pattern):
        lines.append(f"panel {panel.name}: {panel.area / CM**2:.0f} cm2, outline {panel.outline / CM:.1f} cm")
    for seam in seam_rows(pattern):
        lengths = f"{seam.length_a / CM:.2f} cm to {seam.length_b / CM:.2f} cm (ease {seam.ease / CM:g} cm)"
        lines.append(f"seam {seam.number} {seam.name}: {seam.side_a} to {seam.side_b}: {lengths}")
    if output:
        draw(pattern, output)
        lines.append(f"{output}: drawn")
    return lines


def _girth(name: str, girth: float, published: float | None) -> str:
    reference = f" (published {published / CM:.1f})" if published else ""
    return f"{name}: {girth / CM:.1f} cm{reference}"


def _write_mesh(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> None:
    import meshio

    mesh = meshio.Mesh(vertices, [("triangle", triangles.astype(np.int32))])
    replace_atomically(path, lambda part: meshio.write(part, mesh, file_format=path.suffix[1:]))


def _write_picture(path: Path, vertices: np.ndarray, triangles: np.ndarray) -> None:
    import imageio.v3 as iio

    from taichi_tryon import runtime
    from taichi_tryon.view.appearance import skin
    from taichi_tryon.view.camera import bounds_of, view_camera
    from taichi_tryon.view.renderer import make_renderer

    runtime.start(precision="f32")
    renderer, _ = make_renderer(PICTURE_SIZE)
    bounds, aspect = bounds_of([vertices]), PICTURE_SIZE[0] / PICTURE_SIZE[1]
    prepared = renderer.prepare([skin(vertices, triangles)])
    views = [renderer.render(prepared, view_camera(name, bounds, aspect)) for name in ("front", "right")]
    renderer.close()
    replace_atomically(path, lambda part: iio.imwrite(part, np.concatenate(views, axis=1)))
