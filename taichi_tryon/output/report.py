"""``report.json``: what was computed, what it cost, and how good it is."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from platform import python_version

import numpy as np

from taichi_tryon import __version__
from taichi_tryon.output.files import replace_atomically
from taichi_tryon.output.maps import weighted_percentiles
from taichi_tryon.output.observation import Inspection

SCHEMA = 1


def quality(seen: Inspection) -> dict:
    """The quality fields of a garment, or of all; see the interface's description of report.json."""
    strain = {}
    for key in ("warp", "weft"):
        values = np.abs(seen.strains[f"strain_{key}_percent"])
        strain[key] = dict(zip(("p50", "p99", "max"), _percentiles(values, (50, 99, 100)), strict=True))
    shear = np.abs(seen.strains["shear_degree"])
    gap = None
    if seen.gaps is not None:
        gap = dict(zip(("p50", "p95", "max"), _percentiles(1000 * seen.gaps, (50, 95, 100)), strict=True))
    touching = seen.contact_pressures > 0
    pressure = weighted_percentiles(
        seen.contact_pressures[touching] / 1000, seen.contact_areas[touching], (50, 95, 100)
    )
    on_skin = seen.skin_pressures > 0
    worn = weighted_percentiles(seen.skin_pressures[on_skin] / 1000, seen.skin_areas[on_skin], (50, 95, 100))
    friction = seen.contact_forces.sum(axis=0) - seen.normal_force
    return {
        "residual_relative": _round(np.linalg.norm(seen.net_forces) / (np.linalg.norm(seen.weights) or 1.0)),
        "speed_max_mm_s": _round(1000 * np.linalg.norm(seen.velocities, axis=1).max()),
        "penetration_mm": _round(1000 * seen.depths.max()),
        "penetrating_samples_percent": _round(100 * seen.inside.sum() / seen.samples.sum()),
        "strain_percent": strain,
        "shear_degree": dict(zip(("p99", "max"), _percentiles(shear, (99, 100)), strict=True)),
        "gap_mm": gap,
        "contact_area_percent": _round(100 * seen.contact_areas[touching].sum() / (seen.contact_areas.sum() or 1.0)),
        "pressure_kPa": dict(zip(("p50", "p95", "max"), map(_round, pressure), strict=True)),
        "body_pressure_kPa": dict(zip(("p50", "p95", "max"), map(_round, worn), strict=True)),
        "contact_force_N": {"normal": [*map(_round, seen.normal_force)], "friction": [*map(_round, friction)]},
        "energy_J": {name: _round(value) for name, value in seen.energies.items()},
        "crossing_triangle_pairs": int(len(seen.crossings)),
    }


def versions() -> dict[str, str]:
    """Versions of what computed the result."""
    others = {name: metadata.version(name) for name in ("taichi", "numpy")}
    return {"taichi_tryon": __version__, **others, "python": python_version()}


def mesh_figures(edge_lengths: np.ndarray, vertices: int, triangles: int, min_angle_deg: float) -> dict:
    """Sizes of the mesh; edge_lengths (ne,) [m] at rest."""
    mm = 1000 * edge_lengths
    return {
        "vertices": vertices,
        "triangles": triangles,
        "edge_length_mm": {"mean": _round(mm.mean()), "min": _round(mm.min()), "max": _round(mm.max())},
        "min_angle_deg": _round(min_angle_deg),
    }


def write(folder: Path, report: Mapping) -> None:
    """Write ``report.json``, whole or not at all. A number that is not finite is written as null, and a warning."""
    faults = []
    report = _finite(report, "", faults)
    if faults:
        report["warnings"] = [*report.get("warnings", []), *(f"{place}: not a finite number" for place in faults)]
    text = json.dumps({"schema": SCHEMA, **report}, indent=2, allow_nan=False) + "\n"
    replace_atomically(folder / "report.json", lambda path: path.write_text(text))


def _finite(value, place: str, faults: list[str]):
    """A part of a report without the numbers that are not finite, whose places are added to ``faults``."""
    if isinstance(value, Mapping):
        return {key: _finite(part, f"{place}.{key}".lstrip("."), faults) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(part, f"{place}.{index}", faults) for index, part in enumerate(value)]
    if isinstance(value, float) and not math.isfinite(value):
        faults.append(place)
        return None
    return value


def _percentiles(values: np.ndarray, percents: tuple[float, ...]) -> list[float]:
    return [_round(value) for value in np.percentile(values, percents)]


def _round(value: float) -> float:
    """Six digits: no reader wants more, and none is lost."""
    return float(f"{float(value):.6g}")
