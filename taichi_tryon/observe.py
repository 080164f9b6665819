"""Reads a simulation into plain arrays for output; the only place where both sides meet."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from taichi_tryon.body.surface import surface_mesh
from taichi_tryon.cloth.model import Part
from taichi_tryon.cloth.nodal import strains
from taichi_tryon.contact.probe import Probe
from taichi_tryon.dressing.check import crossings
from taichi_tryon.output import maps
from taichi_tryon.output.imprint import imprint, surface_vectors
from taichi_tryon.output.observation import Inspection, Observation
from taichi_tryon.simulation import Simulation

# edge of the grid on which the skin is drawn [m]
SKIN_SPACING = 0.01
# over how many edges, of cloth or skin, whichever are longer, the force at a point spreads on the skin
IMPRINT_EDGES = 1.5


@dataclass
class Observer:
    """Looks at a simulation; makes what it needs once."""

    simulation: Simulation

    def __post_init__(self):
        stepper, self.cloth = self.simulation.stepper, self.simulation.setup.cloth
        self.probe = Probe(self.cloth.triangles, self.simulation.field, stepper.x)
        samples = stepper.contact.samples
        self.sample_vertices, self.sample_weights, self.sample_areas = samples.vertices, samples.weights, samples.areas
        lengths = [garment.mesh.edge_lengths for garment in self.simulation.setup.garments]
        self.reach = IMPRINT_EDGES * max(SKIN_SPACING, float(np.concatenate(lengths).mean()))
        self._pose, self._skin = None, None

    def skin(self) -> tuple[np.ndarray, np.ndarray]:
        """The body's surface now: vertices (n, 3), triangles (m, 3); the same object until the body moves."""
        transforms = self.simulation.transforms
        if self._pose is None or not np.array_equal(self._pose, transforms):
            self._pose = transforms
            self._skin = surface_mesh(self.simulation.setup.body.posed(transforms), SKIN_SPACING)
        return self._skin

    def observe(self) -> list[Observation]:
        """Every garment as a frame shows it."""
        arrays = _Arrays(self)
        return [Observation(**arrays.shown(part)) for part in self.cloth.parts]

    def skin_pressure(self) -> np.ndarray:
        """Pressure (n,) [Pa] of all garments at the vertices of the ``skin``."""
        return _Arrays(self).imprint(np.ones(len(self.sample_areas), bool))

    def inspect(self) -> tuple[Inspection, list[Inspection]]:
        """The whole cloth, and every garment by itself, as the report judges them."""
        self.simulation.stepper.balance()  # so that contact and net forces are of one instant
        arrays = _Arrays(self)
        whole = Part("all", slice(0, self.cloth.vertex_count), slice(0, len(self.cloth.triangles)))
        found = [Inspection(**arrays.shown(part), **arrays.judged(part)) for part in (whole, *self.cloth.parts)]
        return found[0], found[1:]


class _Arrays:
    """The cloth's arrays at one instant; what only the report needs is computed when it asks."""

    def __init__(self, observer: Observer):
        self.observer, self.stepper, self.cloth = observer, observer.simulation.stepper, observer.cloth
        self.positions, self.velocities = self.stepper.x.to_numpy(), self.stepper.v.to_numpy()
        self.strains = maps.strains(strains(self.cloth, self.positions))
        self.gaps = None
        if observer.simulation.scene.body:
            self.gaps = maps.gaps(self.positions, observer.probe.gaps(), observer.skin()[0])
        contact = self.stepper.contact
        count = len(observer.sample_areas)
        self.sample_pressures = contact.pressures()
        self.sample_normals = contact.normal.to_numpy()[:count]
        loads = np.where(self.sample_pressures[:, None] > 0, contact.load.to_numpy()[:count], 0.0)
        self.contact_forces = maps.vertex_forces(
            loads, observer.sample_vertices, observer.sample_weights, self.cloth.vertex_count
        )
        self.pressures = maps.vertex_pressure(
            self.sample_pressures,
            observer.sample_vertices,
            observer.sample_weights,
            observer.sample_areas,
            self.cloth.vertex_count,
        )

    @cached_property
    def penetration(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.observer.probe.look()

    @cached_property
    def net_forces(self) -> np.ndarray:
        return self.stepper.net_forces()

    def imprint(self, chosen: np.ndarray) -> np.ndarray:
        """Pressure (n,) [Pa] on the skin of the ``chosen`` (ns,) bool samples."""
        o, pressing = self.observer, chosen & (self.sample_pressures > 0)
        corners, weights = self.positions[o.sample_vertices[pressing]], o.sample_weights[pressing]
        points = np.einsum("sk,ski->si", weights, corners)
        forces = (self.sample_pressures * o.sample_areas)[pressing]
        return imprint(points, forces, self.sample_normals[pressing], *o.skin(), o.reach)

    def shown(self, part: Part) -> dict:
        """The fields of an Observation."""
        v, t = part.vertices, part.triangles
        return {
            "name": part.name,
            "triangles": self.cloth.triangles[t] - v.start,
            "positions": self.positions[v],
            "velocities": self.velocities[v],
            "gaps": None if self.gaps is None else self.gaps[v],
            "pressures": self.pressures[v],
            "contact_forces": self.contact_forces[v],
            "strains": {name: values[t] for name, values in self.strains.items()},
        }

    def judged(self, part: Part) -> dict:
        """The further fields of an Inspection."""
        v, t = part.vertices, part.triangles
        depths, inside, samples = (values[t] for values in self.penetration)
        first = self.observer.sample_vertices[:, 0]
        of_part = (first >= v.start) & (first < v.stop)
        pushes = (self.sample_pressures * self.observer.sample_areas)[of_part]
        gravity = np.array(self.observer.simulation.scene.gravity_m_s2)
        net_forces = self.net_forces[v]  # evaluates the laws that the energies are read from
        energies = dict(zip(("stretch", "shear", "bend"), self.stepper.elastic.energies(triangles=t)[:3], strict=True))
        return {
            "net_forces": net_forces,
            "weights": self.cloth.masses[v] * np.linalg.norm(gravity),
            "depths": depths,
            "inside": inside,
            "samples": samples,
            "contact_pressures": self.sample_pressures[of_part],
            "contact_areas": self.observer.sample_areas[of_part],
            "normal_force": pushes @ self.sample_normals[of_part],
            "skin_pressures": self.imprint(of_part),
            "skin_areas": surface_vectors(*self.observer.skin())[0],
            "energies": {**energies, "gravity": -float(self.cloth.masses[v] @ (self.positions[v] @ gravity))},
            "crossings": crossings(self.positions[v], self.cloth.triangles[t] - v.start),
        }
