"""Small patterns to change and break."""

from __future__ import annotations

import copy

import pytest


@pytest.fixture
def tube() -> dict:
    """Two 20 x 30 cm rectangles sewn along both sides, as YAML would give them."""
    panel = {
        "points_cm": {"A": [0, 0], "B": [20, 0], "C": [20, 30], "D": [0, 30]},
        "edges": [
            {"name": "bottom", "line": ["A", "B"]},
            {"name": "right", "line": ["B", "C"]},
            {"name": "top", "line": ["C", "D"]},
            {"name": "left", "line": ["D", "A"]},
        ],
    }
    return {
        "pattern": "tube",
        "panels": {"front": panel, "back": copy.deepcopy(panel)},
        "seams": [
            {"name": "side_l", "a": [["front", "right"]], "b": [["back", "left"]]},
            {"name": "side_r", "a": [["front", "left"]], "b": [["back", "right"]]},
        ],
    }
