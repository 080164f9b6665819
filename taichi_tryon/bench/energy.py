"""The energy of a simulation as it stands, for cases in which none may be lost."""

from __future__ import annotations

from taichi_tryon.simulation import Simulation


def kinetic(simulation: Simulation) -> float:
    """Energy of motion [J]."""
    speeds = simulation.stepper.v.to_numpy().astype(float)
    return float(simulation.setup.cloth.masses @ (speeds**2).sum(axis=1) / 2)


def mechanical(simulation: Simulation) -> float:
    """Energy of motion, strain and height [J]."""
    step, masses = simulation.stepper, simulation.setup.cloth.masses
    step.balance()
    height = -masses @ (step.x.to_numpy().astype(float) @ simulation.scene.gravity_m_s2)
    return kinetic(simulation) + float(step.elastic.energies()[:3].sum() + height)
