"""Settings of unfolding maps: what is run at every point, and for how long."""

from __future__ import annotations

from typing import Final

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.checks import checked_order
from grazemap_core.errors import ParameterError
from grazemap_core.maps.runner import RunSettings
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import dataclass
from grazemap_core.simulation.observables import Observables

MAP_POLICIES: Final = ("rest", "sweep-up", "sweep-down", "ensemble")
"""Initial states of a point: at rest; the final state at the next lower, or higher, value of the vertical parameter; or
several random states, of which the most frequent motion counts."""


@dataclass(frozen=True)
class MapSettings:
    """What is run at every point of a map.

    Raises
    ------
    ParameterError
        A limit is below 1, or there is no such policy.
    """

    max_periods: int = 1000
    """Maximum number of forcing periods of a trajectory. In the last GROWTH_SHARE of them, or in the last
    MOST_GROWTH_PERIODS if these are fewer, the growth of small changes is measured, which identifies chaotic and
    quasi-periodic motions."""
    max_period: int = 32
    """Maximum period n of a motion, in forcing periods."""
    policy: str = "rest"
    """One of MAP_POLICIES. A sweep goes along the vertical parameter. It starts from rest at the first value, and after
    a trajectory that ended early. If the final state is beyond a stop of the next point, the contact is put on that
    stop with its velocity; this is an impact if it moves into the stop."""
    initial_conditions: int = 16
    """Of an ensemble: the number of initial states per point. The states are the same for every point, apart from
    scale: displacements uniform in (-b, b), velocities in (-omega b, omega b). Where the stops are not alike, the
    contact is about the middle between them; where there is one, it is within it."""
    seed: int = 0
    """Of an ensemble: seed of the random numbers."""
    preview: bool = False
    """Whether only periodic motions are identified, which is faster: the growth of small changes is not measured, and a
    trajectory that has not settled is unresolved, chaotic or not."""

    def __post_init__(self) -> None:
        for name in ("max_periods", "max_period", "initial_conditions"):
            checked_order(name, getattr(self, name), 1)
        if self.policy not in MAP_POLICIES:
            raise ParameterError("policy", f"must be one of {', '.join(MAP_POLICIES)}")

    @property
    def is_ensemble(self) -> bool:
        """Whether every point has several trajectories."""
        return self.policy == "ensemble"

    @property
    def is_sweep(self) -> bool:
        """Whether every trajectory follows that of another point."""
        return self.policy.startswith("sweep")

    def starts(self, oscillator: Oscillator) -> Floats | None:
        """Return the random starts of an ensemble, as `RunSettings.starts`; None for other policies."""
        return random_starts(oscillator, self.initial_conditions, self.seed) if self.is_ensemble else None

    def of_runs(self, oscillator: Oscillator, observed: Observables | None = None) -> RunSettings:
        """Return the settings of the runs; `observed` is what is read off the motions."""
        return RunSettings(
            max_periods=self.max_periods,
            max_period=self.max_period,
            follow=self.is_sweep,
            starts=self.starts(oscillator),
            linearised=not self.preview,
            observed=observed,
        )


DEFAULT_SETTINGS: Final = MapSettings()


def random_starts(oscillator: Oscillator, count: int, seed: int) -> Floats:
    """Return uniform random displacements and velocities in (-1, 1) for `RunSettings.starts`, shape (count, 2, N).

    The contact coordinate too is uniform in (-1, 1).
    """
    starts = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 2, oscillator.size))
    (named,) = np.nonzero(oscillator.contact)
    for state in starts:
        state[0] = oscillator.with_contact(state[0], float(state[0, named[0]]))
    return starts
