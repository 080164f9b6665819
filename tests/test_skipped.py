"""What a run says that it left out, held against what it did."""

from types import SimpleNamespace

import numpy as np
import pytest

from taichi_tryon.scene.models import SceneSpec
from taichi_tryon.setup import prepare
from taichi_tryon.skipped import skipped
from taichi_tryon.timing import Stopwatch


@pytest.fixture
def make_setup(make_cone_scene):
    """Makes the cone's Setup, of a ball more, half a metre below, if ``feet``; with values set."""

    def make(feet=False, **values):
        data = make_cone_scene()
        if feet:
            ball = data["body"]["balls"]["ball"]
            data["body"]["groups"].append("feet")
            data["body"]["balls"]["foot"] = {**ball, "center_cm": [0, 20, 0], "radii_cm": [10] * 3, "groups": ["feet"]}
        return prepare(SceneSpec.model_validate({**data, **values}), Stopwatch())

    return make


def reasons(*arguments) -> dict[str, str]:
    return {item["what"]: item["why"] for item in skipped(*arguments)}


def test_switches_that_are_off_skip_nothing(make_setup):
    off = {"far_samples": False, "far_balls": False, "still_body": False, "constant_matrices": False}
    names = {"balls out of reach", "far contact samples", "repeated looks at the body", "motion of the body"}
    assert names <= set(reasons(make_setup(feet=True))) and not names & set(reasons(make_setup(feet=True, skip=off)))
    constant = {"mesh": {"edge_length_mm": 30, "bending": "constant"}}
    assert {"hinges", "assembly of constant matrices"} <= set(reasons(make_setup(**constant)))
    assert "assembly of constant matrices" not in reasons(make_setup(**constant, skip=off))


def test_figures_of_a_run_are_counted(make_setup):
    """Three looks at each of 50 samples, of four that they could have had; 30 looks more were known."""
    setup = make_setup(feet=True, contact={"friction": 0.0})
    expected = "1 of 2 do not reach to the cloth {}; groups without others: feet"
    assert reasons(setup)["balls out of reach"] == expected.format("at the start")
    counts = {"looked": np.full(50, 3), "known": np.repeat([0, 1], [20, 30])}
    contact = SimpleNamespace(
        **{name: SimpleNamespace(to_numpy=lambda values=values: values) for name, values in counts.items()},
        evaluations=4,
        count=50,
    )
    field = SimpleNamespace(ever_near=np.array([True, False]))
    found = reasons(setup, SimpleNamespace(stepper=SimpleNamespace(contact=contact), field=field))
    assert found["balls out of reach"] == expected.format("in the whole run")
    assert found["far contact samples"].endswith("in the mean 10.0 % of 50")
    assert found["repeated looks at the body"].endswith(f"{100 * 30 / 180:.1f} % of the looks of samples awake")
    assert found["friction"] == "contact.friction is 0" and "contact of cloth with cloth" in found
    field.ever_near[1] = True
    run = SimpleNamespace(stepper=SimpleNamespace(contact=contact), field=field)
    assert "balls out of reach" not in reasons(setup, run)
