"""From holds to what of the cloth is not free, where it is led, and the force that this takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichi_tryon.body.skeleton import Motion, Pose, Skeleton, rotation_matrix
from taichi_tryon.errors import InputError
from taichi_tryon.holds.spec import HoldSpec
from taichi_tryon.mesh.garment import GarmentMesh
from taichi_tryon.units import CM

# a vertex this near to the border [m] still belongs to an area
TOUCHES = 1e-6
_BONE = "hold"


@dataclass(frozen=True)
class Hold:
    """One hold: ``vertices`` (k,) of the cloth, held along ``axes`` (3,) bool, led by ``motion``."""

    name: str
    vertices: np.ndarray
    axes: np.ndarray
    motion: Motion

    @staticmethod
    def from_spec(name: str, spec: HoldSpec, mesh: GarmentMesh, first_vertex: int = 0) -> Hold:
        """A hold on a garment's mesh, whose vertices count from ``first_vertex``. Raises InputError where the panel or
        edge is not there, or no vertex lies in the area."""
        vertices = first_vertex + np.unique(mesh.point_vertex[_points(name, spec, mesh)])
        times = np.cumsum([0.0, *(step.duration_s for step in spec.path)])
        poses = [Pose("start")] + [
            Pose(name, {_BONE: rotation_matrix(step.rotation_degree)}, np.array(step.translation_cm) * CM)
            for step in spec.path
        ]
        skeleton = Skeleton((_BONE,), np.array([-1]), np.array([spec.about_cm]) * CM)
        axes = np.array([axis in spec.axes for axis in "xyz"])
        return Hold(name, vertices, axes, Motion(skeleton, tuple(times.tolist()), tuple(poses)))


@dataclass(frozen=True)
class Holds:
    """All holds on a cloth that starts at ``start`` (nv, 3) [m]. Where two hold one vertex along one axis, the first
    leads it and bears its force: ``leader`` (nv, 3) is its number, -1 where free."""

    holds: tuple[Hold, ...]
    start: np.ndarray
    leader: np.ndarray

    @staticmethod
    def of(holds: list[Hold], start: np.ndarray) -> Holds:
        """All ``holds`` on a cloth at ``start`` (nv, 3) [m]."""
        leader = np.full(start.shape, -1, np.int16)
        for number, hold in reversed(list(enumerate(holds))):
            leader[np.ix_(hold.vertices, hold.axes)] = number
        return Holds(tuple(holds), start, leader)

    @property
    def free(self) -> np.ndarray:
        """(nv, 3) whether a vertex can move along each axis."""
        return self.leader < 0

    @property
    def end_time(self) -> float:
        """When the last path ends [s]."""
        return max((hold.motion.end_time for hold in self.holds), default=0.0)

    def targets(self, time: float) -> np.ndarray:
        """(nv, 3) [m]: where what is held is to be at a time [s] of the motion; where free, the start."""
        result = self.start.copy()
        for number, hold in enumerate(self.holds):
            motion = hold.motion.transforms(time)[0]
            led = self.start @ motion[:3, :3].T + motion[:3, 3]
            result = np.where(self.leader == number, led, result)
        return result

    def reactions(self, net_forces: np.ndarray) -> dict[str, np.ndarray]:
        """Force (3,) [N] of each hold on the cloth, from the net forces (nv, 3) [N] of all else on the vertices."""
        return {
            hold.name: -np.where(self.leader == number, net_forces, 0.0).sum(axis=0)
            for number, hold in enumerate(self.holds)
        }


def _points(name: str, spec: HoldSpec, mesh: GarmentMesh) -> np.ndarray:
    """Numbers of the held pattern points."""
    panels = mesh.panel_names
    if spec.panel is None and len(panels) > 1:
        raise InputError(f"hold {name}: say which panel; panels of {mesh.name}: {', '.join(panels)}")
    panel = spec.panel or panels[0]
    if panel not in panels:
        raise InputError(f"hold {name}: {mesh.name} has no panel {panel}; panels: {', '.join(panels)}")
    if spec.edge is not None:
        edges = [edge for owner, edge in mesh.edge_points if owner == panel]
        if spec.edge not in edges:
            raise InputError(f"hold {name}: panel {panel} has no edge {spec.edge}; edges: {', '.join(edges)}")
        return mesh.edge_points[panel, spec.edge]
    numbers = np.flatnonzero(mesh.point_panel == panels.index(panel))
    points = mesh.pattern_points[numbers]
    if spec.points_cm is not None:
        away = np.linalg.norm(points[None] - np.array(spec.points_cm)[:, None] * CM, axis=2)
        return numbers[away.argmin(axis=1)]
    inside = numbers[_within(spec, points)]
    if not len(inside):
        area = "area_cm" if spec.area_cm else "disk_cm"
        raise InputError(f"hold {name}: no vertex of panel {panel} lies in {area}; widen it or use smaller triangles")
    return inside


def _within(spec: HoldSpec, points: np.ndarray) -> np.ndarray:
    """Which points (n, 2) [m] lie in the area or disk, or on its border."""
    if spec.disk_cm is not None:
        x, y, diameter = np.array(spec.disk_cm) * CM
        return np.linalg.norm(points - [x, y], axis=1) <= diameter / 2 + TOUCHES
    corners = np.array(spec.area_cm) * CM
    return ((points >= corners.min(axis=0) - TOUCHES) & (points <= corners.max(axis=0) + TOUCHES)).all(axis=1)
