"""Where the trajectories of a run begin.

A start is chosen by whoever asks for the run. It is never concluded from the numbers of a state, which may be those of
the equilibrium, or of a point on a stop, by chance.
"""

from __future__ import annotations

from grazemap_core.arrays import Floats
from grazemap_core.records import NamedTuple


class AtRest(NamedTuple):
    """One trajectory for each of the conditions, at rest in equilibrium; held by a stop that is preloaded."""


class FromState(NamedTuple):
    """A single trajectory from a state, which may be on a stop; if it moves into the stop, this is an impact."""

    state: Floats
    """(2, N) Displacements and velocities."""


class BetweenStops(NamedTuple):
    """Trajectories from s states between the stops, under conditions of equal factors of bias and forcing."""

    origin: Floats
    """(2, N) A state, which may lie anywhere; the trajectories start at ``origin + b scaled``, where b is the unit of
    the stops (`Stops.unit`)."""
    scaled: Floats
    """(s, 2, N) Displacements and velocities in units of the stops, from there."""


class AboutMiddle(NamedTuple):
    """Trajectories from s random states about the middle between the stops, under conditions as of `BetweenStops`.

    The range of the contact coordinate is as wide as two units of the stops. Its middle is that between two stops; of a
    single stop it is q = 0, unless the range would reach beyond the stop.
    """

    scaled: Floats
    """(s, 2, N) Displacements and velocities in units of the stops."""


Start = AtRest | FromState | BetweenStops | AboutMiddle
