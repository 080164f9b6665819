"""The push of the swing, and that its energy is what it says; the order itself is tested with the schemes."""

from pathlib import Path

import numpy as np
import pytest

from taichi_tryon.bench.accuracy.swing import LENGTH, STIFF, pushed, swing
from taichi_tryon.bench.energy import kinetic, mechanical
from taichi_tryon.bench.simulate import simulate


@pytest.fixture(scope="module")
def hanging():
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(Path(__file__).parents[2])
        stiff, coarse = f"garments.0.fabric.tensile_warp_gf_per_cm={STIFF}", "mesh.edge_length_mm=100"
        return simulate("swing", stiff, coarse, "solver.preconditioner=block_jacobi")


def test_the_push_lifts_to_45_degrees_and_its_energy_stays(hanging):
    start = pushed(hanging.simulation)
    swing(hanging, start, "tr_bdf2", 120, 0.0)
    push, whole = kinetic(hanging.simulation.stepper), mechanical(hanging.simulation.stepper)
    mass = hanging.setup.cloth.masses.sum()
    # of a rod; the mesh's masses lie a little otherwise along it
    assert push == pytest.approx(mass * 9.81 * LENGTH / 2 * (1 - np.sqrt(0.5)), rel=0.05)
    swing(hanging, start, "tr_bdf2", 120, 0.2)
    assert kinetic(hanging.simulation.stepper) < 0.9 * push
    assert mechanical(hanging.simulation.stepper) == pytest.approx(whole, abs=0.005 * push)
