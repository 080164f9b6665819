"""A strip that folds onto itself, coarse and short: nothing crosses after any step, and what does cross is counted."""

from pathlib import Path

import numpy as np
import pytest

from taichi_tryon.bench.stability import crossings

SHORT = ("mesh.edge_length_mm=20", "drape.duration_s=0.8", "solver.preconditioner=block_jacobi")


@pytest.fixture(autouse=True)
def in_the_project(monkeypatch):
    monkeypatch.chdir(Path(__file__).parents[3])


def test_a_strip_that_folds_onto_itself_does_not_cross():
    worst, touching, steps = crossings.followed("folded_sheet", SHORT)
    assert worst == 0 and touching > 0 and steps >= 48


def test_what_crosses_after_any_step_is_counted(monkeypatch):
    """Two sheets that are put through each other by hand, in the middle of a course, and taken apart again."""
    flat = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    through = np.array([[0.2, 0.2, -1], [0.2, 0.2, 1], [0.9, 0.9, 0]], float)
    away = through + [0, 0, 5]
    faces = np.array([[0, 1, 2], [3, 4, 5]])
    places = iter([away, through, away])

    class Moment:
        """What a watcher sees of a simulation."""

        def __init__(self, other):
            self.stepper = self.setup = self.cloth = self.layers = self.x = self.simulation = self.progress = self
            self.to_numpy, self.triangles, self.count, self.steps = lambda: np.vstack([flat, other]), faces, 4, 3

    def played(name, *overrides, watch):
        last = None
        for other in places:
            last = Moment(other)
            watch(last)
        return last

    monkeypatch.setattr(crossings, "simulate", played)
    assert crossings.followed("any", ()) == (1, 4, 3)
