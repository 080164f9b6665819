"""Dry friction as a tangential spring that slips: it holds up to a greatest force, mu times the normal one (Coulomb).

With the spring's stiffness and its greatest force held fixed it is the gradient of a convex potential of the drag, the
tangential way from what it sticks to: quadratic where it sticks and linear where it slips (the return map of perfect
plasticity; Simo and Hughes 1998, ch. 1). What sticks does not creep.
"""

import taichi as ti

# slipping, a spring keeps this share of its stiffness along its way in the Hessian, so that what is held by nothing
# else does not run away
ALONG = 0.02


@ti.func
def bond_of(stick: float, limit: float, length: float) -> float:
    """Force over the drag [N/m] at a drag of a ``length`` [m]; stick [N/m], limit [N]."""
    bond = stick
    if bond * length > limit:
        bond = limit / length
    return bond


@ti.func
def tangent(bond: float, along: float, drag, normal_part):
    """Hessian [N/m] of a spring; along: its share along the way it slips, 1 where it sticks; normal_part: n n^T."""
    length = drag.norm()
    result = bond * (ti.Matrix.identity(float, 3) - normal_part)
    if along < 1.0 and length > 0.0:
        result -= bond * (1.0 - along) * drag.outer_product(drag) / (length * length)
    return result


@ti.func
def stored(stick: float, limit: float, length: float) -> float:
    """Energy [J] at a drag of a ``length`` [m]."""
    reach = ti.min(length, limit / stick) if stick > 0.0 else 0.0
    return stick * reach * (length - 0.5 * reach)


@ti.func
def slips(stick: float, limit: float, drag):
    """Whether a spring is beyond its limit."""
    return stick * drag.norm() > 1.000001 * limit


@ti.func
def kept(drag, reach: float):
    """The drag, cut to what friction can hold: a length of ``reach`` [m]."""
    result, length = drag, drag.norm()
    if length > reach:
        result *= reach / length
    return result
