"""What every part of the YAML input has in common."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

LARGEST = 1e5
"""Coordinates in cm, angles in degrees and speeds in m/s: what is beyond is a slip of the pen or of a program."""
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Pair = Annotated[list[Number], Field(min_length=2, max_length=2)]
Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]


class Spec(BaseModel):
    """A mapping in a YAML file: unknown keys and values of the wrong type are faults, and nothing changes later."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, validate_default=True, allow_inf_nan=False)


def require_direction(vector: list[float], *location: str | int) -> None:
    """Raise where a vector is too short to point anywhere."""
    if not sum(x * x for x in vector) > 1e-12:
        raise fault("a direction cannot be zero", *location)


def fault(message: str, *location: str | int) -> PydanticCustomError:
    """An error to raise in a validator; ``location`` leads from the validated mapping to the value at fault."""
    return PydanticCustomError("fault", "{message}", {"message": message, "location": location})
