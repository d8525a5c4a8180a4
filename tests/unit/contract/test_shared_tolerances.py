"""Tolerances that the core and the validation of requests must share: neither may refuse what the other accepts."""

from __future__ import annotations

from grazemap.wire import linear
from grazemap_core.model import tolerances


def test_validation_rounds_as_the_core_does() -> None:
    assert (linear.FREE_MODE, linear.GROWTH) == (tolerances.FREE_MODE, tolerances.GROWTH)
