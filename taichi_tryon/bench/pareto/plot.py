"""Errors against time, both on logarithmic scales: left and below is better."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path

from taichi_tryon.bench.pareto.compare import COSTS
from taichi_tryon.bench.record import Record
from taichi_tryon.output.files import replace_atomically

ERRORS = {
    "position_error": "distance to the converged solution [mm]",
    "strain_p99_at_end": "strain, p99 at the end [%]",
    "penetration_worst_frame": "penetration, worst frame [mm]",
}
LEAST = {"position_error": 1e-4, "strain_p99_at_end": 1e-4, "penetration_worst_frame": 1e-3}
"""What is drawn for less: 0 has no logarithm."""

Points = dict[tuple[str, str], dict[str, float]]


def plot_pareto(records: Iterable[Record], folder: Path) -> list[Path]:
    """``CASE_VERTICES_FABRIC.png`` for all that was computed: a point for every setting of every simulator. Returns the
    files written."""
    plots: dict[tuple[str, str, str], Points] = defaultdict(lambda: defaultdict(dict))
    units: dict[str, str] = {}
    for record in records:
        where = record.parameters
        if "setting" in where:
            points = plots[record.case, str(where["vertices"]), str(where["fabric"])]
            points[str(where["simulator"]), str(where["setting"])][record.quantity] = record.value
            if record.quantity in COSTS.values():
                units[record.case] = record.unit
    written = []
    for names, points in plots.items():
        if solved := {key: figures for key, figures in points.items() if figures.keys() >= ERRORS.keys()}:
            path = folder / f"{'_'.join(names)}.png"
            _draw(path, ", ".join((names[0], f"{names[1]} vertices", names[2])), units[names[0]], solved)
            written.append(path)
    return written


def _draw(path: Path, title: str, unit: str, points: Mapping[tuple[str, str], Mapping[str, float]]) -> None:
    from matplotlib import colormaps
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15, 9), layout="constrained")
    figure.suptitle(title)
    simulators = list(dict.fromkeys(simulator for simulator, _ in points))
    for row, (clock, cost) in zip(figure.subplots(len(COSTS), len(ERRORS)), COSTS.items(), strict=True):
        for axes, (error, label) in zip(row, ERRORS.items(), strict=True):
            for k, ((simulator, setting), figures) in enumerate(points.items()):
                axes.loglog(
                    figures[cost], max(figures[error], LEAST[error]), linestyle="", color=colormaps["tab20"](k % 20),
                    marker="os^D"[simulators.index(simulator) % 4], label=f"{simulator}: {setting}",
                )  # fmt: skip
            axes.set(xlabel=f"{clock} time [{unit}]", ylabel=label)
            axes.grid(True, which="both", alpha=0.3)
    figure.legend(*row[0].get_legend_handles_labels(), loc="outside right upper", fontsize="small")
    replace_atomically(path, lambda part: figure.savefig(part, format="png", dpi=110))
