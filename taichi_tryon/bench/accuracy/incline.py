"""A sheet on a slope: Coulomb's law.

It stays where tan a <= mu, and else slides with the acceleration g (sin a - mu cos a). The slope is a level plane under
turned gravity. Just below the angle of friction the sheet must not creep in ten seconds (friction that is smoothed over
a range of speeds creeps by millimetres); above it, backward Euler has the exact speed.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from taichi_tryon.bench.record import Record, absolute, relative
from taichi_tryon.bench.simulate import simulate

GRAVITY, FRICTION = 9.81, 0.3
STICKS, SLIDES = 0.98, 1.2
CREEP_LIMIT_MM, ACCELERATION_LIMIT = 0.1, 1.0


def records(quick: bool) -> Iterator[Record]:
    """Creep below the angle of friction, acceleration above it."""
    seconds = 1 if quick else 10
    angle = np.arctan(STICKS * FRICTION)
    done = simulate("incline", gravity(angle), f"drape.duration_s={seconds}")
    creep = np.linalg.norm((done.positions - done.setup.positions)[:, [0, 2]], axis=1).max()
    where = {"tan_over_mu": STICKS, "duration_s": seconds}
    yield absolute("incline", where, "creep", "mm", 1e3 * creep, 0.0, CREEP_LIMIT_MM, done.wall_s)

    angle = np.arctan(SLIDES * FRICTION)
    course = []
    done = simulate(
        "incline", gravity(angle), f"drape.duration_s={0.3 if quick else 1}", watch=lambda s: course.append(_speed(s))
    )
    (t0, v0), (t1, v1) = course[len(course) // 2], course[-1]
    exact = GRAVITY * (np.sin(angle) - FRICTION * np.cos(angle))
    yield relative("incline", {"tan_over_mu": SLIDES}, "acceleration", "m/s2", (v1 - v0) / (t1 - t0), exact,
                   ACCELERATION_LIMIT, done.wall_s)  # fmt: skip


def gravity(angle: float) -> str:
    """What turns gravity by an angle [rad] instead of the slope."""
    return f"gravity_m_s2=[{GRAVITY * np.sin(angle)}, {-GRAVITY * np.cos(angle)}, 0]"


def _speed(simulation) -> tuple[float, float]:
    """Time [s] and the centre of mass's speed down the slope [m/s]."""
    masses = simulation.setup.cloth.masses
    return simulation.progress.time, float(masses @ simulation.stepper.v.to_numpy()[:, 0] / masses.sum())
