"""KES figures become the moduli that Table 1 of the paper has in SI, and read back."""

import numpy as np
import pytest
from pydantic import ValidationError

from taichi_tryon.fabric import FabricSpec, Moduli

TABLE1 = dict(
    fabric="table1",
    tensile_warp_gf_per_cm=2440.0,
    tensile_weft_gf_per_cm=2420.0,
    shear_gf_per_cm_degree=1.38,
    bending_warp_gf_cm2_per_cm=0.147,
    bending_weft_gf_cm2_per_cm=0.108,
    bending_bias_gf_cm2_per_cm=0.102,
    weight_gf_per_cm2=0.029,
)


def strip_rigidity(bend: np.ndarray, degrees: float) -> float:
    """Bending rigidity of a strip cut at an angle to the warp."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return bend[0] * c**4 + 2 * (bend[2] + 2 * bend[3]) * s**2 * c**2 + bend[1] * s**4


def test_table_1_in_si():
    moduli = Moduli.from_spec(FabricSpec(**TABLE1))
    assert moduli.stretch == pytest.approx([2392.8, 2373.2, 0.0, 77.54], rel=2e-5)
    assert moduli.mass == pytest.approx(0.29)


@pytest.mark.parametrize(("degrees", "expected"), [(0, 1.4416e-5), (90, 1.0591e-5), (45, 1.0003e-5)])
def test_strips_bend_as_measured(degrees, expected):
    moduli = Moduli.from_spec(FabricSpec(**TABLE1))
    assert strip_rigidity(moduli.bend, degrees) == pytest.approx(expected, rel=5e-5)


def test_poisson_couples_warp_and_weft():
    moduli = Moduli.from_spec(FabricSpec(**TABLE1, poisson=0.3))
    assert moduli.stretch[2] == pytest.approx(0.3 * np.sqrt(moduli.stretch[0] * moduli.stretch[1]))


def test_friction_is_half_the_width_of_the_loop():
    still = Moduli.from_spec(FabricSpec(**TABLE1))
    assert still.shear_friction == 0 and still.bend_friction == (0, 0)
    width = {"bending_hysteresis_warp_gf_cm_per_cm": 0.06, "bending_hysteresis_weft_gf_cm_per_cm": 0.04}
    rubbing = Moduli.from_spec(FabricSpec(**TABLE1, shear_hysteresis_gf_per_cm=1.0, **width))
    assert rubbing.shear_friction == pytest.approx(0.4903325)
    assert rubbing.bend_friction == pytest.approx((2.941995e-4, 1.96133e-4))


def test_a_negative_width_is_refused():
    with pytest.raises(ValidationError, match="shear_hysteresis_gf_per_cm"):
        FabricSpec(**TABLE1, shear_hysteresis_gf_per_cm=-1.0)


def test_a_fabric_without_resistance_to_twist_is_refused():
    with pytest.raises(ValidationError, match="resistance to twist"):
        FabricSpec(**(TABLE1 | {"bending_bias_gf_cm2_per_cm": 0.06}))
