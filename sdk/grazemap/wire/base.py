"""Elements of all wire models: strict numbers, lists that may be given as tuples and arrays, types of numbers.

Requests refuse unknown fields, responses ignore them, so that an older client reads a newer service.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError

SMALLEST_NUMBER = 1e-60
LARGEST_NUMBER = 1e60


class Request(BaseModel):
    """A request body, or a part of one; wrong fields raise pydantic's ValidationError, which names them.

    The line below a field is its description wherever the API is described.
    """

    model_config = ConfigDict(
        strict=True,
        allow_inf_nan=False,
        extra="forbid",
        frozen=True,
        hide_input_in_errors=True,
        use_attribute_docstrings=True,
    )


class Response(BaseModel):
    """An answer of the service, or a part of one."""

    model_config = ConfigDict(extra="ignore", frozen=True)


def invalid(message: str, allowed: str, *at: str) -> PydanticCustomError:
    """Return the error that a validator raises: what is wrong, what is allowed, and in which field below.

    Neither text may contain the value that was sent.
    """
    context = {"reason": message, "allowed": allowed, "at": at}
    return PydanticCustomError("not_allowed", "{reason} (allowed: {allowed})", context)


def _as_list(value: Any) -> Any:
    """Return a list for a tuple or an array, a number for a numpy scalar, and anything else as it is."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, tuple):
        return [item.item() if isinstance(item, np.generic) else item for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return value


def _sized(value: float) -> float:
    """Return a number unless its powers would overflow or underflow; no quantity is so large or small in any unit."""
    if value != 0.0 and not SMALLEST_NUMBER <= abs(value) <= LARGEST_NUMBER:
        raise invalid("the number is too large or too small to compute with", "0, or 1e-60 to 1e60 in size")
    return value


Sized = AfterValidator(_sized)
# Last in an Annotated: bounds written after it would not get into the JSON schema.
Listable = BeforeValidator(_as_list)
# Lists of these fail fast: naming each of a million wrong numbers would take seconds.
Float = Annotated[float, Sized, Listable]
Positive = Annotated[float, Field(gt=0), Sized, Listable]
NonNegative = Annotated[float, Field(ge=0), Sized, Listable]
