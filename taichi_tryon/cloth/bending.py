"""Bending by mid-edge normals: hinge angles between triangles, and one rotation per edge.

Each edge carries a normal that may turn about the edge; phi is its angle from the bisector of the two face normals.
Seen from a triangle, the edge normal leans outward by alpha = sigma/2 + phi on the first side of the hinge and
sigma/2 - phi on the second; on a border, where nothing holds it, alpha = phi. The spread sigma = 2 tan(theta / 2) of a
hinge by the angle theta over the length h is that of the arc which touches both triangles h/2 from it; theta itself
makes folds of few triangles too soft. The curvature tensor of the triangle is that of the Morley element,

    kappa = sum_k alpha_k (l_k / A) n_k n_k^T,

n_k the outward normal of edge k in material coordinates. phi minimises the energy, which is a fixed sparse linear
system, so bending stiffness depends on nothing but the pattern. Converges on every mesh, along warp, weft and bias
alike.

Sources: Grinspun, Gingold, Reisman, Zorin 2006, "Computing discrete shape operators on general meshes"; Morley 1968,
"The triangular equilibrium element in the solution of plate bending problems".
"""

import numpy as np
import taichi as ti

from taichi_tryon.cloth.hysteresis import BENDING_REACH

STEEPEST = 2.5
"""Hinge angle [rad] beyond which the spread grows no steeper: it would be infinite where cloth is folded flat."""


def triangle_stiffness(rest: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """Energy of a triangle in its three edge angles: 1/2 alpha^T M alpha.

    rest: (nt, 3, 2) corners in material coordinates [m]; bend: (nt, 4) D11, D22, D12, D66 [N m].
    Returns M (nt, 3, 3) [N m]; edge k is opposite to corner k.
    """
    edges = np.roll(rest, -2, axis=1) - np.roll(rest, -1, axis=1)
    area = 0.5 * np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    # l_k n_k, either sense: n appears twice
    scaled = np.stack([edges[..., 1], -edges[..., 0]], axis=-1)
    length = np.linalg.norm(scaled, axis=-1, keepdims=True)
    n = scaled / length
    curvature = np.stack([n[..., 0] ** 2, n[..., 1] ** 2, 2 * n[..., 0] * n[..., 1]], axis=-1) * length
    d = np.zeros((len(rest), 3, 3))
    d[:, 0, 0], d[:, 1, 1], d[:, 2, 2] = bend[:, 0], bend[:, 1], bend[:, 3]
    d[:, 0, 1] = d[:, 1, 0] = bend[:, 2]
    return np.einsum("tka,tab,tlb->tkl", curvature, d, curvature) / area[:, None, None]


def edge_curvatures(gradients: np.ndarray) -> np.ndarray:
    """Curvatures k11, k22 of a triangle for an angle of 1 at each of its edges: (nt, 2, 3) [1/m]; gradients (nt, 3, 2)
    of the hat functions [1/m]."""
    # the hat of corner k falls along n_k, by 1 over the height 2 A / l_k
    size = np.linalg.norm(gradients, axis=2, keepdims=True)
    return (2 * gradients**2 / size).transpose(0, 2, 1)


def stuck_stiffness(gradients: np.ndarray, areas: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """What dry ``friction`` (nt, 2) [N m/m] along warp and weft adds to the ``triangle_stiffness`` where it sticks."""
    k = edge_curvatures(gradients)
    return np.einsum("tak,ta,tal->tkl", k, friction * areas[:, None] / BENDING_REACH, k)


@ti.func
def hinge_spread(x0, x1, x2, x3):
    """Spread 2 tan(theta / 2) of a hinge, and its derivative with respect to theta; beyond STEEPEST it goes on along
    its tangent.

    theta is the angle [rad] between the normals of (x0, x1, x2) and (x1, x0, x3), positive where they spread apart.
    """
    edge = x1 - x0
    n1 = edge.cross(x2 - x0)
    n2 = (x3 - x0).cross(edge)
    sine, cosine = n1.cross(n2).dot(edge) / ti.max(edge.norm(), 1e-12), n1.dot(n2)
    # of a triangle crushed to a point the spread is 0
    size = ti.max(ti.sqrt(sine * sine + cosine * cosine), 1e-30)
    # the half angle's tangent
    t = sine / (size + cosine)
    spread = 2.0 * t
    if cosine < ti.static(np.cos(STEEPEST)) * size:
        side = ti.cast(1.0, float)
        if sine < 0.0:
            side = -1.0
        t = ti.cast(ti.static(np.tan(0.5 * STEEPEST)), float)
        spread = side * (2.0 * t + (1.0 + t * t) * (ti.abs(ti.atan2(sine, cosine)) - STEEPEST))
    return ti.Vector([spread, 1.0 + t * t])


@ti.func
def hinge_gradient(x0, x1, x2, x3, least_height_1: float, least_height_2: float):
    """Derivatives of a hinge's angle with respect to x0, x1, x2, x3 as the rows of a 4x3 matrix [rad/m].

    It grows as 1/height of the triangles; heights below the given least ones are taken as those, so that a triangle
    crushed to a line asks for a finite moment.
    """
    edge = x1 - x0
    length = ti.max(edge.norm(), 1e-12)
    n1 = edge.cross(x2 - x0)
    n2 = (x3 - x0).cross(edge)
    area1 = ti.max(n1.norm(), length * least_height_1)
    area2 = ti.max(n2.norm(), length * least_height_2)
    d2 = -n1 * (length / (area1 * area1))
    d3 = -n2 * (length / (area2 * area2))
    # the share of x1 in the foot of the height from x2 and x3
    s2 = (x2 - x0).dot(edge) / (length * length)
    s3 = (x3 - x0).dot(edge) / (length * length)
    d0 = -(1.0 - s2) * d2 - (1.0 - s3) * d3
    d1 = -s2 * d2 - s3 * d3
    return ti.Matrix.rows([d0, d1, d2, d3])
