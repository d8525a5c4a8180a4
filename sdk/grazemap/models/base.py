"""What every wire model shares: strict numbers, list fields that take tuples and arrays, names of number types.

Requests refuse unknown fields, responses ignore them, so that an older client reads a newer service.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError


class Request(BaseModel):
    """A request body, or a part of one."""

    model_config = ConfigDict(strict=True, allow_inf_nan=False, extra="forbid", frozen=True)


class Response(BaseModel):
    """What the service answers, or a part of it."""

    model_config = ConfigDict(extra="ignore", frozen=True)


def invalid(message: str, allowed: str) -> PydanticCustomError:
    """Return the error that a validator raises: what is wrong, and what would be right.

    Neither text may contain the value that was sent.
    """
    return PydanticCustomError("not_allowed", "{reason}", {"reason": message, "allowed": allowed})


def _as_list(value: Any) -> Any:
    """Let Python callers pass tuples and numpy arrays where JSON has a list, numpy scalars where it has a number."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, tuple):
        return [item.item() if isinstance(item, np.generic) else item for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return value


# Last in an Annotated: bounds written after it would not get into the JSON schema.
Listable = BeforeValidator(_as_list)
# Lists of these fail fast: naming each of a million wrong numbers would take seconds.
Float = Annotated[float, Listable]
Positive = Annotated[float, Field(gt=0), Listable]
NonNegative = Annotated[float, Field(ge=0), Listable]
