"""Records, and what a suite writes and says of them."""

import io
import json

import pytest
from rich.console import Console

from taichi_tryon.bench import suite
from taichi_tryon.bench.plots import plot_convergence
from taichi_tryon.bench.record import absolute, at_least, relative, told
from taichi_tryon.errors import InputError, RunError


def refined(edge, error):
    return relative("strip", {"mesh": "regular", "edge_mm": edge}, "rigidity", "N m", 1 + error, 1.0, 3.0, 0.5)


def test_limits_are_judged():
    assert refined(5, 0.029).passes and not refined(5, -0.031).passes
    assert refined(5, -0.031).error_percent == pytest.approx(-3.1)
    assert absolute("gap", {}, "error", "mm", 0.09, 0.0, 0.1, 0).passes
    assert not absolute("gap", {}, "error", "mm", -0.11, 0.0, 0.1, 0).passes
    assert at_least("strip", {}, "order", "1", 1.9, 1.8, 0).passes
    assert not at_least("strip", {}, "order", "1", 1.7, 1.8, 0).passes
    assert relative("strip", {}, "force", "N", 2.0, 1.0, None, 0).passes
    folds = told("disk", {}, "nodes", "1", 8, 0)
    assert folds.passes and folds.limit is None and folds.reference is None


def _suite(monkeypatch, cases):
    """Make ``cases``, functions of ``quick``, the suite "accuracy"; Taichi stays as it is."""
    monkeypatch.setattr(suite, "SUITES", {"accuracy": tuple(cases)})
    monkeypatch.setattr(suite, "_module", lambda name, case: type(case, (), {"records": staticmethod(cases[case])}))
    device = type("Device", (), {})()
    device.arch, device.precision, device.threads = "cpu", "f64", 2
    monkeypatch.setattr(suite.runtime, "start", lambda *options: device)


def test_a_suite_writes_its_records_and_says_what_missed(monkeypatch, tmp_path):
    def broken(quick):
        yield refined(5, 0.01)
        raise RunError("no step can be done")

    _suite(monkeypatch, {"strip": lambda quick: iter([refined(5, 0.02), refined(2.5, 0.05)]), "broken": broken})
    lines = []
    done = suite.run_suite("accuracy", True, tmp_path / "out", say=lines.append)
    assert done.exit_code == 3 and done.failed == {"broken": "no step can be done"} and len(done.records) == 3
    written = json.loads((tmp_path / "out" / "accuracy.json").read_text())
    assert set(written) == {"suite", "versions", "device", "records", "failed"}
    assert set(written["records"][1]) == {"case", "parameters", "quantity", "unit", "value", "reference",
                                          "error_percent", "limit", "passes", "wall_s"}  # fmt: skip
    assert [record["passes"] for record in written["records"]] == [True, False, True]
    assert lines[1].endswith("(+5 %) MISSED") and lines[-1] == "broken: no step can be done"
    text = io.StringIO()
    suite.print_table(done, Console(file=text, width=160))
    assert "2 of 3 limits met" in text.getvalue() and "MISSED" in text.getvalue()
    assert (tmp_path / "out" / "strip_rigidity.png").stat().st_size > 5000


def test_a_figure_that_is_no_number_fails_its_case_alone(monkeypatch, tmp_path):
    _suite(monkeypatch, {"strip": lambda quick: iter([refined(5, float("nan"))]), "other": lambda quick: iter([])})
    done = suite.run_suite("accuracy", True, tmp_path)
    assert done.failed == {"strip": "rigidity is nan"} and not done.records
    assert json.loads((tmp_path / "accuracy.json").read_text())["failed"] == done.failed


def test_missed_limits_are_no_failure(monkeypatch, tmp_path):
    _suite(monkeypatch, {"strip": lambda quick: iter([refined(5, 0.5)])})
    assert suite.run_suite("accuracy", True, tmp_path).exit_code == 0


def test_what_was_not_refined_is_not_drawn(tmp_path):
    assert plot_convergence([refined(5, 0.1)], tmp_path) == []


def test_unknown_names_are_told(tmp_path):
    with pytest.raises(InputError, match="no suite speed; suites: accuracy"):
        suite.run_suite("speed", True, tmp_path)
    with pytest.raises(InputError, match="--case loop: suite accuracy has no such case; cases: body_field, uniaxial"):
        suite.run_suite("accuracy", True, tmp_path, ["loop"])
    with pytest.raises(InputError, match="--peers: suite accuracy has none; suites with peers: pareto"):
        suite.run_suite("accuracy", True, tmp_path, peers=True)
    assert not list(tmp_path.iterdir())
