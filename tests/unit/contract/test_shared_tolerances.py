"""Tolerances that the core and the validation of requests must share: neither may refuse what the other accepts."""

from __future__ import annotations

from grazemap.wire import linear, states
from grazemap_core.model import tolerances
from grazemap_core.simulation.tolerances import COORDINATE_ROUNDING


def test_validation_rounds_as_the_core_does() -> None:
    assert (linear.FREE_MODE, linear.GROWTH) == (tolerances.FREE_MODE, tolerances.GROWTH)
    assert states.COORDINATE_ROUNDING == COORDINATE_ROUNDING
