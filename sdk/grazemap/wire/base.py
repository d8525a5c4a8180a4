"""Elements of all wire models: strict numbers, lists that may be given as any sequence, ranges and intervals.

Requests refuse unknown fields, responses ignore them, so that an older client reads a newer service.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from inspect import Parameter, Signature
from itertools import pairwise
from types import NoneType
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    ModelWrapValidatorHandler,
    SerializerFunctionWrapHandler,
    Tag,
    ValidationError,
    model_serializer,
    model_validator,
)
from pydantic.config import JsonDict
from pydantic_core import PydanticCustomError

from grazemap.constants import LARGEST_NUMBER, SMALLEST_NUMBER
from grazemap.errors import ProtocolError
from grazemap.wire.error_texts import explained

_OF_JSON = frozenset({float, int, bool, str, list, dict, NoneType})


class Request(BaseModel):
    """A request body, or a part of one; wrong fields raise pydantic's ValidationError, which names them.

    The text below a field is its description in the API's document.
    """

    model_config = ConfigDict(
        strict=True,
        allow_inf_nan=False,
        extra="forbid",
        frozen=True,
        hide_input_in_errors=True,
        use_attribute_docstrings=True,
    )

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Give help() the names and defaults of the fields alone; pydantic's signature has all their annotations."""
        fields = [
            Parameter(name, Parameter.KEYWORD_ONLY, default=Parameter.empty if one.is_required() else one.default)
            for name, one in cls.model_fields.items()
        ]
        cls.__signature__ = Signature(fields)

    @model_validator(mode="wrap")
    @classmethod
    def _says_what_is_allowed(cls, values: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Validate the fields; an error says what is wrong and what is allowed as that of a request does."""
        try:
            return handler(values)
        except ValidationError as error:
            details = [explained(one, cls) for one in error.errors(include_url=False, include_input=False)]
            raise ValidationError.from_exception_data(error.title, details, hide_input=True) from None

    def unused(self) -> Collection[str]:
        """Return the names of fields that other fields leave without meaning; the canonical text lacks them."""
        return ()

    @model_serializer(mode="wrap")
    def _without_unused(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        unused = self.unused()
        return {name: value for name, value in dump(self).items() if name not in unused}


class Response(BaseModel):
    """An answer of the service, or a part of one."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    @classmethod
    def read(cls, content: bytes) -> Self:
        """Return the answer that the service sent as JSON. Raises ProtocolError."""
        try:
            return cls.model_validate_json(content)
        except ValidationError as error:
            raise ProtocolError(f"the answer is not a {cls.__name__.lower()} of a grazemap service") from error


def invalid(message: str, allowed: str, *at: str, value: str = "") -> PydanticCustomError:
    """Return the error that a validator raises: what is wrong, what is allowed, and in which field below.

    Neither text may contain a value that was sent; `value` is the one that is wrong, which only a client repeats.
    """
    context = {"detail": message, "allowed": allowed, "at": at, "value": f", {value}" if value else ""}
    return PydanticCustomError("not_allowed", "{detail}{value} (allowed: {allowed})", context)


def plain(value: Any) -> Any:
    """Return mappings as dicts, sequences and whatever numpy reads as lists or numbers, and the rest as it is."""
    if type(value) in _OF_JSON:
        return value
    if isinstance(value, Mapping):
        return dict(value)
    if hasattr(value, "__array__"):
        return np.asarray(value).tolist()
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str | bytes) else value


@dataclass(frozen=True)
class Kind:
    """Names a type of fields: a client may take further forms of its values, such as a tuple for an interval."""

    name: str
    """The type's name."""


def _sized(value: float) -> float:
    """Return a number unless its powers would overflow or underflow; no quantity is so large or small in any unit."""
    if value != 0.0 and not SMALLEST_NUMBER <= abs(value) <= LARGEST_NUMBER:
        raise invalid(
            "the number is too large or too small to compute with", "1e-60 to 1e60 in size, or 0 where that is allowed"
        )
    return value


Sized = AfterValidator(_sized)
_LARGEST: JsonDict = {"maximum": LARGEST_NUMBER}
_NOT_TINY: JsonDict = {"exclusiveMinimum": 0, "exclusiveMaximum": SMALLEST_NUMBER}
_NOT_TINY_NEGATIVE: JsonDict = {"exclusiveMinimum": -SMALLEST_NUMBER, "exclusiveMaximum": 0}
# The same bounds in the JSON schema.
_OF_ANY_SIGN_SIZED = Field(
    json_schema_extra=_LARGEST | {"minimum": -LARGEST_NUMBER, "not": {"anyOf": [_NOT_TINY, _NOT_TINY_NEGATIVE]}}
)
_POSITIVE_SIZED = Field(gt=0, json_schema_extra=_LARGEST | {"minimum": SMALLEST_NUMBER})
_NON_NEGATIVE_SIZED = Field(ge=0, json_schema_extra=_LARGEST | {"not": _NOT_TINY})
# Of a field that is left out of a request's text where it is None, False or empty, as before it existed.
LeftOut = Field(exclude_if=lambda value: not value)
# Last in an Annotated: bounds written after it would not get into the JSON schema.
Listable = BeforeValidator(plain)
# Lists of these fail fast: naming each of a million wrong numbers would take seconds.
Float = Annotated[float, _OF_ANY_SIGN_SIZED, Sized, Listable]
Positive = Annotated[float, _POSITIVE_SIZED, Sized, Listable]
NonNegative = Annotated[float, _NON_NEGATIVE_SIZED, Sized, Listable]


class _Ordered(Request):
    """Base of models with a start and a greater stop."""

    order: ClassVar[str] = "stop > start > 0"

    start: float
    stop: float

    @model_validator(mode="after")
    def _is_ordered(self) -> Self:
        if not self.stop > self.start:
            raise invalid("stop must be greater than start", self.order)
        return self


class Interval(_Ordered):
    """An interval of a positive parameter, both ends included."""

    start: Positive
    """The minimum value, included."""
    stop: Positive
    """The maximum value, included."""


class SignedInterval(_Ordered):
    """An interval of a parameter that varies, both ends included.

    Of restitution it is between 0 and 1. Only a clearance of one stop, and the factor of the bias, may be negative.
    """

    order: ClassVar[str] = "stop > start"

    start: Float
    """The minimum value, included."""
    stop: Float
    """The maximum value, included."""


class BranchInterval(SignedInterval):
    """An interval of a parameter that is not negative, both ends included; of restitution between 0 and 1."""

    order: ClassVar[str] = "stop > start >= 0"

    start: NonNegative
    """The minimum value, included."""
    stop: Positive
    """The maximum value, included."""


class Range(Interval):
    """Equally spaced values of a positive parameter, both ends included."""

    points: Annotated[int, Field(ge=2), Listable]
    """Number of values, both ends included."""


class CoordinateRange(_Ordered):
    """Equally spaced values of an initial coordinate, of any sign, both ends included."""

    order: ClassVar[str] = "stop > start"

    start: Float
    """The minimum value, included."""
    stop: Float
    """The maximum value, included."""
    points: Annotated[int, Field(ge=2), Listable]
    """Number of values, both ends included."""


def _increasing(allowed: str) -> AfterValidator:
    def checked(values: list[float]) -> list[float]:
        if any(b <= a for a, b in pairwise(values)):
            raise invalid("the values must increase", allowed)
        return values

    return AfterValidator(checked)


def grid_tag(value: Any) -> str | None:
    """Return the tag of a range or of a list, None for anything else."""
    if isinstance(value, dict | Range | CoordinateRange):
        return "[range]"
    return "[list]" if isinstance(value, list | tuple | np.ndarray) else None


def _range_or_list(allowed: str) -> Discriminator:
    return Discriminator(
        grid_tag,
        custom_error_type="not_allowed",
        custom_error_message="Input should be a range or a list of numbers",
        custom_error_context={"allowed": f'{{"start": .., "stop": .., "points": ..}} or {allowed}'},
    )


_POSITIVE = "an increasing list of numbers > 0"
_OF_ANY_SIGN = "an increasing list of numbers"
_SEVERAL = Field(min_length=2, fail_fast=True)
GridRange = Annotated[Range, Tag("[range]")]
GridList = Annotated[list[Positive], _SEVERAL, Listable, _increasing(_POSITIVE), Tag("[list]")]
Grid = Annotated[GridRange | GridList, _range_or_list(_POSITIVE), Kind("grid")]
CoordinateGrid = Annotated[
    Annotated[CoordinateRange, Tag("[range]")]
    | Annotated[list[Float], _SEVERAL, Listable, _increasing(_OF_ANY_SIGN), Tag("[list]")],
    _range_or_list(_OF_ANY_SIGN),
    Kind("grid"),
]


def grid_points(grid: Range | CoordinateRange | list[float]) -> int:
    """Return the number of values of a range or of a list."""
    return len(grid) if isinstance(grid, list) else grid.points


def grid_values(grid: Range | CoordinateRange | list[float]) -> NDArray[np.float64]:
    """Return the values of a range or of a list, shape (points,), increasing."""
    if not isinstance(grid, list):
        return np.linspace(grid.start, grid.stop, grid.points)
    return np.asarray(grid, dtype=np.float64)
