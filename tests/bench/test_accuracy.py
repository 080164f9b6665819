"""The quick values of the fast cases: every limit is met."""

from pathlib import Path

import pytest

from taichi_tryon.bench.suite import SUITES, records_of

FAST = ("body_field", "uniaxial", "sphere")


@pytest.fixture(autouse=True)
def _in_the_project(monkeypatch):
    monkeypatch.chdir(Path(__file__).parents[2])


@pytest.mark.parametrize("case", FAST)
def test_limits_are_met(case):
    records = list(records_of("accuracy", case))
    assert records
    for record in records:
        assert record.passes, record


def test_every_case_says_where_its_reference_comes_from():
    for suite, cases in SUITES.items():
        for case in cases:
            text = Path(f"taichi_tryon/bench/{suite}/{case}.py").read_text().split('"""')[1]
            assert len(text) > 150, case
