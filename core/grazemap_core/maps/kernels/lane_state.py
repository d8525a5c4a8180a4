"""What is asked of a column of trajectories, what is noted of every lane on the way, and what is found.

Arrays that flow through `column`, `judging` and `leaping`, and what their columns mean.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.maps.kernels.lanes import LANES
from grazemap_core.maps.tolerances import APPROACH, EXTRAPOLATED_FROM
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.simulation.tolerances import CLOSING_GOAL

# columns of the codes of a motion
REASON, PERIOD, IMPACTS_RIGHT, IMPACTS_LEFT, SYMMETRIC, SETTLED_AFTER, STICKING = 0, 1, 2, 3, 4, 5, 6
GROWTH = 7
"""What the growth of changes says of a motion that was not named, a code of `lyapunov`."""
RUN, STRUCK = 8, 9
"""Half periods that were run, and impacts that were followed."""
DOUBT = 10
"""Why a motion that was named is not proven, a code of `closing`; NAMED where it is."""
CODES = 11

# columns of the figures of a motion
LEAST_VELOCITY, MULTIPLIER, LYAPUNOV = 0, 1, 2
MEAN_POSITION, MEAN_VELOCITY = 3, 4
"""As `closing.mean_section`, in units of the clearance, and of omega times it."""
LYAPUNOV_ERROR = 5
FIGURES = 6

SETTLES, GROWS, REPEATS, LEAVES, LEAPT = 0, 1, 2, 3, 4
"""What a lane is at. Its motion is to be named, at first without, at last with changes carried along; it was named, and
its multiplier is to be found; all is known, and its state at the end of the forcing period is waited for; it was put to
where its returns lead, and has to show that it stays there."""

# columns of `Notes.counts`
POINT, BEGAN, AT, DUE = 0, 1, 2, 3
"""The trajectory in the lane, -1 for none; when it began; what it is at, and when something is to be done about that in
any case."""
RECORDED = 4
"""The half period from which on all its impacts are in its events."""
SINCE, RETURNED, LOOK = 5, 6, 7
"""The half period from which on the ring holds what it went through by itself; half periods between returns when it
leapt; when it is looked at again."""
COUNTS = 8

# columns of `Notes.sizes`
FOLLOWED, COUNTED, GOAL, CHANGED = 0, 1, 2, 3
"""Impacts followed, and those that count toward SETTLING_IMPACTS; the return, in units of the clearance, from which
the lane is looked at; the return when it leapt."""
SIZES = 4


class LaneRecords(NamedTuple):
    """What is known of every lane's trajectory.

    Attributes
    ----------
    counts : (LANES, COUNTS)
        Times are half periods since the column began.
    sizes : (LANES, SIZES)
    left : (LANES, 2 N)
        The state in the frame of z that a lane has leapt from.
    """

    counts: Integers
    sizes: Floats
    left: Floats


class ColumnTask(NamedTuple):
    """What is asked of a column.

    Attributes
    ----------
    clearances : (n,)
    base, directions : (N, 2), (s, N, 2)
        Trajectory i has the clearance b number i // s, and begins at base + b * directions[i % s].
    max_periods, max_period : int
    early : bool
        Whether a trajectory stops once its motion can be named; otherwise all run for `max_periods`.
    follow : bool
        Whether every trajectory but the first begins with the state in which the last one ended. Where that is outside
        the stops, mass 1 is put on the stop that it is beyond, with its velocity.
    growth_halves : int
        Half periods at the end in which the growth of changes is measured; with 0 there are no exponents of motions
        that are not periodic, nor multipliers of those that are not proven.
    """

    clearances: Floats
    base: Floats
    directions: Floats
    max_periods: int
    max_period: int
    early: bool
    follow: bool
    growth_halves: int


class Found(NamedTuple):
    """What became of every trajectory.

    Attributes
    ----------
    codes : (n s, CODES)
        Reason (a code of `closing`), period, impacts_right, impacts_left, symmetric, settled_after (forcing periods
        after which the orbit had closed, or was solved for, or after which no contact was possible any more; -1 unless
        named) and sticking; what the growth says; half periods run and impacts followed; doubt.
    figures : (n s, FIGURES)
        Least impact velocity, NaN without impacts; largest modulus of the multipliers over one motion period and
        largest Lyapunov exponent per forcing period, NaN where they are not known; where a periodic motion is in the
        mean, NaN unless it was named; standard error of an exponent that was measured, else NaN.
    """

    codes: Integers
    figures: Floats


def lane_records(masses: int) -> LaneRecords:
    """Return notes of idle lanes."""
    return LaneRecords(
        np.zeros((LANES, COUNTS), dtype=np.int64), np.zeros((LANES, SIZES)), np.zeros((LANES, 2 * masses))
    )


@kernel
def enter_lane(known: LaneRecords, lane: int, point: int, k: int, task: ColumnTask, verifiable: bool) -> None:
    """Take note of a trajectory that begins in a lane after k half periods."""
    counts, sizes = known.counts, known.sizes
    counts[lane] = 0
    counts[lane, POINT] = point
    counts[lane, BEGAN] = k
    counts[lane, AT] = SETTLES
    counts[lane, DUE] = k + 2 * task.max_periods
    counts[lane, RECORDED] = k
    counts[lane, SINCE] = k
    sizes[lane] = 0.0
    sizes[lane, GOAL] = (APPROACH if verifiable else EXTRAPOLATED_FROM) if task.early else CLOSING_GOAL
