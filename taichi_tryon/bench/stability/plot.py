"""The grid as a heat map: which scene held under which stress."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from taichi_tryon.bench.record import Record
from taichi_tryon.output.files import replace_atomically

COLORS = {"not tried": "#e4e4e4", "did not hold": "#c0392b", "refused with a reason": "#e9b44c", "held": "#4f9d69"}


def plot_grid(records: Iterable[Record], folder: Path) -> list[Path]:
    """``grid.png``, a row a scene and a column a stress, where the grid was tried; returns the files written."""
    tried = [record for record in records if record.case == "grid" and record.quantity == "held"]
    if not tried:
        return []
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    columns, rows = stresses_and_scenes(tried)
    figure = Figure(figsize=(3 + 0.3 * len(columns), 2.2 + 0.35 * len(rows)), layout="constrained")
    axes = figure.add_subplot()
    axes.pcolormesh(
        table(tried), cmap=ListedColormap(list(COLORS.values())), vmin=-0.5, vmax=len(COLORS) - 0.5, edgecolors="white"
    )
    axes.set_xticks(np.arange(len(columns)) + 0.5, columns, rotation=90)
    axes.set_yticks(np.arange(len(rows)) + 0.5, rows)
    axes.invert_yaxis()
    axes.tick_params(length=0, labelsize="small")
    patches = [Patch(color=color, label=name) for name, color in COLORS.items()]
    figure.legend(handles=patches, loc="outside upper center", ncols=len(patches), fontsize="small")
    path = folder / "grid.png"
    replace_atomically(path, lambda part: figure.savefig(part, format="png", dpi=110))
    return [path]


def stresses_and_scenes(tried: Iterable[Record]) -> tuple[list[str], list[str]]:
    """Names of columns and rows, in the order in which they were tried."""
    columns = dict.fromkeys(f"{r.parameters['stress']} {r.parameters['level']}".strip() for r in tried)
    return list(columns), list(dict.fromkeys(r.parameters["scene"] for r in tried))


def table(tried: Iterable[Record]) -> np.ndarray:
    """(scenes, stresses) index into COLORS."""
    columns, rows = stresses_and_scenes(tried)
    result = np.zeros((len(rows), len(columns)), int)
    for r in tried:
        column = f"{r.parameters['stress']} {r.parameters['level']}".strip()
        refused = r.parameters["outcome"] == "refused"
        result[rows.index(r.parameters["scene"]), columns.index(column)] = 1 + (2 - refused) * r.passes
    return result
