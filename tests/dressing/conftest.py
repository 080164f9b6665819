from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
import yaml

from taichi_tryon.body.model import Body
from taichi_tryon.body.skeleton import Pose
from taichi_tryon.body.spec import BodySpec, PoseSpec
from taichi_tryon.dressing.place import dress
from taichi_tryon.dressing.spec import DressingSpec
from taichi_tryon.mesh.garment import build
from taichi_tryon.pattern.panel import Pattern
from taichi_tryon.pattern.spec import PatternSpec

CONFIGS = Path(__file__).parents[2] / "configs"
EDGE_LENGTH = 0.025


def read(part: str, name: str) -> dict:
    return yaml.safe_load((CONFIGS / part / f"{name}.yaml").read_text())


@cache
def shipped(name: str):
    """Pattern, mesh and dressing of a shipped garment."""
    pattern = Pattern.from_spec(PatternSpec.model_validate(read("patterns", name)))
    return pattern, build(pattern, EDGE_LENGTH, name), DressingSpec.model_validate(read("dressings", name))


@cache
def shipped_body() -> Body:
    return Body.from_spec(BodySpec.model_validate(read("bodies", "adult_woman_9AR")))


@cache
def transforms_of(pose: str):
    return shipped_body().skeleton.transforms(Pose.from_spec(PoseSpec.model_validate(read("poses", pose))))


@cache
def start(name: str, pose: str):
    return dress(*shipped(name), shipped_body(), transforms_of(pose))


@pytest.fixture
def garment():
    """Function: name -> (pattern, mesh, dressing) of a shipped garment."""
    return shipped


@pytest.fixture
def body() -> Body:
    return shipped_body()


@pytest.fixture
def transforms():
    """Function: name of a shipped pose -> the bones' transforms."""
    return transforms_of


@pytest.fixture
def dressed():
    """Function: name of a garment and of a pose -> Dressed."""
    return start
