import subprocess
import sys

import numpy as np

DRAW = """
import sys
import numpy as np
from taichi_tryon import runtime
from taichi_tryon.view.appearance import cloth
from taichi_tryon.view.camera import Camera
from taichi_tryon.view.raster import RasterRenderer
runtime.start("cpu", precision=sys.argv[1], threads=2, offline_cache=False)
points = np.array([[0, 0, 0], [1, 0, 0.1], [0, 1, 0], [1, 1, 0.4]])
triangles = np.array([[0, 1, 2], [1, 3, 2]])
mesh = cloth(points, triangles, points[triangles][:, :, :2], "#8fb3d9", 0.2)
np.save(sys.argv[2], RasterRenderer((96, 72)).render([mesh], Camera(np.array([2, 1, 5.0]), points.mean(axis=0))))
"""


def test_pictures_do_not_depend_on_the_precision_of_the_simulation(tmp_path):
    images = []
    for precision in ("f32", "f64"):
        path = tmp_path / f"{precision}.npy"
        subprocess.run([sys.executable, "-c", DRAW, precision, path], check=True, timeout=120, capture_output=True)
        images.append(np.load(path).astype(int))
    assert np.ptp(images[0]) > 100
    assert np.abs(images[0] - images[1]).max() <= 2
