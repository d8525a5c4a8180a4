"""Elements of all wire models: strict numbers, lists that may be given as any sequence, ranges and intervals.

Requests refuse unknown fields, responses ignore them, so that an older client reads a newer service.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from inspect import Parameter, Signature
from itertools import pairwise
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    SerializerFunctionWrapHandler,
    Tag,
    ValidationError,
    model_serializer,
    model_validator,
)
from pydantic.config import JsonDict
from pydantic_core import CoreSchema, PydanticCustomError
from pydantic_core.core_schema import ValidatorFunctionWrapHandler, no_info_wrap_validator_function

from grazemap.constants import LARGEST_NUMBER, SMALLEST_NUMBER
from grazemap.errors import ProtocolError
from grazemap.later import Later
from grazemap.wire.error_texts import explained
from grazemap.wire.field_texts import texts_below

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = Later("numpy")

Place = tuple[str, ...]
"""The names and positions that lead to a value, such as ("axis", "values", "0")."""
Places = Mapping[Place, Place]
"""Where values were written, by their places in the long form of a request: ("axis", "values") -> ("omega",)."""
_OF_JSON = frozenset({float, int, bool, str, list, dict, NoneType})


class Request(BaseModel):
    """A request body, or a part of one; wrong fields raise pydantic's ValidationError, which names them.

    The text below a field is its description in the API's document; a field without a text has that of its type, such
    as `states.MaxPeriods`.
    """

    model_config = ConfigDict(
        strict=True,
        allow_inf_nan=False,
        extra="forbid",
        frozen=True,
        hide_input_in_errors=True,
        defer_build=True,
    )

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Show help() only the names and defaults of the fields; pydantic's signature has long annotations, too."""
        fields = [
            Parameter(name, Parameter.KEYWORD_ONLY, default=Parameter.empty if field.is_required() else field.default)
            for name, field in cls.model_fields.items()
        ]
        cls.__signature__ = Signature(fields)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Put `_validated` around all other validators; it takes over the name of the model in JSON schemas, `ref`."""
        cls.describe_fields()
        model: dict[str, Any] = dict(handler(source))
        return no_info_wrap_validator_function(cls._validated, model, ref=model.pop("ref", None))

    @classmethod
    def build(cls) -> None:
        """Build the validator now and not when it is first used, as a service does before it takes requests."""
        cls.model_config["defer_build"] = False
        cls.model_rebuild(force=True)

    @classmethod
    def describe_fields(cls) -> None:
        """Give the fields the descriptions that stand below them; validation and JSON schemas do so themselves."""
        for name, text in texts_below(cls).items():
            if name in cls.model_fields and cls.model_fields[name].description is None:
                cls.model_fields[name].description = text

    @classmethod
    def _validated(cls, values: Any, handler: ValidatorFunctionWrapHandler) -> Self:
        """Validate a request; an error says what is wrong, what is allowed, and where it was written."""
        try:
            body, places = cls.long_form(values)
        except PydanticCustomError as error:
            detail = {"type": error.type, "loc": (), "msg": error.message(), "ctx": error.context or {}}
            raise ValidationError.from_exception_data(cls.__name__, [explained(detail, cls)], hide_input=True) from None
        try:
            request: Self = handler(body)
        except ValidationError as error:
            details = [explained(item, cls) for item in error.errors(include_url=False, include_input=False)]
            for entry in details:
                entry["loc"] = as_written(entry["loc"], places)
            raise ValidationError.from_exception_data(error.title, details, hide_input=True) from None
        if places:
            object.__setattr__(request, "written_places", places)
        return request

    @classmethod
    def long_form(cls, values: Any) -> tuple[Any, Places]:
        """Return the long form of a body that may be in a short form, and where values were written that moved."""
        return values, {}

    @cached_property
    def written_places(self) -> Places:
        """Where the parts of this request were written that stand elsewhere in its long form."""
        return {}

    def pointer_as_written(self, pointer: str) -> str:
        """Return the JSON pointer to where a value was written, from the pointer in the long form of this request."""
        return "".join(f"/{part}" for part in as_written(tuple(pointer.split("/")[1:]), self.written_places))

    def _replace(self, name: str, value: object) -> None:
        """Replace a field by what the validation of this model makes of it, although the model is frozen."""
        object.__setattr__(self, name, value)

    def unused(self) -> Collection[str]:
        """Return the names of fields without effect because of other fields; the canonical text lacks them."""
        return ()

    def canonical(self) -> dict[str, Any]:
        """Return the request as plain JSON values with every default filled in; equal requests have equal ones."""
        folded: dict[str, Any] = _folded(self.model_dump(mode="json"))
        return folded

    @model_serializer(mode="wrap")
    def _without_unused(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        unused = self.unused()
        return {name: value for name, value in dump(self).items() if name not in unused}


def _folded(value: Any) -> Any:
    """Return JSON values with 0.0 in place of -0.0."""
    if isinstance(value, float):
        return value + 0.0
    if isinstance(value, list):
        return [_folded(item) for item in value]
    if isinstance(value, dict):
        return {key: _folded(item) for key, item in value.items()}
    return value


class Response(BaseModel):
    """An answer of the service, or a part of one."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    @classmethod
    def read(cls, content: bytes) -> Self:
        """Return the answer that the service sent as JSON. Raises ProtocolError."""
        try:
            return cls.model_validate_json(content)
        except ValidationError as error:
            raise ProtocolError(f"the answer is not a {cls.__name__} of a grazemap service") from error


def invalid(message: str, allowed: str, *at: str, value: str = "") -> PydanticCustomError:
    """Return the error that a validator raises: what is wrong, what is allowed, and in which field below.

    Neither text may contain a value that was sent. `value` is the wrong value, which only a client shows.
    """
    context = {"detail": message, "allowed": allowed, "at": at, "value": f", {value}" if value else ""}
    return PydanticCustomError("not_allowed", "{detail}{value} (allowed: {allowed})", context)


def without_nulls(body: Mapping[str, Any], names: Collection[str]) -> dict[str, Any]:
    """Return a body without those of some fields that are null."""
    return {name: value for name, value in body.items() if value is not None or name not in names}


def parts_in_long_form(body: Any, parts: Mapping[str, type[Request]]) -> tuple[Any, Places]:
    """Return a body whose parts may be written in short forms, as `Request.long_form` returns them."""
    if not isinstance(body, dict):
        return body, {}
    changed, places = dict(body), dict[Place, Place]()
    for name, model in parts.items():
        if name in body:
            changed[name], below = model.long_form(body[name])
            places |= {(name, *place): (name, *written) for place, written in below.items()}
    return changed, places


def as_written(place: tuple[str | int, ...], places: Places) -> tuple[str | int, ...]:
    """Return where a value was written, from its place in the long form of a request."""
    for length in range(len(place), 0, -1):
        above = places.get(tuple(map(str, place[:length])))
        if above is not None:
            return (*above, *place[length:])
    return place


def plain(value: Any) -> Any:
    """Return mappings as dicts, sequences and arrays as lists, numpy's numbers as numbers, and the rest unchanged."""
    if type(value) in _OF_JSON:
        return value
    if isinstance(value, Mapping):
        return dict(value)
    if hasattr(value, "__array__"):
        return np.asarray(value).tolist()
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str | bytes) else value


@dataclass(frozen=True)
class Kind:
    """Names a type of fields, for which a client may take further forms, such as a tuple for an interval."""

    name: str
    """The type's name."""


def _sized(value: float) -> float:
    """Refuse a number whose powers would overflow or underflow. No quantity is so large or small in any unit."""
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
# A field that is left out of a request's text where it is None, False or empty (or 0), so that requests keep the text
# that they had before the field existed. That value has to be the default.
LeftOut = Field(exclude_if=lambda value: not value)
# Takes sequences and arrays for lists, and numpy's numbers for numbers (`plain`). Written after all bounds: those after
# it would not get into the JSON schema.
Listable = BeforeValidator(plain)
Count = Annotated[int, Field(ge=1), Listable]
OptionalCount = Annotated[int, Field(ge=0), Listable]
Share = Annotated[float, Field(ge=0, le=1), Listable]
_Item = TypeVar("_Item")
# These lists fail fast: naming each of a million wrong numbers would take seconds.
NonEmpty = Annotated[list[_Item], Field(min_length=1, fail_fast=True), Listable]
Float = Annotated[float, _OF_ANY_SIGN_SIZED, Sized, Listable]
Positive = Annotated[float, _POSITIVE_SIZED, Sized, Listable]
NonNegative = Annotated[float, _NON_NEGATIVE_SIZED, Sized, Listable]


class Interval(Request):
    """An interval of a parameter, both ends included."""

    start: Float
    """The minimum value."""
    stop: Float
    """The maximum value."""

    @model_validator(mode="after")
    def _is_ordered(self) -> Self:
        if not self.stop > self.start:
            raise invalid("stop must be greater than start", "stop > start")
        return self


class Range(Interval):
    """Equally spaced values of a parameter, both ends included."""

    points: Annotated[int, Field(ge=2), Listable]
    """Number of values, with both ends."""


class PositiveInterval(Interval):
    """An interval of a positive parameter, both ends included."""

    start: Positive
    """The minimum value."""
    stop: Positive
    """The maximum value."""

    @classmethod
    def long_form(cls, values: Any) -> tuple[Any, Places]:
        """As `Request.long_form`, also of an interval or a range of any parameter."""
        is_other = isinstance(values, Interval) and not isinstance(values, cls)
        return (values.model_dump() if is_other else values), {}


class PositiveRange(PositiveInterval, Range):
    """Equally spaced values of a positive parameter, both ends included."""


def _increases(values: list[float]) -> list[float]:
    if any(after <= before for before, after in pairwise(values)):
        raise invalid("the values must increase", "an increasing list of numbers")
    return values


def is_range_or_list(value: Any) -> bool:
    """Return whether a value is written as a range, an interval or a list; a mapping always is."""
    return isinstance(value, Interval) or grid_tag(value) is not None


def grid_tag(value: Any) -> str | None:
    """Return the tag of a range (a mapping) or of a list (also a tuple or an array), None for anything else."""
    if isinstance(value, dict | Range):
        return "[range]"
    several = isinstance(value, list | tuple) or getattr(value, "ndim", 0) > 0
    return "[list]" if several else None


_SEVERAL = Field(min_length=2, fail_fast=True)
_RANGE_OR_LIST = Discriminator(
    grid_tag,
    custom_error_type="not_allowed",
    custom_error_message="Input should be a range or a list of numbers",
    custom_error_context={"allowed": '{"start": .., "stop": .., "points": ..} or an increasing list of numbers'},
)
_Range = TypeVar("_Range", bound=Range)
_Number = TypeVar("_Number", bound=float)
_GridOf = Annotated[
    Annotated[_Range, Tag("[range]")]
    | Annotated[list[_Number], _SEVERAL, Listable, AfterValidator(_increases), Tag("[list]")],
    _RANGE_OR_LIST,
    Kind("grid"),
]
Grid = _GridOf[Range, Float]
PositiveGrid = _GridOf[PositiveRange, Positive]


def grid_points(grid: Range | list[float]) -> int:
    """Return the number of values of a range or of a list."""
    return len(grid) if isinstance(grid, list) else grid.points


def grid_values(grid: Range | list[float]) -> NDArray[np.float64]:
    """Return the values of a range or of a list, shape (points,), increasing."""
    if not isinstance(grid, list):
        return np.linspace(grid.start, grid.stop, grid.points)
    return np.asarray(grid, dtype=np.float64)
