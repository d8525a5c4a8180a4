"""Motions of sensitive points, decided in multi-precision arithmetic.

A trajectory is run twice, the second time with twice as many bits, for as long as both runs have the same impacts;
where they differ, the number of bits is doubled. The state at the start of every forcing period, rounded to double
precision, starts a trajectory of a map. The first of these that an orbit captures at once decides the motion.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.codes import RESOLVED, ROUNDING_DECIDES
from grazemap_core.contact.stops import Clearance, both_clearances
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.map_settings import AboutMiddle, AtRest, BetweenStops, RunSettings
from grazemap_core.maps.planes import PlaneRunner
from grazemap_core.maps.runner import Runner
from grazemap_core.maps.tolerances import (
    CAPTURE_PERIODS,
    CAPTURE_SPARE,
    RESOLVING_BITS,
    RESOLVING_GROWTH,
    RESOLVING_GUARD_BITS,
    RESOLVING_LONGER,
    RESOLVING_MOST_BITS,
    RESOLVING_PERIODS,
    RESOLVING_WORK,
    RESTING_DISTANCE,
)
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.multiprecision import MultiprecisionRun, known_bits, same_impacts
from grazemap_core.simulation.multiprecision_modes import RunError

_OF_MOTION: Final = (*range(lane_state.HALVES_RUN), lane_state.UNVERIFIED)
"""Codes that describe the motion, not the run."""
_FIGURES_OF_MOTION: Final = slice(lane_state.LYAPUNOV_ERROR + 1)

TOO_MUCH_WORK = "the limit of the work is reached"


class Resolution(NamedTuple):
    """The motion of a sensitive point, or why it is undecided."""

    reason: str
    """Why it is undecided; empty if it is decided."""
    bits: int
    """Precision of the more precise run."""
    codes: Integers
    """(CODES,) As in `lane_state.TrajectoryResults`; empty if undecided."""
    figures: Floats
    """(FIGURES,) As in `lane_state.TrajectoryResults`; empty if undecided."""


class Resolver:
    """Decides the motions of points of one oscillator at one frequency."""

    def __init__(self, oscillator: Oscillator, omega: float, max_periods: int = 1000, max_period: int = 32) -> None:
        """Allocate scratch; limits as in `MapSettings`."""
        self._oscillator, self._omega, self._max_periods = oscillator, omega, max_periods
        self._runner = Runner(
            oscillator, RunSettings(CAPTURE_PERIODS * max_period + CAPTURE_SPARE, max_period, linearised=False)
        )
        self._forced = self._runner.at(omega)

    def random_states(self, clearance: Clearance, start: AboutMiddle) -> Floats:
        """Return random initial states (s, 2, N)."""
        return self._runner.random_states(self._forced, clearance, start)

    def resolve(self, clearance: Clearance, state: Floats | None = None, phase: float = 0.0) -> Resolution:
        """Decide the motion from displacements and velocities (2, N), or from rest, at a phase of the forcing."""
        unit = self._runner.unit(self._forced, clearance)

        def start(bits: int) -> MultiprecisionRun:
            return MultiprecisionRun(self._oscillator, self._omega, clearance, state, phase, bits)

        def restart(states: Floats) -> tuple[Integers, Floats]:
            both = both_clearances(clearance)
            places = states[:, 0] @ self._oscillator.contact
            free = np.min([np.abs(places - both[0]), np.abs(places + both[1])], axis=0) > RESTING_DISTANCE * unit
            codes = np.full((len(states), lane_state.CODES), ROUNDING_DECIDES)
            figures = np.full((len(states), lane_state.FIGURES), np.nan)
            if np.any(free):
                start = BetweenStops(np.zeros(states.shape[1:]), states[free] / unit)
                results = self._runner.run(self._forced, np.array([both]), start, phase)
                codes[free], figures[free] = results[0][0], results[1][0]
            return codes, figures

        return resolution(start, restart, RESOLVING_LONGER * self._max_periods)


def resolution(
    start: Callable[[int], MultiprecisionRun],
    restart: Callable[[Floats], tuple[Integers, Floats]],
    max_periods: int,
) -> Resolution:
    """Return the motion that two runs with the same impacts lead to within so many periods, or why none is decided.

    Parameters
    ----------
    start : callable
        Starts a run with so many bits.
    restart : callable
        Returns codes (s, CODES) and figures (s, FIGURES) of trajectories in double precision from states (s, 2, N).
    max_periods : int
    """
    undecided = np.empty(0, dtype=np.int64), np.empty(0)
    bits, work = RESOLVING_BITS, 0
    try:
        coarse, fine = start(bits), start(2 * bits)
    except RunError as error:
        return Resolution(str(error), bits, *undecided)
    done, periods = 0, min(RESOLVING_PERIODS, max_periods)
    while True:
        fine.run(periods)
        coarse.run(periods)
        if not same_impacts(coarse, fine):
            work += coarse.work + fine.work
            if work > RESOLVING_WORK or fine.bits == RESOLVING_MOST_BITS:
                return Resolution(TOO_MUCH_WORK, fine.bits, *undecided)
            try:
                coarse, fine = start(fine.bits), start(2 * fine.bits)
            except RunError as error:
                return Resolution(str(error), 2 * fine.bits, *undecided)
            done, periods = 0, min(RESOLVING_PERIODS, max_periods)
            continue
        if fine.ended:
            return Resolution(fine.ended, fine.bits, *undecided)
        codes, figures = restart(np.stack(fine.states[done:periods]))
        captured = np.flatnonzero(_at_once(codes))
        if len(captured):
            first = captured[0]
            codes[first, lane_state.SETTLED_AFTER] += done + first
            return Resolution("", fine.bits, codes[first], figures[first])
        if periods == max_periods:
            return Resolution("not captured within the periods simulated", fine.bits, *undecided)
        if work + coarse.work + fine.work > RESOLVING_WORK:
            return Resolution(TOO_MUCH_WORK, fine.bits, *undecided)
        known = known_bits(coarse, fine)
        if known < coarse.bits:
            enough = round(known) + RESOLVING_GUARD_BITS
            coarse.reduce(enough)
            fine.reduce(2 * enough)
        done, periods = periods, min(periods + periods // RESOLVING_GROWTH, max_periods)


def _at_once(codes: Integers) -> Booleans:
    """Return which trajectories a verified orbit captures at once."""
    verified = (codes[:, lane_state.REASON] == RESOLVED) & (codes[:, lane_state.UNVERIFIED] == RESOLVED)
    early = codes[:, lane_state.HALVES_RUN] <= 2 * (CAPTURE_PERIODS * codes[:, lane_state.PERIOD] + CAPTURE_SPARE)
    return np.asarray(verified & early)


def resolve_grid(runner: PlaneRunner, sensitive: Booleans, codes: Integers, figures: Floats) -> Booleans:
    """Replace the motions of sensitive trajectories that can be decided. Returns which these are, shape (n, m, s).

    Parameters
    ----------
    runner : PlaneRunner
        Not of a sweep.
    sensitive : (n, m, s)
    codes, figures : (CODES, n, m, s), (FIGURES, n, m, s)
        The results of `planes.PlaneRunner.grid`, changed in place.
    """
    plane, settings = runner.plane, runner.settings
    resolved = np.zeros(sensitive.shape, dtype=np.bool_)
    for row, column in np.argwhere(sensitive.any(axis=2)).tolist():
        oscillator, omega, clearance = plane.at_point(row, column)
        resolver = Resolver(oscillator, omega, settings.max_periods, settings.max_period)
        begun = settings.start(omega)
        states = [None] if isinstance(begun, AtRest) else resolver.random_states(clearance, begun)
        for start in np.flatnonzero(sensitive[row, column]).tolist():
            outcome = resolver.resolve(clearance, states[start])
            if not outcome.reason:
                which = row, column, start
                resolved[which] = True
                codes[(_OF_MOTION, *which)] = outcome.codes[list(_OF_MOTION)]
                figures[(_FIGURES_OF_MOTION, *which)] = outcome.figures[_FIGURES_OF_MOTION]
    return resolved
