"""The ring stands around the spot, in the whole picture and from near."""

import numpy as np

from taichi_tryon.view.mesh import Mesh
from taichi_tryon.view.spot import draw_spot


def test_a_ring_around_the_spot(raster, shapes):
    vertices, triangles, _ = shapes.sheet()
    mesh = Mesh(vertices, triangles, (0.4, 0.6, 0.4))
    spot = np.array([0.3, -0.2, 0.0])
    picture = draw_spot(raster, [mesh], (vertices.min(axis=0), vertices.max(axis=0)), spot, np.array([0, 0, -1.0]), "")
    width, height = raster.size
    assert picture.shape == (height, 2 * width, 3)
    red = (picture[..., 0] > 190) & (picture[..., 1] < 60)
    whole, near = np.argwhere(red[:, :width]), np.argwhere(red[:, width:])
    # from behind, where the normal points: +x is to the left
    scale = height * 0.9
    expected = np.array([height / 2 + 0.2 * scale, width / 2 - 0.3 * scale])
    assert np.abs(whole.mean(axis=0) - expected).max() < 3
    assert np.abs(near.mean(axis=0) - [height / 2, width / 2]).max() < 1.5
