"""The energy of a cloth as it stands, for cases in which none may be lost."""

from __future__ import annotations

from taichi_tryon.solver.implicit import ImplicitStep


def kinetic(stepper: ImplicitStep) -> float:
    """Energy of motion [J]."""
    speeds = stepper.v.to_numpy().astype(float)
    return float(stepper.mass.to_numpy().astype(float) @ (speeds**2).sum(axis=1) / 2)


def strain_and_height(stepper: ImplicitStep) -> float:
    """Energy of stretch, shear and bending, and of the height over y = 0 [J]."""
    stepper.balance()
    masses, gravity = stepper.mass.to_numpy().astype(float), stepper.gravity.to_numpy().astype(float)
    return float(stepper.elastic.energies()[:3].sum() - masses @ (stepper.x.to_numpy().astype(float) @ gravity))


def mechanical(stepper: ImplicitStep) -> float:
    """Energy of motion, strain and height [J]."""
    return kinetic(stepper) + strain_and_height(stepper)


def held_and_height(stepper: ImplicitStep) -> tuple[float, float]:
    """Energy [J] of motion, strain and contact, and of the height over y = 0, at the end of a step; unlike those above
    it looks at nothing anew, so that the steps after it have the same bits as without it."""
    potential = stepper.potential
    masses, gravity = (field.to_numpy().astype(float) for field in (stepper.mass, stepper.gravity))
    height = -masses @ (stepper.x.to_numpy().astype(float) @ gravity)
    layers = potential.layers.stored if potential.layered else 0.0
    strain = float(stepper.elastic.energies()[:3].sum())
    return kinetic(stepper) + strain + stepper.contact.energy() + layers, float(height)
