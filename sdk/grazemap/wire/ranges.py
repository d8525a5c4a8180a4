"""Ranges and intervals of a parameter: omega, clearance."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from grazemap.wire.base import Float, Listable, Positive, Request, invalid


class Interval(Request):
    """An interval of a positive parameter, both ends included."""

    start: Positive
    """The minimum value, included."""
    stop: Positive
    """The maximum value, included."""

    @model_validator(mode="after")
    def _ordered(self) -> Interval:
        if not self.stop > self.start:
            raise invalid("stop must be greater than start", "stop > start > 0")
        return self


class Range(Interval):
    """Equally spaced values of a positive parameter, both ends included."""

    points: Annotated[int, Field(ge=2), Listable]
    """Number of values, both ends included."""


def _increasing(values: list[float]) -> list[float]:
    if any(b <= a for a, b in pairwise(values)):
        raise invalid("the values must increase", "an increasing list of numbers > 0")
    return values


def _grid_tag(value: Any) -> str | None:
    if isinstance(value, dict | Range):
        return "[range]"
    return "[list]" if isinstance(value, list | tuple | np.ndarray) else None


Grid = Annotated[
    Annotated[Range, Tag("[range]")]
    | Annotated[
        list[Positive], Field(min_length=2, fail_fast=True), Listable, AfterValidator(_increasing), Tag("[list]")
    ],
    Discriminator(
        _grid_tag,
        custom_error_type="not_allowed",
        custom_error_message="Input should be a range or a list of numbers",
        custom_error_context={
            "allowed": '{"start": .., "stop": .., "points": ..} or an increasing list of numbers > 0'
        },
    ),
]


class CoordinateRange(Request):
    """Equally spaced values of an initial coordinate, of any sign, both ends included."""

    start: Float
    """The minimum value, included."""
    stop: Float
    """The maximum value, included."""
    points: Annotated[int, Field(ge=2), Listable]
    """Number of values, both ends included."""

    @model_validator(mode="after")
    def _ordered(self) -> CoordinateRange:
        if not self.stop > self.start:
            raise invalid("stop must be greater than start", "stop > start")
        return self


def _of_any_sign(values: list[float]) -> list[float]:
    if any(b <= a for a, b in pairwise(values)):
        raise invalid("the values must increase", "an increasing list of numbers")
    return values


def _coordinate_tag(value: Any) -> str | None:
    return "[range]" if isinstance(value, CoordinateRange) else _grid_tag(value)


CoordinateGrid = Annotated[
    Annotated[CoordinateRange, Tag("[range]")]
    | Annotated[
        list[Float], Field(min_length=2, fail_fast=True), Listable, AfterValidator(_of_any_sign), Tag("[list]")
    ],
    Discriminator(
        _coordinate_tag,
        custom_error_type="not_allowed",
        custom_error_message="Input should be a range or a list of numbers",
        custom_error_context={"allowed": '{"start": .., "stop": .., "points": ..} or an increasing list of numbers'},
    ),
]


def grid_points(grid: Range | CoordinateRange | list[float]) -> int:
    """Return the number of values of a range or of a list."""
    return len(grid) if isinstance(grid, list) else grid.points


def grid_values(grid: Range | CoordinateRange | list[float]) -> NDArray[np.float64]:
    """Return the values of a range or of a list, shape (points,), increasing."""
    if not isinstance(grid, list):
        return np.linspace(grid.start, grid.stop, grid.points)
    return np.asarray(grid, dtype=np.float64)
