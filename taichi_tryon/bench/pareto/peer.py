"""A problem in MuJoCo: a flex of the same triangles and masses, integrated by ``discrete``, implicit in positions.

MuJoCo's sheet is isotropic: a membrane of Young's modulus E and thickness t, stretch rigidity E t, and hinges of
bending rigidity E t^3 / 12, without Poisson effect. E and t follow from the means over warp and weft of a fabric's
rigidities; its shear rigidity is then half the stretch rigidity, whatever the fabric's own.
Source: MuJoCo 4.0 documentation, XML reference, flex/elasticity; Computation, numerical integration.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from taichi_tryon.bench.pareto import ours
from taichi_tryon.bench.pareto.problem import FRAME, Problem
from taichi_tryon.bench.pareto.track import Track, Tracker
from taichi_tryon.errors import InputError
from taichi_tryon.fabric import Moduli
from taichi_tryon.setup import Setup, prepare
from taichi_tryon.timing import Stopwatch
from taichi_tryon.units import MM

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True)
class PeerSetting:
    """Steps a frame, and MuJoCo's solver: CG (``iterations`` a step at the most) or Newton."""

    steps: int
    solver: str = "CG"
    iterations: int = 50

    @property
    def name(self) -> str:
        """What records call it."""
        return f"{self.solver}, {self.steps} a frame"


def require() -> None:
    """Raise InputError where MuJoCo is not installed."""
    if find_spec("mujoco") is None:
        raise InputError("--peers: MuJoCo is not installed; pip install 'taichi-tryon[peers]'")


def version() -> str:
    """Name and version, as records call it."""
    import mujoco

    return f"MuJoCo {mujoco.__version__}"


def run(problem: Problem, setting: PeerSetting) -> Track:
    """Follow the problem to its end, on one thread; the moment is a whole number of frames."""
    import mujoco

    setup = prepare(ours.scene_of(problem, ours.Setting("")), Stopwatch())
    model, data = flex(problem, setup, setting)
    tracker = Tracker(setup.cloth, setup.positions, setup.velocities, problem)
    cpu = wall = first = 0.0
    for frame in range(1, round(problem.duration / FRAME) + 1):
        cpu_begin, begin = time.process_time(), time.perf_counter()
        for _ in range(setting.steps):
            mujoco.mj_step(model, data)
            if not first:
                first = model.opt.timestep
                cpu_begin, begin = time.process_time(), time.perf_counter()
        cpu, wall = cpu + time.process_time() - cpu_begin, wall + time.perf_counter() - begin
        positions = where(model, data)
        # seen at every frame: no velocity is asked for
        tracker.seen(frame * FRAME, positions, np.zeros_like(positions))
    return tracker.track(cpu, wall, problem.duration - first)


def where(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Positions (nv, 3) [m] at the end of the step; by itself MuJoCo has those of its beginning."""
    import mujoco

    mujoco.mj_kinematics(model, data)
    mujoco.mj_flex(model, data)
    return data.flexvert_xpos.copy()


def flex(problem: Problem, setup: Setup, setting: PeerSetting) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Model and data of a problem."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(_xml(problem, setup, setting))
    data = mujoco.MjData(model)
    bodies = model.flex_vertbodyid
    moving = bodies > 0
    model.body_mass[bodies[moving]] = setup.cloth.masses[moving]
    mujoco.mj_setConst(model, data)
    return model, data


def shell(moduli: Moduli) -> tuple[float, float]:
    """Young's modulus [Pa] and thickness [m] of an isotropic sheet as stiff as a fabric's mean over warp and weft."""
    stretch, bend = moduli.stretch[:2].mean(), moduli.bend[:2].mean()
    thickness = np.sqrt(12 * bend / stretch)
    return float(stretch / thickness), float(thickness)


def _xml(problem: Problem, setup: Setup, setting: PeerSetting) -> str:
    scene, positions = setup.scene, setup.positions
    young, thickness = shell(Moduli.from_spec(scene.garments[0].fabric))
    pinned = np.flatnonzero(~setup.holds.free.any(axis=1))
    pins = f'<pin id="{_text(pinned)}"/>' if len(pinned) else ""
    friction = f"{scene.contact.friction} 0 0"
    # two layers touch at twice the radius, which is then ours too: 2 x 0.5 mm
    selfcollide = "none" if scene.contact.layers is None else "auto"
    ball = f'<geom type="sphere" size="{problem.ball}" friction="{friction}"/>' if problem.ball else ""
    return f"""<mujoco>
      <option timestep="{FRAME / setting.steps!r}" gravity="{_text(scene.gravity_m_s2)}" integrator="discrete"
              solver="{setting.solver}" iterations="{setting.iterations}"/>
      <size memory="4G"/>
      <worldbody>
        {ball}
        <flexcomp name="sheet" type="direct" dim="2" mass="1" radius="{scene.contact.thickness_mm * MM}"
                  point="{_text(positions.ravel())}" element="{_text(setup.cloth.triangles.ravel())}">
          {pins}
          <contact selfcollide="{selfcollide}" condim="3" friction="{friction}"/>
          <elasticity young="{young!r}" poisson="0" thickness="{thickness!r}" elastic2d="both"/>
        </flexcomp>
      </worldbody>
    </mujoco>"""


def _text(numbers) -> str:
    return " ".join(f"{number:.12g}" for number in numbers)
