"""Reads a simulation into plain arrays for output; the only place where both sides meet."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from taichi_tryon.body.surface import surface_mesh
from taichi_tryon.cloth.model import Part
from taichi_tryon.contact.probe import Probe
from taichi_tryon.dressing.check import crossings
from taichi_tryon.output import maps
from taichi_tryon.output.observation import Observation
from taichi_tryon.simulation import Simulation


@dataclass
class Observer:
    """Looks at a simulation; makes what it needs once."""

    simulation: Simulation

    def __post_init__(self):
        stepper, self.cloth = self.simulation.stepper, self.simulation.setup.cloth
        self.probe = Probe(self.cloth.triangles, self.simulation.field, stepper.x)
        samples = stepper.contact.samples
        self.sample_vertices, self.sample_weights, self.sample_areas = samples.vertices, samples.weights, samples.areas
        self._skin_of: tuple[np.ndarray, tuple[np.ndarray, np.ndarray]] | None = None

    def skin(self) -> tuple[np.ndarray, np.ndarray]:
        """The body's surface now: vertices (n, 3), triangles (m, 3); made anew only when the body has moved."""
        transforms = self.simulation.transforms
        if self._skin_of is None or not np.array_equal(self._skin_of[0], transforms):
            self._skin_of = (transforms, surface_mesh(self.simulation.setup.body.posed(transforms)))
        return self._skin_of[1]

    def arrays(self) -> _Arrays:
        """The whole cloth now."""
        return _Arrays(self)

    def parts(self) -> list[Observation]:
        """Every garment by itself."""
        arrays = self.arrays()
        return [arrays.observation(part) for part in self.cloth.parts]

    def whole(self) -> Observation:
        """All garments together."""
        everything = Part("all", slice(0, self.cloth.vertex_count), slice(0, len(self.cloth.triangles)))
        return self.arrays().observation(everything)


class _Arrays:
    """The cloth's arrays at one instant, each computed when it is first asked for."""

    def __init__(self, observer: Observer):
        self.observer = observer
        self.stepper, self.cloth = observer.simulation.stepper, observer.cloth
        self.positions, self.velocities = self.stepper.x.to_numpy(), self.stepper.v.to_numpy()
        self.net_forces = self.stepper.net_forces()
        self.sample_pressures = self.stepper.contact.pressures()

    @cached_property
    def strains(self) -> dict[str, np.ndarray]:
        return maps.strains(self.positions, self.cloth.triangles, self.cloth.gradients)

    @cached_property
    def gaps(self) -> np.ndarray:
        return maps.gaps(self.positions, self.observer.probe.gaps(), self.observer.skin()[0])

    @cached_property
    def pressures(self) -> np.ndarray:
        o = self.observer
        return maps.vertex_pressure(
            self.sample_pressures, o.sample_vertices, o.sample_weights, o.sample_areas, self.cloth.vertex_count
        )

    @cached_property
    def penetration(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.observer.probe.look()

    def observation(self, part: Part) -> Observation:
        v, t = part.vertices, part.triangles
        depths, inside, samples = (values[t] for values in self.penetration)
        of_part = (self.observer.sample_vertices[:, 0] >= v.start) & (self.observer.sample_vertices[:, 0] < v.stop)
        gravity = np.array(self.observer.simulation.scene.gravity_m_s2)
        triangles = self.cloth.triangles[t] - v.start
        energies = self.stepper.elastic.energies(triangles=t)
        return Observation(
            name=part.name,
            triangles=triangles,
            positions=self.positions[v],
            velocities=self.velocities[v],
            net_forces=self.net_forces[v],
            weights=self.cloth.masses[v] * np.linalg.norm(gravity),
            gaps=self.gaps[v],
            pressures=self.pressures[v],
            strains={name: values[t] for name, values in self.strains.items()},
            depths=depths,
            inside=inside,
            samples=samples,
            contact_pressures=self.sample_pressures[of_part],
            contact_areas=self.observer.sample_areas[of_part],
            energies={
                **dict(zip(("stretch", "shear", "bend"), energies[:3], strict=True)),
                "gravity": -float(self.cloth.masses[v] @ (self.positions[v] @ gravity)),
            },
            crossings=crossings(self.positions[v], triangles),
        )
