"""Garments in poses drawn over the range of every joint: each comes to rest, or it is said why not, and where.

A top and trousers in turn, with triangles of 20 mm and contact of cloth with cloth. Each drape is a run as a user
starts it, in a process of its own. Where the dressing refuses a pose, naming panel and disk, the garment is put on in
its own pose and the body led from there to the drawn one, as its message advises. A drape ends well where it settles,
or where it fails and names the spot. Where it settles, no cloth may be in the body or through other cloth; cloth whose
deepest point is between limbs that run into each other, as the run says, is not counted as in the body: both sides of
it are.
The ranges are the body's own (``range_degree``); joints that have none are not turned. Two joints, each within its
range, may still bring limbs into each other.
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
from taichi_tryon.run import MEETING
from taichi_tryon.scene.load import load_scene
from taichi_tryon.scene.models import MotionStepSpec
from taichi_tryon.scene.resolved import to_yaml

SCENES = {"top": "scenes/shirt_arms_raised.yaml", "trousers": "scenes/trousers_step.yaml"}
SETTINGS = ("mesh.edge_length_mm=20", "contact.layers={}", "output.images=false", "output.video=false",
            "output.frames_per_s=1")  # fmt: skip
SEED, COUNT, QUICK = 5, 200, 8
LIMIT_S = 1800.0
LED_S = 1.0
"""How long the body takes to a pose in which the garment cannot be put on."""
LIMITED = ("penetration_mm", "crossing_triangle_pairs")
"""Figures of a report that shall be 0."""
KINDS = ("settled", "failed", "silent")
"""How a drape may end. One that is refused is tried again in another way."""


@dataclass(frozen=True)
class Outcome:
    """``kind``: one of KINDS, "settled" with the LIMITED ``figures``, "failed" with ``reason`` and place, "silent"
    where one of them is missing; or "refused" by the dressing, with both."""

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
            if outcome.kind == "refused":
                counts["refused"] += 1
                drape = drape_of(number, led=True)
                outcome = tried(drape, Path(folder) / drape.name)
            yield from of(drape.parameters, outcome, time.perf_counter() - start)
            counts.update(("tried", outcome.kind))
            worst |= {name: max(worst[name], value) for name, value in outcome.figures.items()}
    wall = time.perf_counter() - begin
    for kind in ("tried", "refused", *KINDS):
        yield told("poses", {}, f"poses_{kind}", "1", counts[kind], wall)
    for name, value in worst.items():
        yield absolute("poses", {}, f"{name}_worst", "1", value, 0, 0, wall)


def of(parameters: dict, outcome: Outcome, wall: float) -> Iterator[Record]:
    """Records of a pose."""
    where = {**parameters, "outcome": outcome.kind, "reason": outcome.reason}
    yield at_least("poses", where, "settled_or_said_why", "1", outcome.kind != "silent", 1, wall)
    for name, value in outcome.figures.items():
        yield absolute("poses", parameters, name, "1", value, 0, 0, wall)


def drape_of(number: int, led: bool = False) -> Drape:
    """The drape of this number, the same however many there are. led: to its pose from that in which the scene has the
    garment put on."""
    garment = list(SCENES)[number % len(SCENES)]
    scene = load_scene(FOLDER.parent / SCENES[garment], SETTINGS)
    pose = drawn(scene.body, number)
    change = {"motion": [MotionStepSpec(pose=pose, duration_s=LED_S)]} if led else {"pose": pose}
    parameters = {"garment": garment, "pose": number, "start": "led there" if led else "put on there"}
    return Drape(f"{garment}_{number}{'_led' * led}", scene.scene, parameters, to_yaml(scene.model_copy(update=change)))


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
        figures = {name: report["quality"][name] for name in LIMITED}
        if between := [line for line in report["warnings"] if line.endswith(MEETING)]:
            del figures["penetration_mm"]
        return Outcome("settled", "; ".join([reason, *between]), figures)
    if failure:
        x, y = failure["at_cm"]
        return Outcome("failed", f"{reason}; worst in panel {failure['panel']} at ({x:g}, {y:g}) cm")
    return Outcome("refused" if report["status"] == "failed" and is_placed(reason) else "silent", reason)
