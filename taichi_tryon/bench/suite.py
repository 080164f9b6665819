"""Running a suite: its cases in turn, ``SUITE.json``, a table, plots."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from taichi_tryon import runtime
from taichi_tryon.bench.cost.plot import plot_growth
from taichi_tryon.bench.pareto.plot import plot_pareto
from taichi_tryon.bench.plots import plot_convergence
from taichi_tryon.bench.record import Record
from taichi_tryon.bench.skip.plot import plot_skips
from taichi_tryon.bench.stability.plot import plot_grid
from taichi_tryon.errors import InputError, RunError, TryonError
from taichi_tryon.output.files import replace_atomically
from taichi_tryon.output.report import versions

SUITES = {
    "accuracy": (
        "body_field",
        "uniaxial",
        "picture_frame",
        "shear_cycle",
        "hanging_strip",
        "sphere",
        "incline",
        "layers_incline",
        "tube",
        "waistband",
        "capstan",
        "flight",
        "swing",
        "fold",
        "lateral_buckling",
        "cantilever",
        "cusick",
        "precision",
    ),
    "pareto": ("cheapest", "cantilever", "hang", "sphere", "sphere_layers", "shirt"),
    "skip": (
        "far_samples",
        "far_balls",
        "still_body",
        "no_body",
        "constant_matrices",
        "layers",
        "friction",
        "fabric_friction",
        "output",
        "kernels",
    ),
    "cost": ("stages", "bandwidth", "linear", "growth", "balls", "layers"),
    "stability": ("grid", "energy", "same_bits", "bad_input", "kills", "memory", "crossings", "poses"),
}
"""The cases of each suite, simplest first; each is a module with ``records(quick)``, in a suite with PEERS with
``records(quick, peers)``."""
PEERS = ("pareto",)
PLOTS = {"accuracy": plot_convergence, "pareto": plot_pareto, "cost": plot_growth, "skip": plot_skips,
         "stability": plot_grid}  # fmt: skip
"""What draws a suite's records, where they are drawn."""


@dataclass(frozen=True)
class Finished:
    """What a suite found, and which cases could not be run, with the reason."""

    records: list[Record]
    failed: dict[str, str]

    @property
    def exit_code(self) -> int:
        """0 where every case ran, whatever it found."""
        return 3 if self.failed else 0


def run_suite(
    suite: str,
    quick: bool,
    output: Path,
    cases: Iterable[str] = (),
    say: Callable[[str], None] = lambda line: None,
    peers: bool = False,
) -> Finished:
    """Run a suite, or only some of its ``cases``, and write its files into ``output``; ``say`` gets a line a record.

    peers: what a user could pick instead is run too. Raises InputError where there is no such suite or case, its peers
    are not installed, or the validation scenes are not here.
    """
    names = _chosen(suite, tuple(cases))
    if peers and suite not in PEERS:
        raise InputError(f"--peers: suite {suite} has none; suites with peers: {', '.join(PEERS)}")
    options = {"peers": True} if peers else {}
    records: list[Record] = []
    failed: dict[str, str] = {}
    for name in names:
        device = runtime.start("cpu", "f64")
        try:
            for record in _module(suite, name).records(quick, **options):
                if not np.isfinite(record.value):
                    raise RunError(f"{record.quantity} is {record.value}")
                records.append(record)
                say(_line(record))
        except InputError:
            raise
        except (TryonError, RuntimeError) as fault:  # Taichi's own faults are RuntimeErrors
            failed[name] = str(fault)
            say(f"{name}: {fault}")
    output.mkdir(parents=True, exist_ok=True)
    found = {"suite": suite, "versions": versions(), "device": vars(device), "records": [asdict(r) for r in records]}
    text = json.dumps({**found, "failed": failed}, indent=2, allow_nan=False) + "\n"
    replace_atomically(output / f"{suite}.json", lambda path: path.write_text(text))
    if suite in PLOTS:
        PLOTS[suite](records, output)
    return Finished(records, failed)


def print_table(finished: Finished, console: Console) -> None:
    """All records, missed limits marked, and the cases that did not run."""
    table = Table(box=None, pad_edge=False)
    for title, side in (("case", "left"), ("", "left"), ("quantity", "left"), ("value", "right"), ("exact", "right"),
                        ("error", "right"), ("limit", "right"), ("", "left")):  # fmt: skip
        table.add_column(title, justify=side)
    for r in finished.records:
        error = "" if r.error_percent is None else f"{r.error_percent:+.3g} %"
        reference = "" if r.reference is None else f"{r.reference:.6g}"
        unit = "" if r.unit == "1" else f" {r.unit}"
        value = f"{r.value:.6g}{unit}"
        table.add_row(r.case, _parameters(r), r.quantity, value, reference, error, _limit(r), _verdict(r))
    console.print(table)
    for name, reason in finished.failed.items():
        console.print(f"{name}: did not run: {reason}", markup=False)
    judged = [r for r in finished.records if r.limit is not None]
    console.print(f"{sum(r.passes for r in judged)} of {len(judged)} limits met")


def _chosen(suite: str, cases: tuple[str, ...]) -> tuple[str, ...]:
    if suite not in SUITES:
        raise InputError(f"no suite {suite}; suites: {', '.join(SUITES)}")
    for case in cases:
        if case not in SUITES[suite]:
            raise InputError(f"--case {case}: suite {suite} has no such case; cases: {', '.join(SUITES[suite])}")
    return cases or SUITES[suite]


def _module(suite: str, case: str):
    return import_module(f"taichi_tryon.bench.{suite}.{case}")


def _parameters(record: Record) -> str:
    return ", ".join(f"{key} {value}" for key, value in record.parameters.items())


def _limit(record: Record) -> str:
    if record.limit is None:
        return ""
    if record.error_percent is not None:
        return f"{record.limit:g} %"
    return f">= {record.limit:g}" if record.reference is None else f"{record.limit:g} {record.unit}"


def _verdict(record: Record) -> str:
    return "" if record.limit is None else "met" if record.passes else "[bold red]MISSED[/]"


def _line(record: Record) -> str:
    judged = "" if record.limit is None else "met" if record.passes else "MISSED"
    error = "" if record.error_percent is None else f" ({record.error_percent:+.3g} %)"
    return f"{record.case} {_parameters(record)}: {record.quantity} {record.value:.6g}{error} {judged}".rstrip()
