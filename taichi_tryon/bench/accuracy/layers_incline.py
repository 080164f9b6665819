"""A sheet on another one, which is held as a slope: Coulomb's law between layers of cloth.

As ``incline``, with the friction of cloth on cloth, whose pairs of vertices, triangles and edges come and go:
it stays where tan a <= mu, and else slides with the acceleration g (sin a - mu cos a).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.bench.accuracy.incline import (
    ACCELERATION_LIMIT,
    CREEP_LIMIT_MM,
    FRICTION,
    GRAVITY,
    SLIDES,
    STICKS,
    gravity,
)
from taichi_tryon.bench.record import Record, absolute, relative
from taichi_tryon.bench.simulate import simulate

SCENE, SHEET = "layers_incline", 1
# steps so short that what slides meets few new triangles in each
SLIDING = "solver.step_s=0.005"


def records(quick: bool) -> Iterator[Record]:
    """Creep below the angle of friction, acceleration above it."""
    seconds = 1 if quick else 10
    angle = np.arctan(STICKS * FRICTION)
    done = simulate(SCENE, gravity(angle), f"drape.duration_s={seconds}")
    moved = (done.positions - done.setup.positions)[done.setup.cloth.parts[SHEET].vertices]
    creep = np.linalg.norm(moved[:, [0, 2]], axis=1).max()
    where = {"tan_over_mu": STICKS, "duration_s": seconds}
    yield absolute(SCENE, where, "creep", "mm", 1e3 * creep, 0.0, CREEP_LIMIT_MM, done.wall_s)

    angle = np.arctan(SLIDES * FRICTION)
    course = []
    duration = f"drape.duration_s={0.3 if quick else 1}"
    done = simulate(SCENE, gravity(angle), duration, SLIDING, watch=lambda s: course.append(_speed(s)))
    (t0, v0), (t1, v1) = course[len(course) // 2], course[-1]
    exact = GRAVITY * (np.sin(angle) - FRICTION * np.cos(angle))
    yield relative(SCENE, {"tan_over_mu": SLIDES}, "acceleration", "m/s2", (v1 - v0) / (t1 - t0), exact,
                   ACCELERATION_LIMIT, done.wall_s)  # fmt: skip


def _speed(simulation) -> tuple[float, float]:
    """Time [s] and the speed of the sheet's centre of mass down the slope [m/s]."""
    part = simulation.setup.cloth.parts[SHEET].vertices
    masses = simulation.setup.cloth.masses[part]
    return simulation.progress.time, float(masses @ simulation.stepper.v.to_numpy()[part, 0] / masses.sum())
