"""From KES figures, in the units of the KES data sheet, to the moduli of the cloth laws in SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import Field, model_validator

from taichi_tryon import units
from taichi_tryon.spec import Spec, fault


class FabricSpec(Spec):
    """A measured fabric, as the KES apparatus gives it."""

    fabric: str = Field(description="name of the fabric")
    tensile_warp_gf_per_cm: float = Field(ge=1e-3, le=1e9, description="tensile rigidity along the warp")
    tensile_weft_gf_per_cm: float = Field(ge=1e-3, le=1e9, description="tensile rigidity along the weft")
    shear_gf_per_cm_degree: float = Field(ge=1e-6, le=1e6, description="shear rigidity G, mean of warp and weft")
    bending_warp_gf_cm2_per_cm: float = Field(
        ge=1e-9, le=1e6, description="bending rigidity of a strip cut along the warp"
    )
    bending_weft_gf_cm2_per_cm: float = Field(
        ge=1e-9, le=1e6, description="bending rigidity of a strip cut along the weft"
    )
    bending_bias_gf_cm2_per_cm: float | None = Field(
        None,
        ge=1e-9,
        le=1e6,
        description="bending rigidity of a strip cut at 45 degrees; without it, the mean of warp and weft",
    )
    weight_gf_per_cm2: float = Field(ge=1e-6, le=1e3, description="weight of the fabric")
    poisson: float = Field(0.0, ge=0, lt=1, description="coupling nu of warp and weft stretch: C12 = nu sqrt(C11 C22)")
    damping_time_s: float = Field(
        0.0,
        ge=0,
        le=1e3,
        description="internal friction: stress = C (strain + time x strain rate), likewise for bending; 0 = none",
    )
    shear_hysteresis_gf_per_cm: float = Field(
        0.0,
        ge=0,
        le=1e6,
        description="dry friction in shear: width 2HG of the loop at 0.5 degrees, mean of warp and weft; shirting has "
        "0.5 to 2; 0 = none",
    )
    bending_hysteresis_warp_gf_cm_per_cm: float = Field(
        0.0,
        ge=0,
        le=1e6,
        description="dry friction in bending: width 2HB of the loop of a strip cut along the warp, at 0.5 or 1 1/cm; "
        "shirting has 0.03 to 0.1; 0 = none",
    )
    bending_hysteresis_weft_gf_cm_per_cm: float = Field(
        0.0, ge=0, le=1e6, description="the same of a strip cut along the weft; 0 = none"
    )

    @model_validator(mode="after")
    def _positive_definite(self) -> FabricSpec:
        twist = 4 * self.bias - self.bending_warp_gf_cm2_per_cm - self.bending_weft_gf_cm2_per_cm
        if twist <= 0:
            lowest = (self.bending_warp_gf_cm2_per_cm + self.bending_weft_gf_cm2_per_cm) / 4
            raise fault(
                "the fabric would have no resistance to twist: the bias reading must be greater than a quarter of "
                f"warp + weft = {lowest:g} (got {self.bias:g})",
                "bending_bias_gf_cm2_per_cm",
            )
        return self

    @property
    def bias(self) -> float:
        """Bending rigidity at 45 degrees [gf cm^2/cm]."""
        if self.bending_bias_gf_cm2_per_cm is not None:
            return self.bending_bias_gf_cm2_per_cm
        return (self.bending_warp_gf_cm2_per_cm + self.bending_weft_gf_cm2_per_cm) / 2


@dataclass(frozen=True)
class Moduli:
    """Orthotropic moduli in SI.

    stretch: C11, C22, C12, C66 [N/m], of St. Venant-Kirchhoff stress on Green strain (E11, E22, 2 E12).
    bend: D11, D22, D12, D66 [N m], of the energy 1/2 (D11 k11^2 + 2 D12 k11 k22 + D22 k22^2 + D66 (2 k12)^2).
    mass: [kg/m^2]. damping_time: [s].
    shear_friction [N/m] and bend_friction [N m/m] along warp and weft: the greatest dry friction, see ``hysteresis``.
    """

    stretch: np.ndarray
    bend: np.ndarray
    mass: float
    damping_time: float
    shear_friction: float = 0.0
    bend_friction: tuple[float, float] = (0.0, 0.0)

    @staticmethod
    def from_spec(spec: FabricSpec) -> Moduli:
        """Read KES figures as moduli.

        KES stretches a wide, short strip, so that its width cannot shrink: the reading is C11 itself. A strip cut at
        45 degrees bends with 4 B45 = D11 + D22 + 2 D12 + 4 D66; the drape hardly sees D12, which is taken as 0.
        Friction is half the width of a loop, to either side of the elastic line.
        """
        c11 = spec.tensile_warp_gf_per_cm * units.GF_PER_CM
        c22 = spec.tensile_weft_gf_per_cm * units.GF_PER_CM
        c12 = spec.poisson * np.sqrt(c11 * c22)
        d11 = spec.bending_warp_gf_cm2_per_cm * units.GF_CM2_PER_CM
        d22 = spec.bending_weft_gf_cm2_per_cm * units.GF_CM2_PER_CM
        d66 = spec.bias * units.GF_CM2_PER_CM - (d11 + d22) / 4
        return Moduli(
            stretch=np.array([c11, c22, c12, spec.shear_gf_per_cm_degree * units.GF_PER_CM_DEGREE]),
            bend=np.array([d11, d22, 0.0, d66]),
            mass=spec.weight_gf_per_cm2 * units.GF_PER_CM2_MASS,
            damping_time=spec.damping_time_s,
            shear_friction=spec.shear_hysteresis_gf_per_cm / 2 * units.GF_PER_CM,
            bend_friction=(
                spec.bending_hysteresis_warp_gf_cm_per_cm / 2 * units.GF_CM_PER_CM,
                spec.bending_hysteresis_weft_gf_cm_per_cm / 2 * units.GF_CM_PER_CM,
            ),
        )
