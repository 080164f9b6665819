"""Why cloth did not come to rest: where it is worst, what was seen there, and what to try."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from taichi_tryon.output.observation import Inspection
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.setup import Garment
from taichi_tryon.simulation import Progress
from taichi_tryon.units import CM, MM
from taichi_tryon.view.mesh import vertex_normals

# the net force still falls if in the last half of the steps it has fallen below this part
FALLING = 0.8
# conjugate gradients that take this part of the iterations allowed, in the mean, are mostly cut short
CUT_SHORT = 0.9
# cloth deeper in the body than this [m] is not worn as it should be
DEEP = 1e-3
# steps in which most scenes settle; times the limit, a net force with which some would be content
ENOUGH_STEPS, NEARLY = 200, 10


@dataclass(frozen=True)
class Failure:
    """What is known of a run that did not settle, or settled in the body.

    The spot is the vertex with the greatest net force, of cloth at rest the one deepest in the body: ``panel`` and
    ``at_cm`` (x, y) in the flat panel as the pattern draws it (a seam's are those of its first panel), ``world_cm``
    (x, y, z) where it is now, ``outward`` (3,) the cloth's normal there. ``seen`` holds figures by name; settling has
    no speeds, but ``last_move_mm``, how far the last step moved any vertex. ``advice`` is what to try, most promising
    first.
    """

    garment: str
    panel: str
    at_cm: tuple[float, float]
    world_cm: tuple[float, float, float]
    outward: np.ndarray
    seen: dict[str, float | str]
    advice: list[str]

    def report(self) -> dict:
        """As it stands in ``report.json``."""
        at, world = list(self.at_cm), list(self.world_cm)
        return {
            "garment": self.garment, "panel": self.panel, "at_cm": at, "world_cm": world, "seen": self.seen,
            "try": self.advice,
        }  # fmt: skip

    def lines(self) -> str:
        """As it stands on the terminal: two lines."""
        x, y = self.at_cm
        s = self.seen
        return (
            f"worst in {self.garment}, panel {self.panel}, at ({x:g}, {y:g}) cm: net force {s['net_force_mN']:.3g} mN, "
            f"{s['last_move_mm']:.3g} mm in the last step, {s['rejected_steps']} of {s['steps'] + s['rejected_steps']} "
            f"steps rejected (images/failed.png)\ntry: {'; '.join(self.advice)}"
        )


def explain(
    scene: SceneSpec,
    garments: Sequence[Garment],
    inspections: Sequence[Inspection],
    progress: Progress,
    residuals: Sequence[float],
    rounding: float = 0.0,
    meeting: Callable[[np.ndarray], tuple[str, str] | None] = lambda _: None,
) -> Failure:
    """What to say of a run that ended with ``progress``; inspections are those of the ``garments``, ``residuals`` the
    net force over the weight after each step of settling, ``rounding`` what of it rounding of positions makes,
    ``meeting`` tells which two limbs run into each other around a point (3,) [m]."""
    rests = progress.residual <= scene.settle.residual
    worse = _depths if rests else _sizes
    worst = int(np.argmax([worse(each).max() for each in inspections]))
    garment, there = garments[worst], inspections[worst]
    vertex = int(np.argmax(worse(there)))
    mesh = garment.mesh
    point = int(np.flatnonzero(mesh.point_vertex == vertex)[0])
    forces, weights = (np.concatenate([getattr(i, key) for i in inspections]) for key in ("net_forces", "weights"))
    phase = "settle" if progress.phase == "done" else progress.phase
    seen: dict[str, float | str] = {
        "phase": phase,
        "residual_relative": _short(np.linalg.norm(forces) / (np.linalg.norm(weights) or 1.0)),
        "net_force_mN": _short(1000 * _sizes(there)[vertex]),
        "speed_max_mm_s": _short(max(np.linalg.norm(i.velocities, axis=1).max() for i in inspections) / MM),
        "last_move_mm": _short(progress.moved / MM),
        "steps": progress.steps,
        "rejected_steps": progress.rejected,
    }
    if phase != "settle":
        seen["step_s"] = _short(progress.dt)
    depth = _depths(there)[vertex]
    if inside := rests or depth > DEEP:
        seen["depth_mm"] = _short(depth / MM)
    advice = [*(_inside() if inside else _floating(scene, garments, inspections))]
    if limbs := meeting(there.positions[vertex]):
        advice.append(f"a pose that keeps {' and '.join(limbs)} apart, which run into each other there")
    if not advice and phase == "settle" and rounding > scene.settle.residual:
        seen["rounding_relative"] = _short(rounding)
        advice = [*_too_few_digits(scene, rounding)]
    if not advice:
        advice = [*(_not_settled(scene, progress, residuals) if phase == "settle" else _no_step(scene, phase))]
        advice += _anywhere(scene, progress)
    x, y = (round(float(value / CM), 2) for value in mesh.pattern_points[point])
    return Failure(
        garment.name,
        mesh.panel_names[mesh.point_panel[point]],
        (x, y),
        tuple(round(float(value / CM), 2) for value in there.positions[vertex]),
        vertex_normals(there.positions, there.triangles)[vertex],
        seen,
        advice,
    )


def _sizes(seen: Inspection) -> np.ndarray:
    """Net force (nv,) [N] on each vertex; what is not a number is worse than any."""
    sizes = np.linalg.norm(seen.net_forces, axis=1)
    return np.where(np.isfinite(sizes), sizes, np.inf)


def _depths(seen: Inspection) -> np.ndarray:
    """How deep [m] in the body the triangles around each vertex (nv,) are."""
    depths = np.zeros(len(seen.positions))
    np.maximum.at(depths, seen.triangles, seen.depths[:, None])
    return depths


def _inside():
    """Cloth is in the body."""
    yield "a start further off the body there"
    yield "a longer motion or slower holds, if body or holds were led through the cloth"


def _floating(scene: SceneSpec, garments: Sequence[Garment], inspections: Sequence[Inspection]):
    """Garments that nothing carries: they fall for ever."""
    if scene.contact.layers is not None:
        return
    for garment, seen in zip(garments, inspections, strict=True):
        if not garment.spec.holds and not (seen.contact_pressures > 0).any():
            yield (
                f"a hold for {garment.name} or a body below it, for it touches nothing and falls; or "
                "settle.max_steps=0, if its fall is all that is wanted"
            )


def _too_few_digits(scene: SceneSpec, rounding: float):
    if scene.solver.precision == "f32":
        yield f"solver.precision=f64, for rounding of positions alone makes a net force of {rounding:.2g} of the weight"
    yield f"settle.residual={_round_up(2 * rounding)}, if that is close enough"


def _not_settled(scene: SceneSpec, progress: Progress, residuals: Sequence[float]):
    limit, steps = scene.settle.residual, scene.settle.max_steps
    half = len(residuals) // 2
    if half and residuals[-1] < FALLING * residuals[-1 - half]:
        # at the pace of the last half, and as many again
        pace = math.log(residuals[-1 - half] / residuals[-1]) / half
        more = 2 * math.log(max(residuals[-1] / limit, 1.0)) / pace
        yield f"settle.max_steps={_round_up(steps + more)}, for the net force still falls"
        return
    yield f"settle.max_steps={max(2 * steps, ENOUGH_STEPS)}"
    yield f"a finer mesh.edge_length_mm than {scene.mesh.edge_length_mm:g}, if folds are no wider than two triangles"
    if progress.residual < NEARLY * limit:
        yield f"settle.residual={_round_up(1.2 * progress.residual)}, if that is close enough"


def _no_step(scene: SceneSpec, phase: str):
    if phase == "dress":
        yield "more ease on the disks of the dressing there, if the garment is put on tighter than it is cut"
    if phase == "move":
        yield "a longer motion (motion.0.duration_s) or slower holds, for the cloth is pulled along too fast"
    if scene.solver.error_mm is not None:
        yield f"a greater solver.error_mm than {scene.solver.error_mm:g}"
    yield f"solver.min_step_s={scene.solver.min_step_s / 10:g}"
    yield f"another mesh.edge_length_mm than {scene.mesh.edge_length_mm:g}"


def _anywhere(scene: SceneSpec, progress: Progress):
    """What may help in every phase."""
    allowed = scene.solver.max_linear_iterations
    if progress.linear_iterations > CUT_SHORT * allowed * max(progress.newton_iterations, 1):
        yield f"solver.max_linear_iterations={4 * allowed}, for most solves are cut short"
    if scene.solver.precision == "f32":
        yield "solver.precision=f64"


def _short(value: float) -> float:
    return float(f"{float(value):.6g}")


def _round_up(value: float) -> str:
    """Two digits, none less."""
    scale = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{math.ceil(value / scale - 1e-9) * scale:.6g}"
