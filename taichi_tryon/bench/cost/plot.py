"""Time a step and iterations against the number of vertices, on logarithmic scales."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from taichi_tryon.bench.record import Record
from taichi_tryon.output.files import replace_atomically

DRAWN = {"wall_time": "time a step [ms]", "linear_iterations": "linear iterations a Newton iteration",
         "memory": "memory [kB a vertex]"}  # fmt: skip


def plot_growth(records: Iterable[Record], folder: Path) -> list[Path]:
    """``growth.png``, where growth was measured; returns the files written."""
    lines: dict[str, list[tuple[float, float]]] = {}
    for record in records:
        if record.case == "growth" and record.quantity in DRAWN:
            lines.setdefault(record.quantity, []).append((float(record.parameters["vertices"]), record.value))
    if not lines:
        return []
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 4), layout="constrained")
    for axes, (quantity, points) in zip(figure.subplots(1, len(lines), squeeze=False)[0], lines.items(), strict=True):
        sizes, values = zip(*sorted(points), strict=True)
        axes.loglog(sizes, values, marker="o", label="measured")
        if quantity == "wall_time":
            axes.loglog(sizes, [values[0] * size / sizes[0] for size in sizes], "k:", label="in proportion")
            axes.legend()
        axes.set(xlabel="vertices", ylabel=DRAWN[quantity])
        axes.grid(True, which="both", alpha=0.3)
    path = folder / "growth.png"
    replace_atomically(path, lambda part: figure.savefig(part, format="png", dpi=110))
    return [path]
