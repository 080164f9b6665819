"""Errors against edge length, both on logarithmic scales: a straight line shows the order of convergence."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

from taichi_tryon.bench.record import Record
from taichi_tryon.output.files import replace_atomically

REFINED = "edge_mm"


def plot_convergence(records: Iterable[Record], folder: Path) -> list[Path]:
    """``CASE_QUANTITY.png`` for every case that was refined; returns the files written."""
    plots: dict[tuple[str, str], dict[str, list[tuple[float, float]]]] = defaultdict(lambda: defaultdict(list))
    varied: dict[tuple[str, str], str] = {}
    for record in records:
        if REFINED in record.parameters and record.error_percent is not None:
            rest = {key: str(value) for key, value in record.parameters.items() if key != REFINED}
            line = plots[record.case, record.quantity][", ".join(rest.values())]
            line.append((float(record.parameters[REFINED]), abs(record.error_percent)))
            varied[record.case, record.quantity] = ", ".join(rest)
    written = []
    for (case, quantity), lines in plots.items():
        if any(len(line) > 1 for line in lines.values()):
            path = folder / f"{case}_{quantity}.png"
            _draw(path, f"{case}: {quantity}", varied[case, quantity], lines)
            written.append(path)
    return written


def _draw(path: Path, title: str, varied: str, lines: dict[str, list[tuple[float, float]]]) -> None:
    """One line each; ``varied`` says what their names are values of."""
    from matplotlib import colormaps
    from matplotlib.figure import Figure
    from matplotlib.ticker import FormatStrFormatter, NullLocator

    figure = Figure(figsize=(9, 5), layout="constrained")
    axes = figure.add_subplot()
    for k, (name, points) in enumerate(lines.items()):
        axes.loglog(
            *zip(*sorted(points), strict=True), marker="osv^D"[k % 5], color=colormaps["tab20"](k % 20), label=name
        )
    edges = sorted({edge for points in lines.values() for edge, _ in points})
    greatest = max(error for points in lines.values() for _, error in points)
    axes.loglog(edges, [greatest * (edge / edges[-1]) ** 2 for edge in edges], "k:", label="order 2")
    axes.set(title=title, xlabel="edge length [mm]", ylabel="error [%]", xticks=edges)
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.grid(True, which="both", alpha=0.3)
    figure.legend(loc="outside right upper", fontsize="small", title=varied)
    replace_atomically(path, lambda part: figure.savefig(part, format="png", dpi=120))
