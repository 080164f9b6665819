"""What both ``check`` and the report tell of a setup."""

from __future__ import annotations

import numpy as np

from taichi_tryon.dressing.place import disk_frame
from taichi_tryon.setup import Garment, Setup
from taichi_tryon.units import MM


def fit_lines(setup: Setup, garment: Garment, positions: np.ndarray, transforms: np.ndarray) -> dict[str, dict]:
    """How far each opening of a garment lies from the plane of the disk it was laid on [mm], positive along the disk's
    normal (towards hem, wrist, ankle).

    ``positions`` (nv, 3) are those of all garments, ``transforms`` (b, 4, 4) those of the body's bones.
    """
    part = next(part for part in setup.cloth.parts if part.name == garment.name)
    result = {}
    for line in garment.dressed.lines:
        center, normal = disk_frame(garment.spec.dressing, line.disk, setup.body, transforms)
        away = (positions[part.vertices][line.vertices] - center) @ normal / MM
        result[line.name] = {
            "mean": round(float(away.mean()), 3),
            "min": round(float(away.min()), 3),
            "max": round(float(away.max()), 3),
        }
    return result


def skipped(setup: Setup) -> list[dict[str, str]]:
    """What this scene does not need, and why."""
    options, result = setup.scene.output, []
    if setup.scene.body is None:
        result.append({"what": "contact of cloth with the body", "why": "the scene has no body"})
    elif setup.motion.end_time == 0:
        why = "the scene has no motion: the body's cells are listed once"
        result.append({"what": "motion of the body", "why": why})
    if setup.scene.contact.friction == 0:
        result.append({"what": "friction", "why": "contact.friction is 0"})
    for what, key in (("pictures", "images"), ("film", "video"), ("maps", "maps")):
        if not getattr(options, key):
            result.append({"what": what, "why": f"output.{key} asks for none"})
    if setup.scene.contact.layers is None:
        result.append({"what": "contact of cloth with cloth", "why": "contact.layers does not ask for it"})
    return result
