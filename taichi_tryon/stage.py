"""What pictures and window show of a simulation: the body's skin and the garments, and the bounds around it all."""

from __future__ import annotations

import numpy as np

from taichi_tryon.setup import Setup
from taichi_tryon.units import MM
from taichi_tryon.view.appearance import cloth, skin
from taichi_tryon.view.camera import bounds_of
from taichi_tryon.view.mesh import Mesh

# poses of a motion that are looked at for its bounds
POSES = 5


def meshes(setup: Setup, positions: np.ndarray, body: tuple[np.ndarray, np.ndarray]) -> list[Mesh]:
    """The body's skin, ``body``: vertices (n, 3), triangles (m, 3), and each garment at ``positions`` (nv, 3) with its
    colour and weave."""
    shapes = [skin(*body)] if len(body[1]) else []
    for part, garment in zip(setup.cloth.parts, setup.garments, strict=True):
        look = garment.spec.appearance
        checker = None if look.checker_mm is None else look.checker_mm * MM
        shapes.append(cloth(positions[part.vertices], garment.mesh.triangles, garment.mesh.rest, look.color, checker))
    return shapes


def bounds(setup: Setup) -> tuple[np.ndarray, np.ndarray]:
    """(lowest, highest) corner [m] of a box around the body in all poses of the motion, and the garments' start."""
    motion, reach = setup.motion, [setup.positions]
    for time in np.linspace(0, motion.end_time, POSES if motion.end_time else 1):
        balls = setup.body.posed(motion.transforms(float(time)))
        bounded = np.isfinite(balls.radii).all(axis=1)
        # the skin lies well within the balls' supports
        extent = 0.6 * balls.extents[bounded]
        reach += [balls.centers[bounded] - extent, balls.centers[bounded] + extent]
    return bounds_of(reach)
