"""Orthotropic St. Venant-Kirchhoff membrane on linear triangles: value, gradient, Hessian block.

The deformation gradient F = [f1 f2] = sum_i x_i (g_i)^T maps warp and weft directions into space; g_i is the gradient
of corner i's hat function in material coordinates. Strain is E11 = (f1.f1 - 1)/2, E22 = (f2.f2 - 1)/2 and the shear
angle 2 E12 = f1.f2, as KES measures it. ``stretch`` holds C11, C22, C12, C66.

Everything here is a pure function of one triangle, per unit of area.
"""

import taichi as ti


@ti.func
def strain(f1, f2):
    """Green strain (E11, E22, 2 E12)."""
    return ti.Vector([(f1.dot(f1) - 1.0) / 2.0, (f2.dot(f2) - 1.0) / 2.0, f1.dot(f2)])


@ti.func
def strain_rate(f1, f2, rate1, rate2):
    """Rate of the Green strain [1/s] where the columns of F change at ``rate1`` and ``rate2`` [1/s]."""
    return ti.Vector([f1.dot(rate1), f2.dot(rate2), f1.dot(rate2) + f2.dot(rate1)])


@ti.func
def stress(stretch, e):
    """Second Piola-Kirchhoff stress (S11, S22, S12) [N/m] of the strain (E11, E22, 2 E12)."""
    return ti.Vector([stretch[0] * e[0] + stretch[2] * e[1], stretch[2] * e[0] + stretch[1] * e[1], stretch[3] * e[2]])


@ti.func
def gradient(s, f1, f2, g):
    """Derivative of the energy with respect to the corner whose hat gradient is g: F S g."""
    return f1 * (s[0] * g[0] + s[2] * g[1]) + f2 * (s[2] * g[0] + s[1] * g[1])


@ti.func
def density(stretch, e):
    """Energy density of the strain (E11, E22, 2 E12): of stretch and of shear [J/m^2]."""
    stretched = 0.5 * (stretch[0] * e[0] * e[0] + stretch[1] * e[1] * e[1]) + stretch[2] * e[0] * e[1]
    return ti.Vector([stretched, 0.5 * stretch[3] * e[2] * e[2]])


@ti.func
def slopes(f1, f2, g):
    """Derivatives of (E11, E22, 2 E12), as rows, with respect to the corner whose hat gradient is g [1/m]."""
    return ti.Matrix.rows([g[0] * f1, g[1] * f2, g[0] * f2 + g[1] * f1])


@ti.func
def tension_only(s):
    """The stress with its negative principal part cut off.

    With it the geometric part of the Hessian is positive semi-definite, which is the closed form of clamping the
    eigenvalues of the whole block: under compression the sheet buckles, and the material part alone is kept.
    """
    mean = (s[0] + s[1]) / 2.0
    half = (s[0] - s[1]) / 2.0
    radius = ti.sqrt(half * half + s[2] * s[2])
    result = s
    if mean - radius < 0.0:
        top = ti.max(mean + radius, 0.0)
        # top * (eigenvector eigenvector^T), the eigenvector of the greater principal stress
        c = half / radius if radius > 0.0 else 0.0
        d = s[2] / radius if radius > 0.0 else 0.0
        result = ti.Vector([top * (1.0 + c) / 2.0, top * (1.0 - c) / 2.0, top * d / 2.0])
    return result


@ti.func
def hessian(stretch, tension, f1, f2, gi, gj):
    """3x3 block d2/dx_i dx_j. ``tension`` is the stress of the geometric part: the full one for the exact Hessian,
    ``tension_only`` of it for a positive semi-definite one."""
    shear_i = gi[0] * f2 + gi[1] * f1
    shear_j = gj[0] * f2 + gj[1] * f1
    geometric = tension[0] * gi[0] * gj[0] + tension[1] * gi[1] * gj[1] + tension[2] * (gi[0] * gj[1] + gi[1] * gj[0])
    return (
        stretch[0] * gi[0] * gj[0] * f1.outer_product(f1)
        + stretch[1] * gi[1] * gj[1] * f2.outer_product(f2)
        + stretch[2] * (gi[0] * gj[1] * f1.outer_product(f2) + gi[1] * gj[0] * f2.outer_product(f1))
        + stretch[3] * shear_i.outer_product(shear_j)
        + geometric * ti.Matrix.identity(float, 3)
    )
