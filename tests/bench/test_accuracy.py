"""The quick values of every case, as ``bench accuracy --quick`` gives them: every limit is met."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from taichi_tryon.bench.suite import SUITES

PROJECT = Path(__file__).parents[2]
# too long for any quick value; their references are tested in test_references.py
LONG = ("capstan", "lateral_buckling")


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """Kernels of one case serve the next."""
    return tmp_path_factory.mktemp("cache")


@pytest.mark.parametrize("case", [case for case in SUITES["accuracy"] if case not in LONG])
def test_limits_are_met(case, cache, tmp_path):
    # in a process of its own: some cases start Taichi anew
    command = [sys.executable, "-m", "taichi_tryon", "bench", "accuracy", "--quick", "--case", case]
    done = subprocess.run(
        [*command, "--output", str(tmp_path)],
        cwd=PROJECT,
        env={**os.environ, "XDG_CACHE_HOME": str(cache)},
        capture_output=True,
        text=True,
        timeout=900,
    )
    assert done.returncode == 0, done.stderr
    judged = [record for record in json.loads((tmp_path / "accuracy.json").read_text())["records"] if record["limit"]]
    assert judged
    for record in judged:
        assert record["passes"], record


def test_every_case_says_where_its_reference_comes_from():
    for suite, cases in SUITES.items():
        for case in cases:
            text = (PROJECT / f"taichi_tryon/bench/{suite}/{case}.py").read_text().split('"""')[1]
            assert len(text) > 150, case
