"""Parameters of which `make test` takes some, and `make thorough` the others."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def every_fourth(values: Iterable[Any]) -> list[Any]:
    """Every fourth value, from the first one, is tested by `make test`."""
    return [value if k % 4 == 0 else pytest.param(value, marks=pytest.mark.thorough) for k, value in enumerate(values)]
