"""A sheet that falls, computed with many settings and, if wished, by MuJoCo, each held against the converged solution
of the same mesh and fabric."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from taichi_tryon.bench.apart import apart
from taichi_tryon.bench.pareto import compare, ours, peer
from taichi_tryon.bench.pareto.ours import Setting
from taichi_tryon.bench.pareto.peer import PeerSetting
from taichi_tryon.bench.pareto.problem import Problem
from taichi_tryon.bench.pareto.reference import PER_SECOND, falling
from taichi_tryon.bench.pareto.track import Track
from taichi_tryon.bench.record import Record, at_least, told
from taichi_tryon.errors import RunError

OURS = "taichi_tryon"
AS_IS = Setting("as is")
UNIT = "ms a frame"


def solver(**values: float | str) -> Setting:
    """Values of a scene's ``solver``."""
    named = (f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}" for key, value in values.items())
    return Setting(", ".join(named), tuple(f"solver.{key}={value}" for key, value in values.items()))


MOTION = solver(scheme="tr_bdf2", step_s=1 / 240)
"""With which a fall must be right at any time."""
COARSE = {"max_newton_iterations": 1, "step_s": 1 / 30}
SETTINGS = (
    AS_IS,
    solver(step_s=1 / 30),
    solver(step_s=1 / 120),
    solver(step_s=1 / 240),
    solver(scheme="tr_bdf2"),
    solver(scheme="tr_bdf2", step_s=1 / 20),
    solver(scheme="tr_bdf2", step_s=1 / 30),
    solver(scheme="tr_bdf2", step_s=1 / 120),
    MOTION,
    solver(scheme="tr_bdf2", error_mm=3.0),
    solver(scheme="tr_bdf2", error_mm=0.3),
    solver(max_newton_iterations=1),
    solver(max_newton_iterations=20, newton_tolerance=1e-3),
    solver(scheme="tr_bdf2", max_newton_iterations=20, newton_tolerance=1e-3),
    solver(linear_tolerance=0.1),
    solver(linear_tolerance=1e-3),
    solver(preconditioner="block_jacobi"),
    solver(precision="f32"),
    solver(**COARSE),
    Setting("bending constant", ("mesh.bending=constant",)),
    Setting(f"bending constant, {solver(**COARSE).name}", ("mesh.bending=constant", *solver(**COARSE).overrides)),
)
"""Step size and scheme, error control, Newton's and the linear tolerance, preconditioner, precision, bending."""
FEW = (AS_IS, MOTION, solver(**COARSE), solver(precision="f32"))
PEERS = (*(PeerSetting(steps) for steps in (1, 2, 5, 10, 20)), PeerSetting(1, "Newton"), PeerSetting(5, "Newton"))
FEW_PEERS = (PeerSetting(1), PeerSetting(5))

Run = tuple[Setting | PeerSetting, Track]


def tracks(
    problem: Problem, settings: Sequence[Setting | PeerSetting]
) -> Iterator[tuple[Setting | PeerSetting, dict, Track | None]]:
    """Runs with each setting, and what records call them; no track where the simulation fails."""
    for setting in settings:
        own = isinstance(setting, Setting)
        where = {**problem.parameters, "simulator": OURS if own else peer.version(), "setting": setting.name}
        if not own and problem.fabric != "isotropic":
            where["solved"] = "an isotropic sheet instead"
        try:
            yield setting, where, apart(ours.run if own else peer.run, problem, setting)
        except RunError:
            yield setting, where, None


def records(
    problem: Problem,
    settings: Sequence[Setting],
    peers: Sequence[PeerSetting] = (),
    per_second: int = PER_SECOND,
    runs: list[Run] | None = None,
) -> Iterator[Record]:
    """All figures of a problem, the product's first; the tracks are added to ``runs``. Of a setting with which the
    simulation fails there is only that."""
    reference = falling(problem, per_second)
    yield compare.doubt(problem.scene, {**problem.parameters, "simulator": OURS}, reference)
    for setting, where, track in tracks(problem, (*settings, *peers)):
        if track is None:
            yield told(problem.scene, where, "failed", "1", 1, 0.0)
            continue
        if runs is not None:
            runs.append((setting, track))
        yield from compare.figures(problem.scene, where, track, reference, UNIT)
        judged = setting is MOTION and per_second == PER_SECOND
        yield compare.fall(problem.scene, where, track, reference, judged)


def faster(
    problem: Problem,
    setting: PeerSetting,
    theirs: Track,
    ours: Sequence[Track],
    limit: float | None,
    case: str | None = None,
) -> Iterator[Record]:
    """How many times faster than a peer's run the fastest of our own is; 0 where there is none. ``case``: what records
    call the problem, if not by its scene."""
    where = {**problem.parameters, "than": f"{peer.version()}, {setting.name}"}
    wall = float(theirs.wall_s)
    for clock in ("wall", "cpu"):
        times = [compare.cost(theirs, clock) / compare.cost(mine, clock) for mine in ours]
        name, value = f"times_faster_{clock}", max(times, default=0.0)
        if clock == "wall" and limit is not None:
            yield at_least(case or problem.scene, where, name, "1", value, limit, wall)
        else:
            yield told(case or problem.scene, where, name, "1", value, wall)
