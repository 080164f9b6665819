"""What is known of the cloth at one instant, in plain arrays: the source of frames, maps and report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Observation:
    """One garment, or all of them, at one instant, as a frame shows it; nv vertices, nt triangles.

    positions, velocities (nv, 3) [m, m/s]; gaps (nv,) [m] from the skin, None where there is no body; pressures (nv,)
    [Pa]; contact_forces (nv, 3) [N] of the body on the cloth, friction included; strains: arrays (nt,) by name.
    """

    name: str
    triangles: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    gaps: np.ndarray | None
    pressures: np.ndarray
    contact_forces: np.ndarray
    strains: dict[str, np.ndarray]


@dataclass(frozen=True)
class Inspection(Observation):
    """An observation with all that the report judges it by.

    net_forces (nv, 3) and weights (nv,) [N]; depths (nt,) [m] of the deepest point inside the body, with how many of
    the points looked at lie inside (``inside``, ``samples`` (nt,)); pressures (ns,) [Pa] and areas (ns,) [m^2] of the
    contact samples, the sum of both with the normals is ``normal_force`` (3,) [N]; the same on the body's surface,
    skin_pressures (n,) and skin_areas (n,); energies [J] by name; crossings (k, 2) pairs of triangles.
    """

    net_forces: np.ndarray
    weights: np.ndarray
    depths: np.ndarray
    inside: np.ndarray
    samples: np.ndarray
    contact_pressures: np.ndarray
    contact_areas: np.ndarray
    normal_force: np.ndarray
    skin_pressures: np.ndarray
    skin_areas: np.ndarray
    energies: dict[str, float]
    crossings: np.ndarray
