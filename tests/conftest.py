"""Taichi is started once for the whole session, in f64 and with a cache of its own: compiling is what costs."""

from __future__ import annotations

import pytest

from taichi_tryon import runtime


@pytest.fixture(scope="session", autouse=True)
def _taichi(tmp_path_factory):
    runtime.start(arch="cpu", precision="f64", threads=2, cache=tmp_path_factory.mktemp("kernels"))
