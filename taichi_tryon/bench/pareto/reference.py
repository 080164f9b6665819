"""The converged solution that all others are held against: our own laws in double precision, steps so short and
tolerances so tight that they hardly count. It is computed once and kept in a file.

How much the steps still count is seen from steps twice as long; the exact solution is nearer than that, as the error
falls with the step.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.pareto import ours
from taichi_tryon.bench.pareto.ours import Setting
from taichi_tryon.bench.pareto.problem import Problem
from taichi_tryon.bench.pareto.track import Track
from taichi_tryon.output.files import replace_atomically
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.scene.resolved import to_yaml

FOLDER = Path("outputs/references")
PER_SECOND, QUICK_PER_SECOND = 480, 120
"""Steps of the converged solution; where there is little time, of one that is nearly so."""
PACKAGE = Path(__file__).parents[2]
# what decides where a cloth goes, however it is solved: always, where something is touched, where garments are dressed
CLOTH, TOUCH, DRESS = ("cloth", "fabric.py", "holds", "mesh", "sheet"), ("body", "contact"), ("dressing", "pattern")


@dataclass(frozen=True)
class Reference:
    """The converged track, and how far [m] from it steps, or tolerances, twice as large lead."""

    track: Track
    doubt: float


def converged(per_second: int) -> Setting:
    """The setting of a fall in which only the length of the step counts."""
    values = {
        "scheme": "tr_bdf2",
        "step_s": 1 / per_second,
        "newton_tolerance": 1e-4,
        "max_newton_iterations": 30,
        "linear_tolerance": 1e-2,
        "max_linear_iterations": 5000,
        "precision": "f64",
        "error_mm": "null",
    }
    return Setting(f"converged, 1/{per_second} s", tuple(f"solver.{key}={value}" for key, value in values.items()))


def falling(problem: Problem, per_second: int = PER_SECOND) -> Reference:
    """The converged solution of a fall."""
    problem = problem.to_compare

    def find() -> Reference:
        coarse, fine = (apart(ours.run, problem, converged(rate)) for rate in (per_second // 2, per_second))
        return Reference(fine, distance(coarse.positions, fine.positions))

    name = f"{problem.scene}_{problem.count}_{problem.fabric}"
    return kept(name, ours.scene_of(problem, converged(per_second)), find)


def kept(name: str, scene: SceneSpec, find: Callable[[], Reference]) -> Reference:
    """What ``find`` gives, from its file where the scene and our laws are as they were when it was written."""
    path = FOLDER / f"{name}_{_key(scene)}.npz"
    if not path.is_file():
        _write(path, find())
    with np.load(path) as stored:
        values = {field.name: stored[field.name] for field in fields(Track) if field.name in stored}
        return Reference(Track(**values), float(stored["doubt"]))


def distance(positions: np.ndarray, others: np.ndarray) -> float:
    """Root of the mean square distance [m] between vertices (nv, 3) in two places."""
    return float(np.sqrt(((positions - others) ** 2).sum(axis=1).mean()))


def _key(scene: SceneSpec) -> str:
    """Changes with the scene and with the sources of those laws that act in it."""
    laws = CLOTH + TOUCH * (scene.body is not None or scene.contact.layers is not None) + DRESS * bool(scene.garments)
    found = hashlib.sha256(to_yaml(scene).encode())
    for path in sorted(path for law in laws for path in (PACKAGE / law, *(PACKAGE / law).rglob("*.py"))):
        if path.is_file():
            found.update(path.read_bytes())
    return found.hexdigest()[:12]


def _write(path: Path, found: Reference) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    values = {field.name: value for field in fields(Track) if (value := getattr(found.track, field.name)) is not None}
    replace_atomically(path, lambda part: np.savez_compressed(part, **values, doubt=found.doubt))
