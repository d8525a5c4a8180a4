"""Parameters of which `make test` takes some, and `make thorough` the others."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import pytest

KERNELS_FIRST = pytest.mark.thorough
"""For tests that first compile kernels which no test of `make test` uses, as those of maps for one or two masses."""


def every_fourth(values: Iterable[Any]) -> list[Any]:
    """Every fourth value, from the first one, is tested by `make test`."""
    return _some(values, lambda place: place % 4 == 0)


def the_first(count: int, values: Iterable[Any]) -> list[Any]:
    """The first few values are tested by `make test`."""
    return _some(values, lambda place: place < count)


def _some(values: Iterable[Any], quick: Callable[[int], bool]) -> list[Any]:
    return [
        value
        if quick(place)
        else pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=pytest.mark.thorough)
        for place, value in enumerate(values)
    ]
