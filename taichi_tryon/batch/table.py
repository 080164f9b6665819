"""The table of a batch: ``batch.json`` with every report, ``batch.csv`` with a row of figures for each drape."""

from __future__ import annotations

import csv
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from taichi_tryon.batch.drape import Drape
from taichi_tryon.output.files import replace_atomically

SCHEMA = 1
# what a row takes from a report, besides status and reason
FIGURES = ("failure", "mesh", "run", "timing_s", "quality")


@dataclass(frozen=True)
class Row:
    """A drape and its report; a drape that crashed, or has not been run yet, has only status and reason."""

    drape: Drape
    report: Mapping[str, Any]

    @property
    def status(self) -> str:
        return self.report["status"]


def counts(rows: Sequence[Row]) -> dict[str, int]:
    """How many drapes have each status."""
    return dict(Counter(row.status for row in rows))


def write(folder: Path, rows: Sequence[Row]) -> list[Path]:
    """Write both files, each whole or not at all. Raises RunError where the disk refuses."""
    drapes = [
        {"drape": r.drape.name, "scene": r.drape.scene, "parameters": r.drape.parameters, "report": r.report}
        for r in rows
    ]
    whole = json.dumps({"schema": SCHEMA, "status": counts(rows), "drapes": drapes}, indent=2, allow_nan=False) + "\n"
    lines = [dict(_line(row)) for row in rows]
    # a report that lacks some must not put them last
    names = [*dict.fromkeys(name for line in sorted(lines, key=len, reverse=True) for name in line)]

    def write_lines(path: Path) -> None:
        with path.open("w", newline="", encoding="utf-8") as file:
            table = csv.DictWriter(file, names, lineterminator="\n")
            table.writeheader()
            table.writerows(lines)

    files = {folder / "batch.csv": write_lines, folder / "batch.json": lambda path: path.write_text(whole)}
    for path, writer in files.items():
        replace_atomically(path, writer)
    return list(files)


def _line(row: Row) -> Iterator[tuple[str, Any]]:
    yield from (("drape", row.drape.name), ("scene", row.drape.scene))
    yield from ((key, _cell(value)) for key, value in row.drape.parameters.items())
    yield from (("status", row.status), ("reason", row.report["reason"]))
    for section in FIGURES:
        yield from _figures(section, row.report.get(section) or {})


def _figures(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """The figures below ``name`` as ``name.key.key``."""
    if isinstance(value, Mapping):
        for key, part in value.items():
            yield from _figures(f"{name}.{key}", part)
    else:
        yield name, _cell(value)


def _cell(value: Any) -> Any:
    return json.dumps(value) if isinstance(value, (list, Mapping)) else value
