"""Closest points of two pieces of cloth: a vertex and a triangle, or two edges (Ericson 2005, Real-Time Collision
Detection, ch. 5).

Either pair has four corners; its distance is the length of sum_k weight_k x_k with the weights of the closest points,
and weight_k n its gradient, n being that sum's direction: the closest points stand still to first order.
"""

import taichi as ti

# a vertex and a triangle; two edges
FACE, EDGES = 0, 1
# the sine squared of the angle between two edges below which they count as parallel
PARALLEL = 1e-10


@ti.func
def weights_of(kind: int, a, b, c, d):
    """Signed weights (4,) of the corners a, b, c, d: vertex and triangle, or the ends of two edges."""
    result = ti.Vector([0.0, 0.0, 0.0, 0.0])
    if kind == FACE:
        near = on_triangle(a, b, c, d)
        result = ti.Vector([1.0, -near[0], -near[1], -near[2]])
    else:
        s, t = on_edges(a, b, c, d)
        result = ti.Vector([1.0 - s, s, t - 1.0, -t])
    return result


@ti.func
def on_triangle(p, a, b, c):
    """Barycentric coordinates (3,) of the point of triangle abc nearest to p."""
    result = ti.Vector([1.0, 0.0, 0.0])
    ab, ac, ap, bp, cp = b - a, c - a, p - a, p - b, p - c
    d1, d2, d3, d4, d5, d6 = ab.dot(ap), ac.dot(ap), ab.dot(bp), ac.dot(bp), ab.dot(cp), ac.dot(cp)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        result = ti.Vector([1.0, 0.0, 0.0])
    elif d3 >= 0.0 and d4 <= d3:
        result = ti.Vector([0.0, 1.0, 0.0])
    elif d6 >= 0.0 and d5 <= d6:
        result = ti.Vector([0.0, 0.0, 1.0])
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = d1 / (d1 - d3)
        result = ti.Vector([1.0 - t, t, 0.0])
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / (d2 - d6)
        result = ti.Vector([1.0 - t, 0.0, t])
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        result = ti.Vector([0.0, 1.0 - t, t])
    else:
        inverse = 1.0 / (va + vb + vc)
        result = ti.Vector([va, vb, vc]) * inverse
    return result


@ti.func
def on_edges(p, q, a, b):
    """Where on pq and ab, as parts of their lengths, the two come closest."""
    u, v, r = q - p, b - a, p - a
    uu, vv, uv, ur, vr = u.dot(u), v.dot(v), u.dot(v), u.dot(r), v.dot(r)
    # by cross products, as differences of dot products lose the angle of nearly parallel edges in single precision
    normal = u.cross(v)
    across = normal.dot(normal)
    s = ti.cast(0.0, float)
    if across > PARALLEL * uu * vv:
        s = ti.math.clamp(normal.dot(v.cross(r)) / across, 0.0, 1.0)
    t = (uv * s + vr) / vv
    if t < 0.0:
        t = ti.cast(0.0, float)
        s = ti.math.clamp(-ur / uu, 0.0, 1.0)
    elif t > 1.0:
        t = ti.cast(1.0, float)
        s = ti.math.clamp((uv - ur) / uu, 0.0, 1.0)
    return s, t


@ti.func
def distance(kind: int, a, b, c, d):
    """Distance [m] of the pair."""
    w = weights_of(kind, a, b, c, d)
    return (w[0] * a + w[1] * b + w[2] * c + w[3] * d).norm()
