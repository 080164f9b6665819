"""Patterns to mesh: the shipped ones, and sheets made here."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml

from taichi_tryon.pattern.edge import Edge
from taichi_tryon.pattern.panel import Panel, Pattern
from taichi_tryon.pattern.spec import PatternSpec

FOLDER = Path(__file__).parents[2] / "configs" / "patterns"


@cache
def _load(name: str) -> Pattern:
    text = (FOLDER / f"{name}.yaml").read_text(encoding="utf-8")
    return Pattern.from_spec(PatternSpec.model_validate(yaml.safe_load(text)))


@pytest.fixture(scope="session")
def load():
    """A shipped pattern by name."""
    return _load


@pytest.fixture(scope="session")
def polygon_panel():
    """A panel of straight edges e0, e1 ... between corners (n, 2) [m]."""

    def make(name: str, corners, grain=(0.0, 1.0)) -> Panel:
        corners = np.asarray(corners, dtype=float)
        ends = zip(corners, np.roll(corners, -1, axis=0), strict=True)
        edges = tuple(Edge(f"e{i}", "line", np.stack(pair)) for i, pair in enumerate(ends))
        return Panel(name, edges, np.asarray(grain, dtype=float))

    return make


@pytest.fixture(scope="session")
def turn_round():
    """The same panel with its loop the other way."""

    def turn(panel: Panel) -> Panel:
        return replace(panel, edges=tuple(edge.turned_round() for edge in reversed(panel.edges)))

    return turn
