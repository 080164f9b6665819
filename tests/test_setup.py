"""What a simulation starts from: several garments, in the order of layers, each of its own fabric."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from taichi_tryon.body.density import gap
from taichi_tryon.dressing import place
from taichi_tryon.dressing.check import crossings
from taichi_tryon.dressing.layers import beneath, heights
from taichi_tryon.errors import DressingError
from taichi_tryon.scene.load import load_scene
from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.setup import prepare
from taichi_tryon.timing import Stopwatch

SCENES = Path(__file__).parents[1] / "configs" / "scenes"


def two_cones(data: dict, **dressing_of_lower) -> SceneSpec:
    lower = data["garments"][0]
    upper = deepcopy(lower) | {"name": "upper"}
    upper["fabric"] |= {"weight_gf_per_cm2": 0.058}
    lower["dressing"] |= dressing_of_lower
    return SceneSpec.model_validate(data | {"garments": [lower, upper], "contact": {"layers": {}}})


def test_each_garment_lies_a_layer_further_out_and_has_its_own_fabric(make_cone_scene):
    setup = prepare(two_cones(make_cone_scene()), Stopwatch())
    balls = setup.body.posed(setup.motion.transforms(0.0))
    nearest = [gap(balls, garment.dressed.positions).min() for garment in setup.garments]
    assert nearest[1] - nearest[0] == pytest.approx(3e-3, abs=5e-4)
    masses = [setup.cloth.masses[part.vertices].sum() for part in setup.cloth.parts]
    assert masses[1] == pytest.approx(2 * masses[0])


def test_a_garment_is_laid_over_one_that_stands_off_the_body(make_cone_scene):
    """16 mm of clearance beneath 8 mm: without a look at the one beneath they would change places."""
    setup = prepare(two_cones(make_cone_scene(), clearance_mm=16), Stopwatch())
    lower, upper = setup.garments
    height, _, at_rim = heights(upper.dressed.positions, (lower.dressed.positions, lower.mesh.triangles), np.inf)
    assert height[~at_rim].min() > 2e-3


def test_a_garment_beneath_the_one_that_it_should_lie_over_is_refused(make_cone_scene, monkeypatch):
    monkeypatch.setattr(place, "LIFTS", 0)
    scene = two_cones(make_cone_scene(), clearance_mm=16)
    with pytest.raises(DressingError, match="garment upper starts beneath cone, .*, the first of panel front"):
        prepare(scene, Stopwatch())
    unbound = scene.model_copy(update={"contact": scene.contact.model_copy(update={"layers": None})})
    assert len(prepare(unbound, Stopwatch()).garments) == 2


@pytest.mark.parametrize("name", ["jumpsuit", "shirt_over_trousers", "skirt_twirl"])
def test_scenes_with_layers_start_free_of_crossings_and_in_order(name):
    scene = load_scene(SCENES / f"{name}.yaml", ["mesh.edge_length_mm=30"])
    setup = prepare(scene, Stopwatch())
    assert scene.contact.layers is not None
    assert len(crossings(setup.positions, setup.cloth.triangles)) == 0
    inner, outer = setup.garments[0], setup.garments[-1]
    if inner is not outer:
        assert not beneath(outer.dressed.positions, (inner.dressed.positions, inner.mesh.triangles)).any()


def test_threads_of_the_blas_leave_no_trace():
    """Whoever loaded NumPy before may have given them to it."""
    scene, starts = load_scene(SCENES / "quick.yaml"), []
    for threads in (1, 2):
        with threadpool_limits(limits=threads, user_api="blas"):
            starts.append(prepare(scene, Stopwatch()).positions)
    assert np.array_equal(*starts)


def test_a_sheet_that_would_be_left_with_a_limb_in_it_is_refused_by_name(make_cone_scene):
    data = make_cone_scene()
    fabric = data["garments"][0]["fabric"]
    sheet = {"size_cm": [40, 40], "origin_cm": [-20, 100, 20], "rotation_degree": [-90, 0, 0]}
    data["garments"].append({"name": "cloth", "sheet": sheet, "fabric": fabric})
    with pytest.raises(DressingError, match=r"sheet 'cloth' starts 1\d\d\.\d mm inside the body at \[") as refused:
        prepare(SceneSpec.model_validate(data), Stopwatch())
    assert refused.value.at == ("garments", 1, "sheet", "origin_cm")
    sheet["origin_cm"][1] = 109
    assert len(prepare(SceneSpec.model_validate(data), Stopwatch()).garments) == 2
