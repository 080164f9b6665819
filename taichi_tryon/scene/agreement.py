"""Whether the parts of a scene fit each other: what none of them can know alone."""

from __future__ import annotations

from collections.abc import Iterator

from taichi_tryon.body.spec import BodySpec, PoseSpec
from taichi_tryon.dressing.spec import DressingSpec
from taichi_tryon.pattern import changes
from taichi_tryon.pattern.panel import Pattern
from taichi_tryon.scene.mesh_size import MOST_VERTICES, vertex_estimate
from taichi_tryon.scene.models import GarmentSpec, SceneSpec

Disagreement = tuple[tuple[str | int, ...], str]

# thickness of layers over the edge length: thicker, neighbouring triangles push each other apart in flat cloth
THICKEST = 0.5


def disagreements(scene: SceneSpec) -> Iterator[Disagreement]:
    """Every name in one part that another part does not have, layers too thick for the mesh, and meshes too large for
    any memory: where it stands in the scene, and the message."""
    if scene.body is None:
        yield from _without_body(scene)
    else:
        if scene.pose is not None:
            yield from unknown_bones(scene.pose, scene.body, "pose")
        for index, step in enumerate(scene.motion):
            yield from unknown_bones(step.pose, scene.body, "motion", index, "pose")
    layers, thickest = scene.contact.layers, THICKEST * scene.mesh.edge_length_mm
    if layers is not None and layers.thickness_mm > thickest:
        yield (
            ("contact", "layers"),
            f"thickness_mm must not exceed half of mesh.edge_length_mm, {thickest:g} (got {layers.thickness_mm:g})",
        )
    vertices = sum(vertex_estimate(garment, scene.mesh.edge_length_mm) for garment in scene.garments)
    if vertices > MOST_VERTICES:
        yield (
            ("mesh", "edge_length_mm"),
            f"the garments would have about {vertices:.1g} vertices; the most are {MOST_VERTICES:.0g}: make it longer",
        )
    names = [garment.name for garment in scene.garments]
    holds: set[str] = set()
    for index, garment in enumerate(scene.garments):
        if garment.name in names[:index]:
            yield ("garments", index, "name"), f"{garment.name}: an earlier garment has this name"
        for hold in garment.holds:
            if hold in holds:
                yield ("garments", index, "holds", hold), f"{hold}: a hold of an earlier garment has this name"
            holds.add(hold)
        yield from _changes(garment, "garments", index)
        if garment.dressing is not None:
            if scene.body is not None:
                yield from _disks(garment.dressing, scene.body, "garments", index, "dressing")
            yield from _panels(garment, "garments", index, "dressing")


def _without_body(scene: SceneSpec) -> Iterator[Disagreement]:
    """What only a body can have or wear."""
    dressed = [garment.name for garment in scene.garments if garment.dressing is not None]
    if dressed:
        yield ("body",), f"this key is required (who is dressed in {dressed[0]}); only plain sheets go without a body"
    elif scene.pose is not None:
        yield ("pose",), "a scene without a body has no pose"
    elif scene.motion:
        yield ("motion",), "a scene without a body has no motion"
    else:
        for index, name in enumerate(scene.output.maps):
            if name in ("gap", "body_pressure"):
                yield ("output", "maps", index), f"a scene without a body has no {name}"
        if scene.output.body_pressure:
            yield ("output", "body_pressure"), "a scene without a body has no pressure on it"


def unknown_bones(pose: PoseSpec, body: BodySpec, *where: str | int) -> Iterator[Disagreement]:
    """Bones that a pose turns and the body does not have; ``where`` the pose stands."""
    for bone in pose.rotations_degree:
        yield from _known(bone, body.bones, f"a bone of body {body.name}", *where, "rotations_degree", bone)


def _disks(dressing: DressingSpec, body: BodySpec, *where: str | int) -> Iterator[Disagreement]:
    for name, disk in dressing.disks.items():
        here = (*where, "disks", name)
        points = [*body.landmarks, *body.bones]
        yield from _known(disk.at, points, f"a landmark or bone of body {body.name}", *here, "at")
        yield from _known(disk.turns_with, body.bones, f"a bone of body {body.name}", *here, "turns_with")
        if disk.bisects_with is not None:
            yield from _known(disk.bisects_with, body.bones, f"a bone of body {body.name}", *here, "bisects_with")
        for index, group in enumerate(disk.groups):
            yield from _known(group, body.groups, f"a ball group of body {body.name}", *here, "groups", index)


def _changes(garment: GarmentSpec, *where: str | int) -> Iterator[Disagreement]:
    """Closures that are opened and tapes that are sewn on where there are none, or no edges."""
    if garment.sheet is not None:
        for i, band in enumerate(garment.bands):
            for j, (panel, edge) in enumerate(band.edges):
                here = (*where, "bands", i, "edges", j)
                yield from _known(panel, ("sheet",), "the panel of a plain sheet", *here)
                yield from _known(edge, garment.sheet.edges, "an edge of this sheet", *here)
    elif garment.open or garment.bands:
        for fault in changes.faults(Pattern.from_spec(garment.pattern), garment.open, garment.bands):
            yield (*where, *fault.place), fault.message


def _panels(garment: GarmentSpec, *where: str | int) -> Iterator[Disagreement]:
    panels = [*garment.pattern.panels, *garment.pattern.mirrored_panels]
    for panel in garment.dressing.panels:
        yield from _known(panel, panels, f"a panel of pattern {garment.pattern.pattern}", *where, "panels", panel)
    for panel in panels:
        if panel not in garment.dressing.panels:
            yield (*where, "panels"), f"panel {panel} of pattern {garment.pattern.pattern} is laid nowhere"
            continue
        drawn = garment.pattern.panels[garment.pattern.mirrored_panels.get(panel, panel)]
        edges = [edge.name for edge in drawn.edges]
        for key in ("top", "bottom"):
            for index, edge in enumerate(getattr(garment.dressing.panels[panel], key)):
                yield from _known(edge, edges, f"an edge of panel {panel}", *where, "panels", panel, key, index)


def _known(name: str, allowed: object, what: str, *where: str | int) -> Iterator[Disagreement]:
    if name not in allowed:
        yield where, f"{name} is not {what}; allowed: {', '.join(allowed)}"
