"""The grid: every change fits its scene, what goes wrong is seen, starts are what they are called."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tryon.bench.record import at_least
from taichi_tryon.bench.stability import cell as cells_module
from taichi_tryon.bench.stability import starts
from taichi_tryon.bench.stability.cell import BOUND, run_cell
from taichi_tryon.bench.stability.grid import tried
from taichi_tryon.bench.stability.plot import COLORS, plot_grid, table
from taichi_tryon.bench.stability.stresses import HANG, SCENES, Cell, Change, cells
from taichi_tryon.errors import NoStep
from taichi_tryon.scene.load import load_scene

ROOT = Path(__file__).parents[3]


@pytest.fixture(autouse=True)
def _in_the_projects_folder(monkeypatch):
    monkeypatch.chdir(ROOT)


def test_every_cell_is_a_sound_scene_of_its_own():
    every = list(cells(quick=False))
    names = [(cell.scene, cell.stress, cell.level) for cell in every]
    assert len(set(names)) == len(names)
    assert {cell.scene for cell in every} == set(SCENES)
    plains = {name: load_scene(f"configs/{path}", settings) for name, (path, settings) in SCENES.items()}
    for cell in every:
        path, settings = SCENES[cell.scene]
        plain = plains[cell.scene]
        changed = load_scene(
            f"configs/{path}", (*settings, *cells_module._scaled(plain, cell.change), *cell.change.settings)
        )
        assert cell.change.start or cell.stress == "none" or changed != plain


def test_the_quick_ones_are_some_of_them():
    every, few = list(cells(quick=False)), list(cells(quick=True))
    names = [(cell.scene, cell.stress, cell.level) for cell in every]
    assert 0 < len(few) < len(every)
    assert all((cell.scene, cell.stress, cell.level) in names for cell in few)


def test_a_factor_is_one_of_the_fabrics_own_figure():
    plain = load_scene(f"configs/{SCENES[HANG][0]}")
    (setting,) = cells_module._scaled(plain, Change(fabric={"weight_gf_per_cm2": 0.01}))
    key, _, value = setting.partition("=")
    assert key == "garments.0.fabric.weight_gf_per_cm2" and float(value) == pytest.approx(0.00029)


def test_a_cell_that_holds():
    outcome = tried(next(cells(quick=True)))
    assert outcome.kind == "held" and outcome.steps == 60 and 0 < outcome.energy_share < 1


class Failing:
    """A simulation whose last step fails, moves to nowhere, or gains energy."""

    def __init__(self, fault):
        self.fault, self.finished, self.settled = fault, False, True
        self.progress = SimpleNamespace(phase="drape", steps=3, rejected=2, time=0.5)
        self.scene = SimpleNamespace(settle=SimpleNamespace(max_steps=0, residual=0.01))
        self.x = np.zeros((2, 3))

    def state(self):
        return {"positions": self.x.copy(), "velocities": self.x.copy()}

    def rounding(self):
        return 0.001

    def advance(self):
        self.finished = True
        if self.fault == "not finite":
            self.x[0] = np.nan
        if self.fault == "state lost":
            self.x += 1
        if self.fault in ("no step", "state lost"):
            raise NoStep("none is short enough")
        if self.fault == "unsettled":
            self.settled, self.scene.settle.max_steps = False, 10
            self.progress.residual = 0.5


class Given:
    """A ledger in which the cloth ends with a share of what it was given."""

    def __init__(self, simulation):
        self.share, self.end = 0.0, 2 * BOUND if simulation.fault == "energy grew" else 1.0

    def count(self, moved):
        self.share = self.end


@pytest.mark.parametrize("fault", ["held", "no step", "state lost", "not finite", "energy grew", "unsettled"])
def test_what_goes_wrong_is_seen(monkeypatch, fault):
    monkeypatch.setattr(cells_module, "Ledger", Given)
    outcome = cells_module._judged(Failing(fault), may_refuse=False)
    assert outcome.kind == fault and outcome.held == (fault == "held")
    assert (outcome.steps, outcome.rejected) == (3, 2)
    may = cells_module._judged(Failing(fault), may_refuse=True)
    assert may == (replace(outcome, kind="refused") if fault in ("no step", "unsettled") else outcome)


@pytest.mark.parametrize(("motion", "contact", "share"), [(0.4, 0.0, 0.5), (0.4, 5.0, 0.5), (1.2, 0.1, 1.5)])
def test_what_contact_with_the_body_stores_is_not_the_cloths(monkeypatch, motion, contact, share):
    """It falls by 0.8 J."""
    found = iter([(0.0, 1.0), (motion + contact, 0.2)])
    monkeypatch.setattr(cells_module, "held_and_height", lambda stepper: next(found))
    monkeypatch.setattr(cells_module, "_led", lambda setup: (0.0, 0.0))
    stored = iter([0.0, contact])
    stepper = SimpleNamespace(balance=lambda: 0.0, contact=SimpleNamespace(energy=lambda: next(stored)))
    setup = SimpleNamespace(cloth=SimpleNamespace(masses=np.ones(3)), scene=SimpleNamespace(gravity_m_s2=[0, -9.8, 0]))
    ledger = cells_module.Ledger(SimpleNamespace(stepper=stepper, setup=setup))
    ledger.count(moved=True)
    assert ledger.share == pytest.approx(share)


def test_where_the_digits_end_it_is_said_and_newton_gets_so_far():
    """Ten metres up, positions in single precision are 1 um apart."""
    high = ("solver.precision=f32", "garments.0.sheet.origin_cm=[0, 1000, 0]", "settle.max_steps=40")
    outcome = tried(Cell(HANG, "precision", "high up", Change(high), quick=True))
    residual, rounding = (float(number) for number in re.findall(r"\d\.\d+e-\d+", outcome.reason))
    assert outcome.kind == "refused" and "rounding" in outcome.reason
    assert 0.01 < rounding < 1 and residual < 1.5 * rounding


def test_input_at_fault_is_no_held_cell():
    outcome = run_cell(HANG, Change(("mesh.edge_length_mm=0",)))
    assert outcome.kind == "input refused" and "edge_length_mm" in outcome.reason and not outcome.held


@pytest.fixture
def flat():
    x, y = np.meshgrid(np.arange(11.0), np.arange(3.0))
    return np.column_stack([x.ravel(), y.ravel()])


def test_starts(flat):
    assert np.ptp(starts.squashed(flat, 1.0, 0.01)[:, 0]) == pytest.approx(0.1)
    assert np.ptp(starts.stretched(flat, 1.0, 20.0)[:, 1]) == pytest.approx(40)
    narrow = np.unique(starts.crushed(flat, 1.0, 1.0)[:, 0].round(9))
    assert np.degrees(np.arctan(narrow[1] - narrow[0])) == pytest.approx(1)
    assert starts.inverted(flat, 1.0)[:11, 0].tolist() == [0, 1, 2, 3, 6, 5, 4, 7, 8, 9, 10]
    folded = starts.folded(flat, 1.0, 0.5)
    assert folded[:11, 0].tolist() == [10, 9, 8, 7, 6, 5, 6, 7, 8, 9, 10]
    assert folded[:11, 2].tolist() == [0, 0, 0, 0, 0, 0, 0.5, 0.5, 0.5, 0.5, 0.5]


def test_a_heat_map_of_what_was_tried(tmp_path):
    found = [("a", "step", "held", 1), ("a", "jump", "refused", 1), ("b", "step", "no step", 0)]
    tried = [
        at_least("grid", {"scene": scene, "stress": stress, "level": "", "outcome": kind}, "held", "1", held, 1, 0.0)
        for scene, stress, kind, held in found
    ]
    names = [[list(COLORS)[index] for index in row] for row in table(tried)]
    assert names == [["held", "refused with a reason"], ["did not hold", "not tried"]]
    assert plot_grid(tried, tmp_path)[0].stat().st_size > 0
    assert plot_grid([], tmp_path) == []
