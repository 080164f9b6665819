"""The pressure that keeps cloth from cloth: nothing from the distance t on, without bound towards none.

With the closeness s = 1 - d / t the energy is k t^2 f(s) an area, f(s) = -s^2 ln(1 - s): the barrier of Li et al. 2020,
"Incremental potential contact", eq. 6, but of the distance instead of its square. Where cloth begins to touch, the
pressure k t f'(s) is about 3 k t s^2, as soft as where it touches the body.
"""

import taichi as ti


@ti.func
def energy(s):
    """f(s)"""
    return -s * s * ti.log(1.0 - s)


@ti.func
def slope(s):
    """f'(s)"""
    return s * (s / (1.0 - s) - 2.0 * ti.log(1.0 - s))


@ti.func
def curvature(s):
    """f''(s)"""
    rest = 1.0 - s
    return s * (4.0 * rest + s) / (rest * rest) - 2.0 * ti.log(rest)
