"""``view``: a scene runs in a window."""

from __future__ import annotations

from taichi_tryon import runtime, stage
from taichi_tryon.errors import RunError
from taichi_tryon.observe import Observer
from taichi_tryon.progress import Report, silent
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.setup import prepare
from taichi_tryon.simulation import Simulation
from taichi_tryon.timing import Stopwatch
from taichi_tryon.view.interactive import Viewer, require_display
from taichi_tryon.view.mesh import Mesh


def view_scene(scene: SceneSpec, *, arch: str | None = None, progress: Report = silent) -> None:
    """Run a scene in a window until the user closes it. Raises InputError as ``run`` does, RunError: no display."""
    require_display()
    runtime.start(arch, scene.solver.precision, scene.solver.threads)
    clock = Stopwatch()
    progress("prepare", 0.0)
    setup = prepare(scene, clock)
    progress("compile", 0.0)
    live = Live(Simulation(setup, clock))
    bounds, title = stage.bounds(setup), f"taichi-tryon: {scene.scene}"
    Viewer(live.step, live.reset, live.meshes, bounds, live.status, title=title).run()


class Live:
    """A simulation as the window wants it: step by step, and again from the start."""

    def __init__(self, simulation: Simulation):
        self.simulation, self.observer = simulation, Observer(simulation)
        self._start, self._fault = simulation.state(), ""

    def step(self) -> bool:
        """One step; False when there is none left, or none succeeds."""
        if not self.simulation.finished and not self._fault:
            try:
                self.simulation.advance()
            except RunError as fault:
                self._fault = str(fault)
        return not self.simulation.finished and not self._fault

    def reset(self) -> None:
        """Back to the dressed start."""
        self.simulation.restore(self._start)
        self._fault = ""

    def meshes(self) -> list[Mesh]:
        """The body and the garments now."""
        return stage.meshes(self.simulation.setup, self.simulation.stepper.x.to_numpy(), self.observer.skin())

    def status(self) -> str:
        """Phase, time and, once it is known, the net force."""
        p = self.simulation.progress
        if self._fault:
            return self._fault
        force = f"   net force {p.residual:.1e} of the weight" if p.residual < float("inf") else ""
        return f"{p.phase}   {p.time:.2f} s{force}"
