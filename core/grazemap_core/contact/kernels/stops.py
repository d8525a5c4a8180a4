"""The stops of a trajectory: their gaps from the equilibrium, and their restitutions.

The contact coordinate q is measured from the static equilibrium, so a bias needs no place in the kernels: it changes
the gaps alone.
"""

from __future__ import annotations

from grazemap_core.numerics.jit.compiled import inlined_formula
from grazemap_core.records import NamedTuple


class Stops(NamedTuple):
    """The stops of a trajectory: -left <= q <= right."""

    right: float
    """Gap of the right stop from the equilibrium: infinite for an absent stop, 0 or less for a preloaded one. The sum
    of both gaps is positive."""
    left: float
    """Gap of the left stop, likewise."""
    restitution_right: float
    """R of the right stop."""
    restitution_left: float
    """R of the left stop."""
    unit: float
    """Length to which distances between states are relative: the gap of the nearer stop or the amplitude of the steady
    motion, whichever is larger, but at most half the distance between the stops. It is the gap where both are equal,
    and a stop out of reach is as an absent one. Where this is 0, a trajectory has the unit of
    `ForcedOscillator.stops_from`."""
    chatter_impacts: float
    """Maximum number of impacts of complete chatter in half a period."""
    settling_chatter: float
    """Number of these impacts that do not count toward the impacts in which a motion has to settle."""
    symmetric: bool
    """Whether the mirror image of a motion, half a period later, is a motion too: both gaps and both restitutions are
    equal, and so are the forces."""


@inlined_formula
def gap_of(stops: Stops, stop: float) -> float:
    """Return the gap of a stop, +1 right or -1 left, from the equilibrium."""
    return stops.right if stop > 0 else stops.left


@inlined_formula
def restitution_of(stops: Stops, stop: float) -> float:
    """Return the restitution of a stop, +1 right or -1 left."""
    return stops.restitution_right if stop > 0 else stops.restitution_left
