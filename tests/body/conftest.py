"""The shipped body and poses, and bodies of one ball with exact surfaces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from taichi_tryon.body.model import Body
from taichi_tryon.body.skeleton import Pose
from taichi_tryon.body.spec import BodySpec, PoseSpec

CONFIGS = Path(__file__).resolve().parents[2] / "configs"


def _read(path: str) -> dict:
    return yaml.safe_load((CONFIGS / path).read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def woman_data():
    """Content of the default body's file."""
    return lambda: _read("bodies/adult_woman_9AR.yaml")


@pytest.fixture(scope="session")
def woman(woman_data) -> Body:
    return Body.from_spec(BodySpec.model_validate(woman_data()))


@pytest.fixture(scope="session")
def pose():
    """Reads a shipped pose by its file's name."""
    return lambda name: Pose.from_spec(PoseSpec.model_validate(_read(f"poses/{name}.yaml")))


@pytest.fixture(scope="session")
def turned():
    """Makes a pose from rotations in degrees."""
    return lambda **rotations: Pose.from_spec(PoseSpec(name="turned", rotations_degree=rotations))


@pytest.fixture(scope="session")
def one_ball():
    """Makes a body of one ball with weight 8, whose skin is at sqrt(1/2) of its radii."""

    def make(radii_cm: list[float]) -> Body:
        ball = {"center_cm": [1, 2, 3], "radii_cm": radii_cm, "weight": 8, "groups": ["all"], "bones": {"root": 1}}
        bones = {"root": {"parent": None, "head_cm": [0, 0, 0]}}
        data = {"name": "ball", "bones": bones, "groups": ["all"], "balls": {"ball": ball}}
        return Body.from_spec(BodySpec.model_validate(data))

    return make


@pytest.fixture(scope="session")
def skin_points():
    """Makes ``count`` points (k, 3) near the skin of balls, up to ``depth`` [m] to both sides, with their distances."""
    from taichi_tryon.body.density import closest
    from taichi_tryon.body.surface import surface_mesh

    def make(balls, count: int, depth: float) -> tuple[np.ndarray, np.ndarray]:
        random = np.random.default_rng(7)
        vertices, _ = surface_mesh(balls, 0.02)
        _, feet, normals = closest(balls, vertices[random.integers(0, len(vertices), count)])
        distances = random.uniform(-depth, depth, count)
        return feet + distances[:, None] * normals, distances

    return make
