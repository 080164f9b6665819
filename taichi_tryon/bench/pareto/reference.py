"""The converged solution that all others are held against: our own laws in double precision, steps so short and
tolerances so tight that they hardly count. It is computed once and kept in a file.

How much they still count is estimated from steps twice as long: those err by four times as much, as TR-BDF2 is of order
two, so a third of the difference is what the shorter ones lack.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.pareto import ours
from taichi_tryon.bench.pareto.ours import Setting
from taichi_tryon.bench.pareto.problem import Problem
from taichi_tryon.bench.pareto.track import Track
from taichi_tryon.output.frames import replace_atomically
from taichi_tryon.scene.resolved import to_yaml

FOLDER = Path("outputs/references")
PER_SECOND = 480
"""Steps of the converged solution."""
PACKAGE = Path(__file__).parents[2]
# what decides where a cloth goes, however it is solved
LAWS = ("body", "cloth", "contact", "holds", "mesh", "sheet", "fabric.py")


@dataclass(frozen=True)
class Reference:
    """The converged track, and how far [m] its positions may be from the exact ones."""

    track: Track
    doubt: float


def converged(per_second: int = PER_SECOND) -> Setting:
    """The setting of a solution in which only the length of the step counts."""
    values = {
        "scheme": "tr_bdf2",
        "step_s": 1 / per_second,
        "newton_tolerance": 1e-5,
        "max_newton_iterations": 30,
        "linear_tolerance": 1e-3,
        "max_linear_iterations": 5000,
        "precision": "f64",
        "error_mm": "null",
    }
    return Setting(f"converged, 1/{per_second} s", tuple(f"solver.{key}={value}" for key, value in values.items()))


def reference(problem: Problem, per_second: int = PER_SECOND) -> Reference:
    """The converged solution of a problem, from its file where the scene and our laws are as they were."""
    path = FOLDER / f"{problem.scene}_{problem.count}_{problem.fabric}_{_key(problem, per_second)}.npz"
    if not path.is_file():
        coarse, fine = (apart(ours.run, problem, converged(rate)) for rate in (per_second // 2, per_second))
        _write(path, Reference(fine, distance(coarse.positions, fine.positions) / 3))
    with np.load(path) as stored:
        values = {field.name: stored[field.name] for field in fields(Track)}
        return Reference(Track(**values), float(stored["doubt"]))


def distance(positions: np.ndarray, others: np.ndarray) -> float:
    """Root of the mean square distance [m] between the vertices (nv, 3) of a regular sheet in two places."""
    return float(np.sqrt(((positions - others) ** 2).sum(axis=1).mean()))


def _key(problem: Problem, per_second: int) -> str:
    """Changes with the scene and with the sources of our laws."""
    text = to_yaml(ours.scene_of(problem, converged(per_second))) + repr(problem)
    sources = sorted(path for law in LAWS for path in (PACKAGE / law, *(PACKAGE / law).rglob("*.py")) if path.is_file())
    found = hashlib.sha256(text.encode())
    for path in sources:
        found.update(path.read_bytes())
    return found.hexdigest()[:12]


def _write(path: Path, found: Reference) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    values = {field.name: getattr(found.track, field.name) for field in fields(Track)}

    def write(part: Path) -> None:
        with part.open("wb") as file:  # by name, savez would add a suffix
            np.savez_compressed(file, **values, doubt=found.doubt)

    replace_atomically(path, write)
