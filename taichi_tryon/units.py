"""The units of pattern makers and fabric testers, each as its value in SI: ``length = 12.0 * MM``, ``angle / DEGREE``.

The Kawabata system (KES) states forces in gram-force per centimetre of fabric width, and weight as gram-force per
square centimetre: the weight of so much mass.
"""

from __future__ import annotations

import math

MM = 1e-3
"""Millimetre [m]."""
CM = 1e-2
"""Centimetre [m]."""
DEGREE = math.pi / 180.0
"""Degree [rad]."""
STANDARD_GRAVITY = 9.80665
"""The acceleration in the definition of the gram-force [m/s^2]."""
GF = 1e-3 * STANDARD_GRAVITY
"""Gram-force [N]."""

GF_PER_CM = GF / CM
"""Tensile rigidity of 1 gf/cm [N/m]."""
GF_PER_CM_DEGREE = GF / (CM * DEGREE)
"""Shear rigidity of 1 gf/(cm degree) [N/m per rad]."""
GF_CM2_PER_CM = GF * CM**2 / CM
"""Bending rigidity of 1 gf cm^2/cm [N m]: bending moment per width and curvature."""
GF_CM_PER_CM = GF * CM / CM
"""Bending moment per width of 1 gf cm/cm [N]."""
GF_PER_CM2_MASS = GF / STANDARD_GRAVITY / CM**2
"""Areal density of a fabric weighing 1 gf/cm^2 [kg/m^2]."""
