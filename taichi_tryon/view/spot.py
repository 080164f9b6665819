"""A picture with one spot marked: all of it, and from near."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from PIL import Image, ImageDraw

from taichi_tryon.view.annotate import annotate
from taichi_tryon.view.camera import VIEWS, Camera, view_camera
from taichi_tryon.view.mesh import Mesh
from taichi_tryon.view.renderer import Renderer

_INK = (208, 28, 36)
# of the distance of the whole picture's camera, how near the other one is; of the height, the ring's radius
NEAR, RING = 0.25, 0.03


def draw_spot(
    renderer: Renderer,
    meshes: Sequence[Mesh],
    bounds: tuple[np.ndarray, np.ndarray],
    spot: np.ndarray,
    outward: np.ndarray,
    caption: str,
) -> np.ndarray:
    """uint8 (h, 2 w, 3): meshes within ``bounds`` [m], and the surroundings of ``spot`` (3,) [m], both from the view
    that best looks against ``outward`` (3,), with a ring around the spot.

    Raises RunError where there is nothing to draw or a vertex is not finite.
    """
    width, height = renderer.size
    name = max(VIEWS, key=lambda view: np.dot(VIEWS[view], outward) / np.linalg.norm(VIEWS[view]))
    whole = view_camera(name, bounds, width / height)
    near = replace(whole, eye=spot + NEAR * (whole.eye - whole.target), target=spot)
    draw = renderer.prepare(meshes)
    pictures = [_ring(renderer.render(draw, camera), camera, spot) for camera in (whole, near)]
    return annotate(np.hstack(pictures), caption)


def _ring(image: np.ndarray, camera: Camera, spot: np.ndarray) -> np.ndarray:
    picture = Image.fromarray(image)
    x, y = camera.project(spot[None], picture.size)[0]
    radius = RING * picture.height
    box = (x - radius, y - radius, x + radius, y + radius)
    ImageDraw.Draw(picture).ellipse(box, outline=_INK, width=max(2, picture.height // 200))
    return np.asarray(picture)
