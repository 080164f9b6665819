"""Which lists on the command line are values and which are swept over, and that the product is in order."""

import pytest

from taichi_tryon.errors import InputError
from taichi_tryon.scene.sweep import spread


@pytest.mark.parametrize(
    "text",
    [
        "mesh.edge_length_mm=20",
        "gravity_m_s2=[0, -9.81, 0]",
        "output.views=[front]",
        "garments.0.sheet.size_cm=[10, 20]",
        "garments.0.holds.corners.points_cm=[[0, 0], [1, 2]]",
        "garments=[{name: a}]",
        "mesh={edge_length_mm: 20}",
        "no.such.key=[1, 2]",
        "gravity_m_s2.1=-5",
        "mesh.edge_length_mm",
    ],
)
def test_a_value_is_left_as_it_is(text):
    (variant,) = spread([text])
    assert variant.overrides == (text,) and variant.parameters == {}


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("mesh.edge_length_mm=[20, 30.5]", [20, 30.5]),
        ("mesh.bending=[mid_edge, constant]", ["mid_edge", "constant"]),
        ("gravity_m_s2=[[0, -9.81, 0], [0, 0, 0]]", [[0, -9.81, 0], [0, 0, 0]]),
        ("gravity_m_s2.1=[-5, 0]", [-5, 0]),
        ("contact.layers=[null, {}]", [None, {}]),
        ("garments.0.fabric=[a.yaml, b.yaml]", ["a.yaml", "b.yaml"]),
        ("garments.0.fabric.weight_gf_per_cm2=[1e-2]", [0.01]),
        ("garments.0.holds.corners.points_cm=[[[0, 0]], [[1, 2]]]", [[[0, 0]], [[1, 2]]]),
    ],
)
def test_a_list_deeper_than_the_key_takes_is_swept_over(text, values):
    key = text.partition("=")[0]
    assert [variant.parameters for variant in spread([text])] == [{key: value} for value in values]


def test_several_keys_give_the_product_and_what_is_set_once_stays():
    found = spread(["mesh.edge_length_mm=[20, 30]", "solver.threads=1", "contact.friction=[0, 0.3]"])
    pairs = [(20, 0), (20, 0.3), (30, 0), (30, 0.3)]
    assert [tuple(variant.parameters.values()) for variant in found] == pairs
    assert found[1].overrides == ("mesh.edge_length_mm=20", "solver.threads=1", "contact.friction=0.3")


@pytest.mark.parametrize(
    ("texts", "fault"),
    [
        (["mesh.edge_length_mm=[]"], "--set mesh.edge_length_mm=.*an empty list"),
        (["mesh.edge_length_mm=[1, 2]", "mesh.edge_length_mm=3"], "mesh.edge_length_mm: is swept and set twice"),
        (["mesh.edge_length_mm=[1, 2"], "--set mesh.edge_length_mm=.*not valid YAML"),
    ],
)
def test_faults(texts, fault):
    with pytest.raises(InputError, match=fault):
        spread(texts)
