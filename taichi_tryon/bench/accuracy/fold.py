"""A strip turned back by 180 degrees between two clamps side by side, as a fold and as a loop.

Reference: the heavy elastica between clamps (``elastica.py``), solved as a boundary-value problem; the shapes are the
clamped fold, here without a table below it, and the hanging pear loop of Plaut 2015, "Formulas to determine fabric
bending rigidity from simple tests", Textile Research Journal 85, 10.1177/0040517514553877. Gravity is chosen for
Gamma = w L^3 / B. Where the strip goes hardly depends on B; the level force between the clamps is proportional to it,
hence with the limits of the cantilever's B.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.bench.elastica import bow
from taichi_tryon.bench.record import Record, relative
from taichi_tryon.bench.simulate import scene_path, simulate
from taichi_tryon.fabric import Moduli
from taichi_tryon.scene.load import load_scene

LENGTH, WIDTH, GAP = 0.10, 0.02, 0.01
# the direction in which the strip leaves its first clamp [degree above the level], and Gamma
SHAPES = {"fold": (0.0, 20.0), "pear_loop": (-90.0, 100.0)}
SHAPE_LIMIT, FORCE_LIMITS = 2.0, {5.0: 10.0, 2.5: 3.0}


def records(quick: bool) -> Iterator[Record]:
    """How far the strip reaches from its clamps, how broad it is across, and the force between them."""
    for name in ("fold",) if quick else SHAPES:
        start, gamma = SHAPES[name]
        moduli = Moduli.from_spec(load_scene(scene_path(f"{name}.yaml")).garments[0].fabric)
        rigidity = moduli.bend[0]
        curve, force = bow(gamma, start, GAP / LENGTH)
        exact = (*extents(LENGTH * curve, start), 1e3 * force * rigidity * WIDTH / LENGTH**2)
        gravity = gamma * rigidity / (moduli.mass * LENGTH**3)
        for edge in (5.0,) if quick else FORCE_LIMITS:
            done = simulate(name, f"mesh.edge_length_mm={edge}", f"gravity_m_s2=[0, {-gravity}, 0]")
            free = done.setup.holds.free.all(axis=1)
            pull = 1e3 * done.simulation.reactions()["second"][0]
            found = (*extents(done.positions[free, :2], start), pull)
            where = {"shape": name, "gamma": gamma, "edge_mm": edge}
            limits = (
                ("reach", "mm", SHAPE_LIMIT),
                ("breadth", "mm", SHAPE_LIMIT),
                ("level_force", "mN", FORCE_LIMITS[edge]),
            )
            for (quantity, unit, limit), value, reference in zip(limits, found, exact, strict=True):
                yield relative("fold", where, quantity, unit, value, reference, limit, done.wall_s)


def extents(points: np.ndarray, start_degree: float) -> tuple[float, float]:
    """Of points (n, 2) [m], the first clamp at the origin: reach along its direction and breadth across it [mm]."""
    start = np.radians(start_degree)
    along, across = np.array([[np.cos(start), np.sin(start)], [-np.sin(start), np.cos(start)]]) @ points.T
    return float(1e3 * along.max()), float(1e3 * np.ptp(across))
