"""How large a garment's mesh will be, told from its outline before anything is meshed."""

from __future__ import annotations

import math

from shapely import Polygon

from taichi_tryon.pattern.panel import Pattern
from taichi_tryon.scene.models import GarmentSpec
from taichi_tryon.sheet.spec import SheetSpec
from taichi_tryon.units import CM, MM

MOST_VERTICES = 2_000_000
"""A vertex takes some 4 kB of memory."""


def vertex_estimate(garment: GarmentSpec, edge_length_mm: float) -> float:
    """Vertices of equilateral triangles that cover the garment, and those along its outline."""
    edge = edge_length_mm * MM
    if garment.sheet is not None:
        area, outline = _sheet(garment.sheet)
    else:
        panels = Pattern.from_spec(garment.pattern).panels.values()
        area, outline = sum(p.area for p in panels), sum(e.length for p in panels for e in p.edges)
    return area / (math.sqrt(3) / 2 * edge**2) + outline / edge


def _sheet(sheet: SheetSpec) -> tuple[float, float]:
    """Area [m^2] and outline [m]."""
    if sheet.diameter_cm is not None:
        return math.pi / 4 * (sheet.diameter_cm * CM) ** 2, math.pi * sheet.diameter_cm * CM
    if sheet.size_cm is not None:
        width, height = (length * CM for length in sheet.size_cm)
        return width * height, 2 * (width + height)
    polygon = Polygon(sheet.outline_cm)
    return polygon.area * CM**2, polygon.length * CM
