"""The precision case in a process of its own: it starts Taichi anew in both precisions."""

import json
import subprocess
import sys
from pathlib import Path

CASE = """
import json
from taichi_tryon import runtime
from taichi_tryon.bench.accuracy import precision
precision.FIGURES = {"uniaxial": precision.FIGURES["uniaxial"]}
found = [(r.quantity, r.value, r.reference, r.passes) for r in precision.records(False)]
print(json.dumps(found))
"""


def test_single_precision_pulls_as_hard_and_settles_less_far():
    project = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", CASE], check=True, timeout=300, capture_output=True, cwd=project)
    (_, f32, _, _), (_, f64, _, _), (quantity, force, reference, passes) = json.loads(done.stdout.splitlines()[-1])
    assert f64 < 1e-6 < f32
    assert quantity == "force" and passes and 0.0 < abs(force / reference - 1) < 1e-4
