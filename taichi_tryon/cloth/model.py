"""All garments of a scene as one system of particles, triangles and hinges, in plain arrays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from taichi_tryon.cloth.bending import stuck_stiffness, triangle_stiffness
from taichi_tryon.fabric import Moduli
from taichi_tryon.mesh.garment import GarmentMesh
from taichi_tryon.mesh.topology import Topology

# laws of bending: by mid-edge normals, or by one constant matrix
Bending = Literal["mid_edge", "constant"]
# whose strain stretches the membrane: each triangle's own, or for the most part its mean around each vertex
Membrane = Literal["plain", "nodal"]

# triangles whose stiffness is made together: what that takes meanwhile is many times what is made
AT_A_TIME = 4096


@dataclass(frozen=True)
class Part:
    """Where one garment lies in the arrays of the cloth."""

    name: str
    vertices: slice
    triangles: slice


@dataclass(frozen=True)
class Cloth:
    """Garments joined into one set of arrays; ids count through. Each of the ``parts`` is of one of the ``fabrics``.

    triangles (nt, 3); rest (nt, 3, 2) [m], their corners in material coordinates; areas (nt,) [m^2]; masses (nv,)
    [kg]; rigid (nt,) bool: which triangles cannot bend. hinges (ne, 4): x0 x1 of the edge, x2 x3 opposite (x3 = -1 on
    a border); hinge_triangles (ne, 2), -1 likewise; triangle_edges (nt, 3) opposite to each corner; edge_rate is the
    range of eigenvalues that the iteration for the edge rotations has to cover; bending and membrane say which laws are
    taken. tapes (k, 2) are the ends of the segments of tape, tape_lengths (k,) [m] at rest, tape_stiffness (k,) [N].

    What follows from these is made anew whenever it is asked for, and takes no memory when it is not.
    """

    parts: tuple[Part, ...]
    fabrics: tuple[Moduli, ...]
    triangles: np.ndarray
    rest: np.ndarray
    areas: np.ndarray
    masses: np.ndarray
    hinges: np.ndarray
    hinge_triangles: np.ndarray
    triangle_edges: np.ndarray
    tapes: np.ndarray
    tape_lengths: np.ndarray
    tape_stiffness: np.ndarray
    rigid: np.ndarray
    edge_rate: tuple[float, float]
    bending: Bending = "mid_edge"
    membrane: Membrane = "plain"

    @property
    def vertex_count(self) -> int:
        return len(self.masses)

    @property
    def fabric(self) -> np.ndarray:
        """(nt,) the number of each triangle's part and fabric."""
        counts = [part.triangles.stop - part.triangles.start for part in self.parts]
        return np.repeat(np.arange(len(counts), dtype=np.int32), counts)

    def modulus(self, name: str) -> np.ndarray:
        """(parts, ...) one of the ``Moduli`` of each fabric."""
        return np.array([getattr(fabric, name) for fabric in self.fabrics], float)

    @property
    def gradients(self) -> np.ndarray:
        """(nt, 3, 2) of the hat functions in material coordinates [1/m]."""
        return hat_gradients(self.rest)

    @property
    def bend(self) -> np.ndarray:
        """(nt, 4) D11 D22 D12 D66 [N m]."""
        return np.where(self.rigid[:, None], 0.0, self.modulus("bend")[self.fabric])

    @property
    def bend_friction(self) -> np.ndarray:
        """(nt, 2) dry friction on curvature along warp and weft [N m/m]."""
        return np.where(self.rigid[:, None], 0.0, self.modulus("bend_friction")[self.fabric])

    @property
    def edge_stiffness(self) -> np.ndarray:
        """(nt, 3, 3) [N m] of the leans of each triangle's edges."""
        stiffness = np.empty((len(self.rest), 3, 3))
        for part, bend in zip(self.parts, self.modulus("bend"), strict=True):
            for first in range(part.triangles.start, part.triangles.stop, AT_A_TIME):
                some = slice(first, min(first + AT_A_TIME, part.triangles.stop))
                stiffness[some] = triangle_stiffness(self.rest[some], np.tile(bend, (some.stop - first, 1)))
        stiffness[self.rigid] = 0.0
        return stiffness

    @property
    def edge_signs(self) -> np.ndarray:
        """(nt, 3): +1 where the triangle is the first of its edge's hinge, -1 where it is the second."""
        first = self.hinge_triangles[self.triangle_edges, 0] == np.arange(len(self.triangles))[:, None]
        return np.where(first, 1, -1)

    @property
    def vertex_areas(self) -> np.ndarray:
        """(nv,) a third of the triangles around each vertex [m^2]."""
        shares = np.repeat(self.areas / 3, 3)
        return np.bincount(self.triangles.ravel(), weights=shares, minlength=self.vertex_count)

    def clamped(self, vertices: np.ndarray) -> Cloth:
        """The same cloth where triangles whose corners all are among ``vertices`` (nv,) bool cannot bend.

        What is held over an area is held flat: without this the normals along its border would lean into it, and the
        cloth would bend as if it were clamped a third of a triangle further back.
        """
        # a part of the edge rotations' system has its eigenvalues between those of the whole: edge_rate still covers it
        return replace(self, rigid=self.rigid | vertices[self.triangles].all(axis=1))

    @property
    def edge_clamps(self) -> np.ndarray:
        """(ne,): +1 where the first triangle beside an edge cannot bend, -1 where only the second cannot, else 0."""
        rigid = np.append(self.rigid, False)[self.hinge_triangles]
        return np.where(rigid[:, 0], 1, np.where(rigid[:, 1], -1, 0))

    @staticmethod
    def join(
        garments: list[tuple[GarmentMesh, Moduli]], bending: Bending = "mid_edge", membrane: Membrane = "plain"
    ) -> Cloth:
        """Put the garments' meshes one after the other."""
        parts, rows = [], []
        v = t = e = 0
        for mesh, moduli in garments:
            hinges, beside = _hinges(mesh.topology)
            nt, ne = len(mesh.triangles), len(hinges)
            parts.append(Part(mesh.name, slice(v, v + mesh.vertex_count), slice(t, t + nt)))
            rows.append(
                (
                    mesh.triangles + v if v else mesh.triangles,
                    mesh.rest,
                    mesh.areas,
                    np.bincount(mesh.triangles.ravel(), np.repeat(mesh.areas * moduli.mass / 3, 3), mesh.vertex_count),
                    np.where(hinges < 0, -1, hinges + v),
                    np.where(beside < 0, -1, beside + t),
                    np.roll(mesh.topology.triangle_edges, -1, axis=1) + e,
                    mesh.tapes.vertices + v,
                    mesh.tapes.lengths,
                    mesh.tapes.stiffness,
                    np.zeros(nt, bool),
                )
            )
            v, t, e = v + mesh.vertex_count, t + nt, e + ne
        # one garment's arrays are shared with its mesh
        arrays = [np.concatenate(column) if len(column) > 1 else column[0] for column in zip(*rows, strict=True)]
        rows.clear()
        fabrics = tuple(moduli for _, moduli in garments)
        cloth = Cloth(tuple(parts), fabrics, *arrays, edge_rate=(1.0, 1.0), bending=bending, membrane=membrane)
        return replace(cloth, edge_rate=_edge_rate(cloth))


def _hinges(topology: Topology) -> tuple[np.ndarray, np.ndarray]:
    """Edges with the vertices opposite (ne, 4) and the triangles beside them (ne, 2); a border's one is the first."""
    border = topology.edge_triangles[:, :1] < 0
    pairs = (topology.edges, topology.opposite, topology.edge_triangles)
    flip = [np.where(border, pair[:, ::-1], pair) for pair in pairs]
    return np.hstack(flip[:2]), flip[2]


def hat_gradients(rest: np.ndarray) -> np.ndarray:
    """Gradients (nt, 3, 2) of the three hat functions of triangles with corners ``rest`` (nt, 3, 2)."""
    edges = np.roll(rest, -2, axis=1) - np.roll(rest, -1, axis=1)
    twice_area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    return np.stack([-edges[..., 1], edges[..., 0]], axis=-1) / twice_area[:, None, None]


def _edge_rate(cloth: Cloth) -> tuple[float, float]:
    """Smallest and greatest eigenvalue of the edge rotations' system, from the least to the greatest stiffness
    (nt, 3, 3) that it may have, where dry friction slips and where it sticks, after scaling by the diagonal of the
    greatest."""
    ne, edges, signs = len(cloth.hinges), cloth.triangle_edges, cloth.edge_signs
    stiffness, slips = cloth.edge_stiffness, None
    if cloth.modulus("bend_friction").any():
        slips, stiffness = stiffness, stiffness + stuck_stiffness(cloth.gradients, cloth.areas, cloth.bend_friction)
    diagonal = np.bincount(edges.ravel(), np.einsum("tkk->tk", stiffness).ravel(), ne)
    scale = sp.diags(1 / np.sqrt(diagonal))
    options = dict(k=1, which="LA", v0=np.ones(ne), return_eigenvectors=False)

    def scaled(stiffness) -> sp.csr_matrix:
        values = stiffness * signs[:, :, None]
        values *= signs[:, None, :]
        places = np.repeat(edges, 3, axis=1).ravel(), np.tile(edges, 3).ravel()
        return scale @ sp.csr_matrix((values.ravel(), places), shape=(ne, ne)) @ scale

    greatest = scaled(stiffness)
    least = greatest if slips is None else scaled(slips)
    del stiffness, slips
    high = spla.eigsh(greatest, tol=1e-2, **options)[0]
    low = spla.eigsh(2 * high * sp.identity(ne) - least, tol=1e-3, **options)[0]
    return float(max(2 * high - low, 1e-3 * high) * 0.9), float(high * 1.05)
