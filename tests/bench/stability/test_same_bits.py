"""Every scene in two processes: the same start, to the last bit. The suite's case same_bits runs them to their ends."""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
SCENES = sorted((ROOT / "configs" / "scenes").glob("*.yaml"))


def digests() -> dict[str, str]:
    """Of all arrays from which each scene starts, its triangles being coarse."""
    from taichi_tryon.scene.load import load_scene
    from taichi_tryon.setup import prepare
    from taichi_tryon.timing import Stopwatch

    found = {}
    for path in SCENES:
        setup = prepare(load_scene(path, ("mesh.edge_length_mm=40",)), Stopwatch())
        arrays = [setup.positions, setup.velocities, setup.holds.leader, *vars(setup.cloth).values()]
        whole = hashlib.sha256()
        for array in arrays:
            whole.update(array.tobytes() if hasattr(array, "tobytes") else repr(array).encode())
        found[path.stem] = whole.hexdigest()
    return found


def test_every_scene_starts_the_same_whatever_came_before():
    """Sets of names come in another order in each process; one has loaded NumPy, with two threads for its products,
    before the package."""
    code = f"import json, runpy; print(json.dumps(runpy.run_path({__file__!r})['digests']()))"
    one, other = (
        json.loads(subprocess.run([sys.executable, "-c", first + code], env={**os.environ, **variables},
                                  check=True, capture_output=True, text=True, cwd=ROOT).stdout.splitlines()[-1])
        for first, variables in (
            ("", {"PYTHONHASHSEED": "1"}),
            ("import numpy, scipy.linalg; ", {"PYTHONHASHSEED": "2", "OPENBLAS_NUM_THREADS": "2"}),
        )
    )  # fmt: skip
    assert list(one) == [path.stem for path in SCENES] and len(one) > 5
    assert one == other
