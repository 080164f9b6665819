"""What a run leaves out because its scene does not need it, where no other key says so."""

from __future__ import annotations

from pydantic import Field

from taichi_tryon.spec import Spec


class SkipSpec(Spec):
    """What is left out because the scene does not need it; the result is the same, bit for bit. To measure what each
    saves, set it to false."""

    far_samples: bool = Field(True, description="looking at samples of the cloth that cannot have come near the body")
    far_balls: bool = Field(True, description="balls of the body that do not reach to where the cloth is")
    still_body: bool = Field(
        True, description="posing a body that stands still, and looking at it again where the cloth has not moved"
    )
    constant_matrices: bool = Field(True, description="assembling again those blocks of the matrix that never change")
