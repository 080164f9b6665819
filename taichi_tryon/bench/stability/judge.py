"""What a scene on disk meets with: it is accepted, refused by name, or something breaks."""

from __future__ import annotations

import re
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tryon.errors import InputError
from taichi_tryon.scene.load import read_scene
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.setup import Setup, prepare
from taichi_tryon.timing import Stopwatch

COARSE_MM = 40.0
"""Edge length with which accepted scenes are meshed and dressed, where theirs is shorter."""
LONGEST_MESSAGE = 1000
"""Characters."""
_PLACE = re.compile(r"[^\n]+?\.yaml:\d+:\d+: (?P<rest>.+)")
# the key may be one that nobody thought of, with a colon in it
_FIELD = re.compile(r"\S+: .")
# what is wrong with a file before it has fields, or with all of it
_WHOLE_FILE = (
    "not valid YAML", "not UTF-8 text", "the character", "empty", "a second document", "must be a mapping",
    "a key must be", "must not be larger",
)  # fmt: skip


@dataclass(frozen=True)
class Verdict:
    """``outcome``: "accepted", "refused" or "broken"; ``messages`` tell why; ``stage``: "read" or "built"."""

    outcome: str
    stage: str
    messages: tuple[str, ...] = ()

    @property
    def unplaced(self) -> list[str]:
        """Messages that do not name file and line, and field where there is one, in a line of bearable length."""
        return [message for message in self.messages if self.outcome == "refused" and not is_placed(message)]


def is_placed(message: str) -> bool:
    found = _PLACE.fullmatch(message)
    if not found or len(message) > LONGEST_MESSAGE or not message.isprintable():
        return False
    return bool(_FIELD.match(found["rest"])) or found["rest"].startswith(_WHOLE_FILE)


def judge(scene: Path, build: bool) -> Verdict:
    """Read a scene as a run would; where ``build``, mesh and dress it too, with coarse triangles."""
    stage = "read"
    try:
        read = read_scene(scene)
        unsound = list(_not_finite(read.part.model_dump()))
        if build and not unsound:
            stage = "built"
            with read.naming_places():
                unsound = list(_unsound(prepare(_coarse(read.part), Stopwatch())))
    except InputError as error:
        return Verdict("refused", stage, error.faults)
    except Exception:
        return Verdict("broken", stage, (traceback.format_exc(limit=-4),))
    return Verdict("broken" if unsound else "accepted", stage, tuple(unsound))


def _coarse(scene: SceneSpec) -> SceneSpec:
    mesh = scene.mesh.model_copy(update={"edge_length_mm": max(scene.mesh.edge_length_mm, COARSE_MM)})
    return scene.model_copy(update={"mesh": mesh}) if any(g.pattern for g in scene.garments) else scene


def _not_finite(value: Any, path: str = "") -> list[str]:
    """Numbers of a scene that are none; only radii may be infinite."""
    if isinstance(value, dict):
        return [found for key, part in value.items() for found in _not_finite(part, f"{path}.{key}")]
    if isinstance(value, list):
        return [found for index, part in enumerate(value) for found in _not_finite(part, f"{path}.{index}")]
    wrong = isinstance(value, float) and not np.isfinite(value) and not ("radii_cm" in path and value > 0)
    return [f"{path} = {value} was accepted"] if wrong else []


def _unsound(setup: Setup) -> list[str]:
    """What a simulation cannot start from."""
    cloth = setup.cloth
    checks = {
        "positions that are not finite": np.isfinite(setup.positions).all() and np.isfinite(setup.velocities).all(),
        "triangles without an area": np.isfinite(cloth.areas).all() and (cloth.areas > 0).all(),
        "vertices without a mass": np.isfinite(cloth.masses).all() and (cloth.masses > 0).all(),
        "transforms that are not finite": np.isfinite(setup.motion.transforms(setup.motion.end_time)).all(),
    }
    return [f"{what} were accepted" for what, sound in checks.items() if not sound]
