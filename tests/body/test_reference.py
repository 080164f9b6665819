"""The default body against an independent mesh of a woman of the same size and pose; skips without it."""

from pathlib import Path

import numpy as np
import pytest

from taichi_tryon.body.density import gap

MESH = Path(__file__).resolve().parents[3] / "shared" / "body" / "ref_9AR_A45.obj"


@pytest.mark.skipif(not MESH.exists(), reason="the reference mesh is not part of the project")
def test_mean_distance_to_the_reference_mesh(woman):
    vertices, faces = _read(MESH)
    samples = _spread(vertices, faces, 60000)
    distances = np.abs(gap(woman.balls, samples[_garment_area(woman, samples)]))
    assert distances.mean() < 0.8e-3
    assert np.percentile(distances, 95) < 2.2e-3
    assert distances.max() < 10e-3


def _read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) [m] and triangles (m, 3) of an OBJ file in centimetres."""
    vertices, triangles = [], []
    for line in path.read_text().splitlines():
        if line.startswith("v "):
            vertices.append([float(word) / 100 for word in line.split()[1:4]])
        elif line.startswith("f "):
            corners = [int(word.split("/")[0]) - 1 for word in line.split()[1:]]
            triangles += [[corners[0], b, c] for b, c in zip(corners[1:], corners[2:], strict=False)]
    return np.array(vertices), np.array(triangles)


def _spread(vertices: np.ndarray, triangles: np.ndarray, count: int) -> np.ndarray:
    """Points (count, 3) spread evenly over the triangles."""
    random = np.random.default_rng(5)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = triangles[random.choice(len(triangles), count, p=areas / areas.sum())]
    return np.einsum("ki,kij->kj", random.dirichlet((1, 1, 1), count), vertices[chosen])


def _garment_area(body, points: np.ndarray) -> np.ndarray:
    """Whether points (k, 3) lie from the neck to the ankles and up to the wrists: no head, hands or feet."""
    heads = body.skeleton.heads
    elbow, wrist = heads[body.skeleton.index("lowerarm_l")], heads[body.skeleton.index("hand_l")]
    beyond_wrist = (points * np.where(points[:, :1] < 0, [-1.0, 1.0, 1.0], 1.0) - wrist) @ (wrist - elbow) > 0
    low, high = body.landmarks["ankle_line_l"].position[1], body.landmarks["nape"].position[1]
    return (points[:, 1] > low) & (points[:, 1] < high) & ~beyond_wrist
