"""The pressure that keeps cloth off the skin: nothing from the offset t on, so much close to the skin that it holds.

With u = depth / t below the offset, the energy an area is k t^2 u^3 / (3 (1 - u)), the pressure its derivative
k t u^2 (3 - 2u) / (3 (1 - u)^2): where cloth begins to touch k depth^2 / t, so that Newton's method meets no jump in
stiffness, and without bound towards the skin, as barriers are (Li et al. 2020, "Incremental potential contact"). From
u = last on it follows its tangent, since what a body has run into must find out again.
"""

import taichi as ti

# last, where the pressure at the skin is 7 k t
FIRM = 0.65
# while a garment is forced on, deep in the body at first, 3 k t: any firmer, what touches would hold up all the rest
YIELDING = 0.5


@ti.func
def stored(k: float, t: float, depth: float, last: float) -> float:
    """Energy [J/m^2] at a depth [m]; k [N/m^3], t [m]."""
    u = ti.min(depth / t, last)
    beyond = depth - u * t
    energy = k * t * t * u * u * u / (3.0 * (1.0 - u))
    return energy + beyond * (pressure(k, t, u * t, last) + 0.5 * beyond * steepness(k, t, depth, last))


@ti.func
def pressure(k: float, t: float, depth: float, last: float) -> float:
    """Pressure [Pa] at a depth."""
    u = ti.min(depth / t, last)
    rest = 1.0 - u
    return k * t * u * u * (3.0 - 2.0 * u) / (3.0 * rest * rest) + (depth - u * t) * steepness(k, t, depth, last)


@ti.func
def steepness(k: float, t: float, depth: float, last: float) -> float:
    """Derivative [N/m^3] of the pressure at a depth."""
    u = ti.min(depth / t, last)
    rest = 1.0 - u
    return 2.0 * k * u * (3.0 - 3.0 * u + u * u) / (3.0 * rest * rest * rest)
