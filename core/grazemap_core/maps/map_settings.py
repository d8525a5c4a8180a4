"""Settings of maps and of runs: where trajectories begin, under which conditions, and for how long they run.

A start is chosen by whoever asks for the run. It is never concluded from the numbers of a state, which may be those of
the equilibrium, or of a point on a stop, by chance.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.errors import ParameterError, checked_order
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import NamedTuple, dataclass
from grazemap_core.simulation.observables import Observables


class RunSettings(NamedTuple):
    """Settings of a run."""

    max_periods: int
    """As in `MapSettings`."""
    max_period: int
    """As in `MapSettings`."""
    early: bool = True
    """Whether a trajectory stops once its motion is verified, or named by its returns where it cannot be verified.
    Otherwise all run for `max_periods` and are named by their returns alone."""
    linearised: bool = True
    """Whether exponents of motions that are not periodic are computed, and multipliers of those that are not
    verified."""
    follow: bool = False
    """Whether a trajectory starts at the final state of the trajectory before it in the sweep."""
    starts: Floats | None = None
    """(s, 2, N) Of a map: the random states of `AboutMiddle`, velocities in clearances times omega; at rest when
    None."""
    observed: Observables | None = None
    """What is read off the motions, in further columns of the figures."""

    def start(self, omega: float) -> AtRest | AboutMiddle:
        """Return where the trajectories of a map begin at a frequency, unless they follow those before."""
        return AtRest() if self.starts is None else AboutMiddle(self.starts * np.array([1.0, omega])[:, None])


class Conditions(NamedTuple):
    """Stops and factors of the forces of k trajectories of one structure at one forcing frequency."""

    clearance: Floats
    """(k, 2) Clearances of the right and of the left stop, from q = 0; infinite for an absent one."""
    restitution: Floats
    """(k, 2) Restitutions of these stops."""
    bias: Floats
    """(k,) Factors of the oscillator's bias."""
    forcing: Floats
    """(k,) Factors of the oscillator's forces. If all forces and the distances of the stops are multiplied by a factor,
    so are the motions; the kernels therefore need no other forces."""

    @classmethod
    def of(cls, oscillator: Oscillator, clearances: Floats) -> Conditions:
        """Return the conditions of an oscillator with clearances (k,) of both stops, or (k, 2) of each."""
        both = np.asarray(clearances, dtype=np.float64)
        both = np.stack([both, both], axis=1) if both.ndim == 1 else both
        ones = np.ones(len(both))
        restitution = [oscillator.restitution_of(1) * ones, oscillator.restitution_of(-1) * ones]
        return cls(both, np.stack(restitution, axis=1), ones, ones)

    def part(self, which: Integers | slice) -> Conditions:
        """Return the conditions of some of the trajectories."""
        return Conditions(*(values[which] for values in self))


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
