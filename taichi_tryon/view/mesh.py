"""What the renderers draw: triangle meshes with colours, and the flat arrays that a picture is made from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taichi_tryon.errors import RunError


@dataclass(frozen=True)
class Weave:
    """A woven gingham check in material coordinates, so that the grain of the fabric is seen.

    Attributes:
        coordinates: (nt, 3, 2) m, material coordinates of the triangles' corners; axis 0 warp, axis 1 weft.
        size: width of a stripe, m; a check repeats after two.
        color: (3,) sRGB of the second yarn; the mesh's own colour is that of the first.
    """

    coordinates: np.ndarray
    size: float
    color: tuple[float, float, float]


@dataclass(frozen=True)
class Mesh:
    """Triangles to draw.

    Attributes:
        vertices: (n, 3) m.
        triangles: (m, 3), counter-clockwise seen from outside.
        colors: sRGB in 0..1: one (3,), per vertex (n, 3), or per triangle corner (m, 3, 3).
        normals: (n, 3) or None: then area-weighted from the triangles.
        two_sided: cloth; its inside is seen, darker. Else (closed surfaces) the inside is not drawn.
        weave: a woven check over the colour, or None.
        sheen: strength of the bright rim of fuzzy or soft surfaces.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    colors: np.ndarray | Sequence[float]
    normals: np.ndarray | None = None
    two_sided: bool = True
    weave: Weave | None = None
    sheen: float = 0.06

    @property
    def corner_colors(self) -> np.ndarray:
        """(m, 3, 3) sRGB at the triangles' corners."""
        colors = np.asarray(self.colors, np.float32)
        if colors.ndim == 1:
            return np.broadcast_to(colors, (len(self.triangles), 3, 3))
        if colors.ndim == 2:
            return colors[self.triangles]
        return colors


@dataclass(frozen=True)
class DrawList:
    """Several meshes in one set of arrays (float32, int32), as the kernels want them.

    Attributes:
        vertices, normals: (nv, 3).
        openness: (nv, 2) part of the sky seen from the outer and the inner side, 1 where nothing is near.
        triangles: (nt, 3).
        colors: (nt, 3, 3) linear RGB at the corners.
        weave: (nt, 3, 2) material coordinates in stripes, zero without a weave.
        mesh: (nt,) number of the mesh.
        style: (meshes, 6): two_sided, has a weave, second colour (3, linear), sheen.
    """

    vertices: np.ndarray
    normals: np.ndarray
    openness: np.ndarray
    triangles: np.ndarray
    colors: np.ndarray
    weave: np.ndarray
    mesh: np.ndarray
    style: np.ndarray

    @staticmethod
    def of(meshes: Sequence[Mesh]) -> DrawList:
        """Gather meshes.

        Raises:
            RunError: nothing to draw, or a vertex is not finite.
        """
        meshes = [mesh for mesh in meshes if len(mesh.triangles)]
        if not meshes:
            raise RunError("there is nothing to draw: no mesh has a triangle")
        starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
        vertices = np.concatenate([np.asarray(mesh.vertices, np.float32) for mesh in meshes])
        if not np.isfinite(vertices).all():
            raise RunError("a mesh to draw has a vertex that is not a finite number")
        normals = [
            vertex_normals(mesh.vertices, mesh.triangles) if mesh.normals is None else mesh.normals for mesh in meshes
        ]
        triangles = [np.asarray(mesh.triangles) + start for mesh, start in zip(meshes, starts, strict=True)]
        style = np.zeros((len(meshes), 6), np.float32)
        weave = []
        for row, mesh in zip(style, meshes, strict=True):
            row[0], row[5] = mesh.two_sided, mesh.sheen
            if mesh.weave is None:
                weave.append(np.zeros((len(mesh.triangles), 3, 2), np.float32))
            else:
                row[1], row[2:5] = 1, linear(mesh.weave.color)
                weave.append(np.asarray(mesh.weave.coordinates, np.float32) / np.float32(mesh.weave.size))
        arrays = dict(
            vertices=vertices,
            normals=np.concatenate(normals).astype(np.float32),
            openness=np.ones((len(vertices), 2), np.float32),
            triangles=np.concatenate(triangles).astype(np.int32),
            colors=np.concatenate([linear(mesh.corner_colors) for mesh in meshes]).astype(np.float32),
            weave=np.concatenate(weave),
            mesh=np.repeat(np.arange(len(meshes), dtype=np.int32), [len(mesh.triangles) for mesh in meshes]),
            style=style,
        )
        return DrawList(**{name: np.ascontiguousarray(values) for name, values in arrays.items()})


def vertex_normals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals (n, 3), averaged over the triangles around a vertex with their areas; zero where there is none."""
    corners = np.asarray(vertices, float)[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    index, count = np.asarray(triangles).ravel(), len(vertices)
    total = np.stack([np.bincount(index, np.repeat(area[:, axis], 3), count) for axis in range(3)], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return total / np.where(length > 0, length, 1)


def smoothed(values: np.ndarray, triangles: np.ndarray, rounds: int) -> np.ndarray:
    """Values (n, k) at vertices after some rounds of averaging over the triangles around; lone vertices keep theirs."""
    index = np.asarray(triangles).ravel()
    count = np.bincount(index, minlength=len(values))
    alone = (count == 0)[:, None]
    for _ in range(rounds):
        mean = np.repeat(np.asarray(values)[triangles].mean(axis=1), 3, axis=0)
        total = [np.bincount(index, mean[:, k], len(values)) for k in range(values.shape[1])]
        values = np.where(alone, values, np.stack(total, axis=1) / np.maximum(count, 1)[:, None])
    return values


def linear(srgb: np.ndarray | Sequence[float]) -> np.ndarray:
    """sRGB values in 0..1 to linear light; light adds up only there."""
    return np.clip(np.asarray(srgb, np.float32), 0, 1) ** np.float32(2.2)
