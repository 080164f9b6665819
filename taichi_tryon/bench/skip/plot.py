"""Time with each skip over that without it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from taichi_tryon.bench.record import Record
from taichi_tryon.output.files import replace_atomically


def plot_skips(records: Iterable[Record], folder: Path) -> list[Path]:
    """``skip.png``, a bar a case and stage, where any was measured; returns the files written."""
    bars = [
        (f"{record.case}\n{record.quantity.removesuffix('_with_over_without')}", record.value)
        for record in records
        if record.quantity.endswith("with_over_without")
    ]
    if not bars:
        return []
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 0.5 * len(bars) + 1), layout="constrained")
    axes = figure.add_subplot()
    names, values = zip(*reversed(bars), strict=True)
    axes.barh(range(len(names)), values, tick_label=names)
    axes.axvline(1.0, color="black", linestyle=":")
    axes.set(xlabel="time with the skip over time without it")
    axes.tick_params(axis="y", labelsize="small")
    path = folder / "skip.png"
    replace_atomically(path, lambda part: figure.savefig(part, format="png", dpi=110))
    return [path]
