"""Ranges and intervals of a parameter: omega, clearance."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from grazemap.models.base import Listable, Positive, Request, invalid


class Interval(Request):
    """An interval of a positive parameter, both ends included."""

    start: Positive
    stop: Positive

    @model_validator(mode="after")
    def _ordered(self) -> Interval:
        if not self.stop > self.start:
            raise invalid("stop must be greater than start", "stop > start > 0")
        return self


class Range(Interval):
    """Equally spaced values of a positive parameter, both ends included."""

    points: Annotated[int, Field(ge=2), Listable]


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


def grid_points(grid: Range | list[float]) -> int:
    """Return how many values a range or an explicit list has."""
    return grid.points if isinstance(grid, Range) else len(grid)


def grid_values(grid: Range | list[float]) -> NDArray[np.float64]:
    """Return the values of a range or of an explicit list, shape (points,), increasing."""
    if isinstance(grid, Range):
        return np.linspace(grid.start, grid.stop, grid.points)
    return np.asarray(grid, dtype=np.float64)
