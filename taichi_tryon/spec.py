"""What every part of the YAML input has in common."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

Pair = Annotated[list[float], Field(min_length=2, max_length=2)]


class Spec(BaseModel):
    """A mapping in a YAML file: unknown keys and values of the wrong type are faults, and nothing changes later."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, validate_default=True, allow_inf_nan=False)


def fault(message: str, *location: str | int) -> PydanticCustomError:
    """An error to raise in a validator; ``location`` leads from the validated mapping to the value at fault."""
    return PydanticCustomError("fault", "{message}", {"message": message, "location": location})
