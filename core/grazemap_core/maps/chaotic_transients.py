"""The chance that a chaotic motion settles later, from a sample of chaotic trajectories that are simulated further.

A motion is called chaotic after the forcing periods that were simulated. It may be a transient that ends on a periodic
motion: trajectories leave the neighbourhood of a chaotic saddle after exponentially distributed times (Lai & Tél 2011),
and one trajectory does not distinguish such a saddle from an attractor. So the chance to settle is measured for all
chaotic motions of a result together: a sample of their trajectories is simulated for RUN_ON times as many periods in
all, and those that become periodic are counted.

References
----------
Y.-C. Lai, T. Tél, Transient Chaos, Springer (2011), chapter 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grazemap_core.arrays import Floats, Integers
from grazemap_core.codes import RESOLVED
from grazemap_core.contact.stops import Clearance
from grazemap_core.maps.basin_fractions import from_rest
from grazemap_core.maps.basins import Coordinate, initial_states, run_states
from grazemap_core.maps.bifurcation_diagrams import Section
from grazemap_core.maps.kernels.lane_state import CODES, GROWTH, HALVES_RUN, REASON, UNVERIFIED
from grazemap_core.maps.map_settings import DEFAULT_SETTINGS, MapSettings, RunSettings
from grazemap_core.maps.planes import ParameterLine, Plane, PlaneRunner, Point, SweepEnd
from grazemap_core.maps.runner import Runner, Runners
from grazemap_core.maps.samples import interval, sample, sample_of_groups
from grazemap_core.maps.tolerances import RUN_ON
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import dataclass
from grazemap_core.simulation.motion import KINDS, kinds_of
from grazemap_core.simulation.start import forced_oscillator

_CHAOTIC: Final = KINDS.index("chaotic")


@dataclass(frozen=True)
class ChanceToSettle:
    """How many chaotic motions settle if they are simulated for RUN_ON times as many forcing periods."""

    watched: int
    """Forcing periods after which motions were called chaotic."""
    run_on: int
    """Forcing periods after which the motions of the sample were classified again."""
    chaotic: int
    """Number of chaotic motions."""
    sampled: int
    """Number of motions in the sample, without trajectories that ended early."""
    settled: int
    """Number of motions of the sample that became periodic."""
    chance: float
    """settled/sampled; NaN for an empty sample."""
    low: float
    """Lower end of the interval of the chance (`samples.interval`); 0 for an empty sample."""
    high: float
    """Upper end of this interval; 1 for an empty sample."""


def chance_in_map(kind: NDArray[Any], plane: Plane, settings: MapSettings = DEFAULT_SETTINGS) -> ChanceToSettle | None:
    """Return the chance of the chaotic points of an unfolding map to settle; None if it has none.

    Parameters
    ----------
    kind : (n, m)
        Positions in `motion.KINDS`.
    plane, settings
        As of `unfolding.unfolding_map_tile`, of the whole map.
    """
    rows, columns = np.nonzero(kind == _CHAOTIC)
    if len(rows) == 0:
        return None
    watched = settings.max_periods
    longer = _longer_runs(watched, settings.max_period)
    if settings.policy == "rest":
        runner = PlaneRunner(plane, longer)
        chosen = sample_of_groups(list(runner.groups(rows, columns)), watched)
        return _chance(len(rows), watched, runner.points(rows[chosen], columns[chosen])[0])
    chosen = sample(len(rows), watched)
    sampled = rows[chosen], columns[chosen]
    starts = settings.starts(plane.oscillator)
    if starts is not None:
        return _chance(len(rows), watched, _of_ensemble(plane, starts, watched, longer, *sampled))
    # a sweep reaches the point as in the map, and goes on there
    follows = longer._replace(max_periods=watched, linearised=True, follow=True)
    down = settings.policy == "sweep-down"
    return _chance(len(rows), watched, _of_sweep(plane, follows, down, *sampled))


def _of_ensemble(
    plane: Plane, starts: Floats, watched: int, longer: RunSettings, rows: Integers, columns: Integers
) -> Integers:
    """Return codes (k, 1, CODES) of longer runs at points (k,), from the first of the states that leads to chaos."""
    watched_codes, _ = PlaneRunner(plane, RunSettings(watched, longer.max_period, starts=starts)).points(rows, columns)
    kind, _ = kinds_of(watched_codes[..., REASON], watched_codes[..., GROWTH], watched_codes[..., UNVERIFIED])
    first, codes = np.argmax(kind == _CHAOTIC, axis=1), []
    for start, row, column in zip(starts[first, None], rows[:, None], columns[:, None], strict=True):
        codes.append(PlaneRunner(plane, longer._replace(starts=start)).points(row, column)[0])
    return np.concatenate(codes)


def _of_sweep(plane: Plane, settings: RunSettings, down: bool, rows: Integers, columns: Integers) -> Integers:
    """Return codes (k, RUN_ON, CODES) of runs at points (k,) that a sweep has reached, one after the other.

    A column is swept once: at each sampled point the further runs branch off, then the sweep goes on from the point.
    """
    runner, path = PlaneRunner(plane, settings), np.arange(plane.shape[0])[:: -1 if down else 1]
    codes = np.empty((len(rows), RUN_ON, CODES), dtype=np.int64)
    steps = np.argsort(path)[rows]
    for column in np.unique(columns).tolist():
        after: SweepEnd | None = None
        done = 0
        in_column = np.flatnonzero(columns == column)
        for point in in_column[np.argsort(steps[in_column])].tolist():
            end = int(steps[point]) + 1
            codes_on_way, _, after = runner.sweep(path[done:end], column, after)
            codes[point, 0], last = codes_on_way[-1, 0], after
            for run in range(1, RUN_ON):
                longer, _, last = runner.sweep(rows[point : point + 1], column, last)
                codes[point, run] = longer[0, 0]
            done = end
    return codes


@in_own_period
def chance_in_basins(
    kind: NDArray[Any],
    oscillator: Oscillator,
    omega: float,
    clearance: Clearance,
    horizontal: Coordinate,
    vertical: Coordinate,
    displacement: ArrayLike | None,
    velocity: ArrayLike | None,
    phase: float,
    max_periods: int,
    max_period: int,
) -> ChanceToSettle | None:
    """Return the chance that a motion called chaotic settles, over the initial states that lead to one.

    None if there are none.

    Parameters
    ----------
    kind : (n, m)
        Positions in `motion.KINDS`.
    oscillator, omega, clearance, horizontal, vertical, displacement, velocity, phase, max_periods, max_period
        As of `basins.basin_tile`, of the whole rectangle.
    """
    rows, columns = np.nonzero(kind == _CHAOTIC)
    if len(rows) == 0:
        return None
    chosen = sample(len(rows), max_periods)
    runner = Runner(oscillator, _longer_runs(max_periods, max_period))
    forced = forced_oscillator(oscillator, omega, clearance)
    across = horizontal._replace(values=horizontal.values[columns[chosen]])
    up = vertical._replace(values=vertical.values[rows[chosen]])
    state, added = initial_states(forced, across, up, displacement, velocity)
    each = np.arange(len(chosen))
    codes, _ = run_states(runner, forced, state, added[each, each], phase)
    return _chance(len(rows), max_periods, codes[:, None])


@in_own_period
def chance_in_fractions(
    kind: NDArray[Any], points: Sequence[Point], states: Floats, phase: float, max_periods: int, max_period: int
) -> ChanceToSettle | None:
    """Return the chance that a motion called chaotic settles, over the initial states that lead to one, at all values.

    None if there are none.

    Parameters
    ----------
    kind : (n, s)
        Positions in `motion.KINDS`.
    points, states, phase, max_periods, max_period
        As of `basin_fractions.fraction_tile`.
    """
    rows, columns = np.nonzero(kind == _CHAOTIC)
    if len(rows) == 0:
        return None
    chosen = sample(len(rows), max_periods)
    runners, codes = Runners(_longer_runs(max_periods, max_period)), []
    for row in np.unique(rows[chosen]).tolist():
        forced = forced_oscillator(*points[row])
        start = from_rest(forced, states[columns[chosen][rows[chosen] == row]])
        codes.append(run_states(runners.of(points[row].oscillator), forced, *start, phase)[0])
    return _chance(len(rows), max_periods, np.concatenate(codes)[:, None])


@in_own_period
def chance_in_diagram(
    line: ParameterLine,
    sections: Sequence[Section],
    watched: int,
    max_period: int,
) -> ChanceToSettle | None:
    """Return the chance of the chaotic motions of a bifurcation diagram to settle; None if it has none.

    Parameters
    ----------
    line, max_period
        As of `bifurcation_diagrams.sections`.
    sections : (n,)
        In the order of the values.
    watched : int
        Forcing periods after which a motion was called chaotic.
    """
    chaotic = [number for number, section in enumerate(sections) if section.motion.kind == "chaotic"]
    if not chaotic:
        return None
    runners, codes = Runners(_longer_runs(watched, max_period)), []
    for number in (chaotic[position] for position in sample(len(chaotic), watched)):
        forced = forced_oscillator(*line.point(number))
        codes.append(runners.of(forced.oscillator).run_from(forced, sections[number].start)[0])
    return _chance(len(chaotic), watched, np.stack(codes)[:, None])


def _longer_runs(watched: int, max_period: int) -> RunSettings:
    return RunSettings(RUN_ON * watched, max_period, linearised=False)


def _chance(chaotic: int, watched: int, codes: Integers) -> ChanceToSettle:
    """Return the chance of chaotic motions from codes (k, r, CODES) of k sampled ones, each in r consecutive runs."""
    halves = 2 * RUN_ON * watched // codes.shape[1]
    outcomes = [outcome for outcome in (_outcome(runs, halves) for runs in codes) if outcome is not None]
    sampled, settled = len(outcomes), sum(outcomes)
    low, high = interval(settled, sampled)
    return ChanceToSettle(
        watched=watched,
        run_on=RUN_ON * watched,
        chaotic=chaotic,
        sampled=sampled,
        settled=settled,
        chance=settled / sampled if sampled else np.nan,
        low=low,
        high=high,
    )


def _outcome(codes: Integers, halves: int) -> bool | None:
    """Return whether a trajectory settles in one of its consecutive runs (r, CODES) of so many half periods.

    None if one ends early.
    """
    for run in codes:
        if run[REASON] == RESOLVED:
            return True
        if run[HALVES_RUN] < halves:
            return None
    return False
