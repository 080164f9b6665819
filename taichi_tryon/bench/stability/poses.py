"""Garments in poses drawn over the range of every joint: each comes to rest, or it is said why not, and where.

A top and trousers in turn, with triangles of 20 mm and contact of cloth with cloth. Each drape is a run as a user
starts it, in a process of its own. It ends well where it settles; where the dressing refuses the pose and names panel
and disk; or where the run fails and names the spot. Where it settles, no cloth may be in the body or through other
cloth. The ranges are the body's own (``range_degree``); joints that have none are not turned. Two joints, each within
its range, may still bring limbs into each other.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event, Timer

import numpy as np

from taichi_tryon.batch.drape import Drape, Program, run_drape
from taichi_tryon.bench.record import Record, absolute, at_least, told
from taichi_tryon.bench.simulate import FOLDER, scene_path
from taichi_tryon.bench.stability.judge import is_placed
from taichi_tryon.body.spec import BodySpec, PoseSpec
from taichi_tryon.scene.load import load_scene
from taichi_tryon.scene.resolved import to_yaml

SCENES = {"top": "scenes/shirt_arms_raised.yaml", "trousers": "scenes/trousers_step.yaml"}
SETTINGS = ("mesh.edge_length_mm=20", "contact.layers={}", "output.images=false", "output.video=false")
SEED, COUNT, QUICK = 5, 200, 8
LIMIT_S = 1800.0
LIMITED = ("penetration_mm", "crossing_triangle_pairs")
"""Figures of a report that shall be 0."""
KINDS = ("settled", "refused", "failed", "silent")


@dataclass(frozen=True)
class Outcome:
    """``kind``: "settled" with the LIMITED ``figures``; "refused" by the dressing or "failed", with ``reason`` and
    place; "silent" where the reason or the place is missing."""

    kind: str
    reason: str
    figures: dict[str, float] = field(default_factory=dict)


def records(quick: bool, count: int | None = None) -> Iterator[Record]:
    """Records of each pose, then the sums."""
    scene_path("fold.yaml")  # raises where configs is not here
    counts, worst, begin = Counter(), dict.fromkeys(LIMITED, 0.0), time.perf_counter()
    with TemporaryDirectory() as folder:
        for number in range(count or (QUICK if quick else COUNT)):
            start, drape = time.perf_counter(), drape_of(number)
            outcome = tried(drape, Path(folder) / drape.name)
            yield from of(drape.parameters, outcome, time.perf_counter() - start)
            counts[outcome.kind] += 1
            worst |= {name: max(worst[name], value) for name, value in outcome.figures.items()}
    wall = time.perf_counter() - begin
    yield told("poses", {}, "poses_tried", "1", counts.total(), wall)
    for kind in KINDS:
        yield told("poses", {}, f"poses_{kind}", "1", counts[kind], wall)
    for name, value in worst.items():
        yield absolute("poses", {}, f"{name}_worst", "1", value, 0, 0, wall)


def of(parameters: dict, outcome: Outcome, wall: float) -> Iterator[Record]:
    """Records of a pose."""
    where = {**parameters, "outcome": outcome.kind, "reason": outcome.reason}
    yield at_least("poses", where, "settled_or_said_why", "1", outcome.kind != "silent", 1, wall)
    for name, value in outcome.figures.items():
        yield absolute("poses", parameters, name, "1", value, 0, 0, wall)


def drape_of(number: int) -> Drape:
    """The drape of this number, the same however many there are."""
    garment = list(SCENES)[number % len(SCENES)]
    scene = load_scene(FOLDER.parent / SCENES[garment], SETTINGS)
    scene = scene.model_copy(update={"pose": drawn(scene.body, number)})
    return Drape(f"{garment}_{number}", scene.scene, {"garment": garment, "pose": number}, to_yaml(scene))


def drawn(body: BodySpec, number: int) -> PoseSpec:
    """Every joint turned about each axis by an angle drawn evenly from its range, two digits after the point."""
    rng = np.random.default_rng((SEED, number))
    turns = {
        name: [round(rng.uniform(*axes[axis]), 2) if axis in axes else 0.0 for axis in "xyz"]
        for name, bone in body.bones.items()
        if (axes := bone.range_degree.axes)
    }
    return PoseSpec(name=f"drawn {number}", rotations_degree=turns)


def tried(drape: Drape, folder: Path) -> Outcome:
    """Run a drape in a process of its own and judge how it ended; after LIMIT_S it is stopped."""
    stop = Event()
    late = Timer(LIMIT_S, stop.set)
    late.start()
    try:
        return judged(run_drape(drape, folder, Program(options=("--arch", "cpu")), stop))
    finally:
        late.cancel()


def judged(report: dict) -> Outcome:
    """What a report comes to; that of a drape that was refused has only status and reason."""
    reason, failure = report["reason"], report.get("failure")
    if report["status"] == "settled":
        return Outcome("settled", reason, {name: report["quality"][name] for name in LIMITED})
    if failure:
        x, y = failure["at_cm"]
        return Outcome("failed", f"{reason}; worst in panel {failure['panel']} at ({x:g}, {y:g}) cm")
    return Outcome("refused" if report["status"] == "failed" and is_placed(reason) else "silent", reason)
