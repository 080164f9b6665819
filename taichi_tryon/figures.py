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
