"""Parameters of which `make test` takes some, and `make thorough` the others."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import pytest


def every_fourth(values: Iterable[Any]) -> list[Any]:
    """Every fourth value, from the first one, is tested by `make test`."""
    return [value if k % 4 == 0 else pytest.param(value, marks=pytest.mark.thorough) for k, value in enumerate(values)]


def only(quick: Sequence[Any], values: Iterable[Any]) -> list[Any]:
    """Values among `quick` are tested by `make test`."""
    return [value if value in quick else pytest.param(value, marks=pytest.mark.thorough) for value in values]
