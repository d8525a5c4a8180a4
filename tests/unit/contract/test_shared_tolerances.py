"""What the core and the client must share: tolerances, so that neither refuses what the other accepts, and words."""

from __future__ import annotations

from grazemap.results.orbits import CLOSED
from grazemap.wire import linear, states
from grazemap_core.continuation.pseudo_arclength import ENDS
from grazemap_core.model import tolerances
from grazemap_core.simulation.tolerances import COORDINATE_ROUNDING


def test_validation_rounds_as_the_core_does() -> None:
    assert (linear.FREE_MODE, linear.GROWTH) == (tolerances.FREE_MODE, tolerances.GROWTH)
    assert states.COORDINATE_ROUNDING == COORDINATE_ROUNDING


def test_a_branch_is_closed_where_the_core_says_so() -> None:
    assert ENDS["closed"] == CLOSED
