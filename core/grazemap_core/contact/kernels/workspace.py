"""What a walk along a trajectory carries besides its state: where it stands, what it has seen, and scratch.

`cursor` says in which regime the walk is. Between the stops it holds a free state alone. Near a stop that mass 1 has
just left (the anchor) it also holds the gap to that stop and its rate, each to its own relative precision: a bounce
of any smallness is then resolved to its full relative precision, across the ends of cells too. While mass 1 rests on
a stop the state is that of the masses behind it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.kernels.bernstein import MAX_DEPTH
from grazemap_core.numerics.tolerances import TAYLOR_DEGREE

OK = 0
"""The trajectory goes on."""
NO_HELD_FLOW = 1
"""Mass 1 comes to rest on a stop, and the chain behind it has no closed form that keeps its digits."""
IMPACT_BUDGET_SPENT = 2
"""More impacts in half a forcing period than complete chatter explains: time does not advance."""
NOT_FINITE = 3
"""A number overflowed."""

RECORD_FULL = 100
"""The record of impacts has no more room; the state is back at the start of the half period."""
AT_STOP = 4
"""Mass 1 stands on a stop and may come to rest, or rests: for `sticking.rest_in_cell` to go on."""

# entries of `cursor`
ANCHOR = 0
"""The stop that mass 1 rests on or has just left (+1 A, -1 C), or 0."""
ROWS = 1
"""Events seen."""
HELD = 2
"""The stop that mass 1 rests on, or that it comes to rest on through the last bounces of a complete chatter; or 0."""
ROOTS = 3
"""How many zeros the gap to the anchor has at this moment: 1 behind an impact, 2 leaving from rest, 3 behind a release,
0 when mass 1 is on its way and the gap is in `near`."""

# entries of `tally`: what the half period in progress has seen
RIGHT, LEFT = 0, 1
"""Impacts on stop A and on stop C; infinite with a complete chatter."""
LEAST_SPEED = 2
"""Least impact speed; 0 with a complete chatter."""
UNDECIDED = 3
"""Grazes (`GRAZE`), and touches of zero by the pressing of a resting mass 1 that may be releases (taken as none)."""
LEAST_UNPRESSED = 4
"""Least speed of the impacts at which mass 1 was not pressed against the stop: only these can be grazes. 0 with a graze
to within round-off."""
HELD_RIGHT, HELD_LEFT = 5, 6
"""1 when mass 1 has rested on that stop."""
FOLLOWED = 7
"""Impacts that were followed one by one; always finite."""
TALLY_SIZE = 8

# columns of `events`
HALF, TIME, STOP, VELOCITY, KIND, DELAY = 0, 1, 2, 3, 4, 5
"""Index of the half period, time within it, stop, velocity before, kind, and by how much later mass 1 is at rest."""
EVENT_COLUMNS = 6
"""Columns of an event before the state behind it: 2 N of a free state, or 2 (N - 1) of a held one."""

IMPACT = 0
"""An impact; the state is free."""
CHATTER = 1
"""The impact from which infinitely many more follow within the delay; the state is held."""
IMPACT_AND_REST = 2
"""An impact after which mass 1 stays on the stop (restitution 0); the state is held."""
REST = 3
"""Mass 1 rests on the stop where the record begins; the state is held."""
RELEASE = 4
"""Mass 1 leaves the stop that it rested on; the state is free."""
GRAZE = 5
"""Mass 1 comes so near the stop that round-off hides whether it touches it, at a speed of zero to within round-off. It
is taken as a touch at zero speed, which changes nothing; the state is free."""

# entries of `near`
GRAZE_STOP, GRAZE_BACK = 3, 4
"""The stop of a graze that was seen in this cell, or 0, and how long before the end of the cell it was."""


class Workspace(NamedTuple):
    """Scratch of the contact search, and what a walk reports besides its state.

    `near` holds the gap to the anchor, its rate, how far the walk has come in a cell that it did not finish, and a
    graze to be entered into the events.
    `events` has one row per event; rows beyond its end are counted in the
    cursor but not written.
    """

    taylor: Floats
    terms: Floats
    distance: Floats
    stack: Floats
    start: Floats
    width: Floats
    tally: Floats
    cursor: Integers
    near: Floats
    saved: Floats
    events: Floats


def workspace(blocks: int, events: int = 0) -> Workspace:
    """Return fresh scratch for an oscillator of `blocks` masses, with room for some events."""
    work = Workspace(
        taylor=np.zeros(TAYLOR_DEGREE + 1),
        terms=np.zeros((blocks + 1, 4)),
        distance=np.zeros(TAYLOR_DEGREE + 1),
        stack=np.zeros((MAX_DEPTH + 2, TAYLOR_DEGREE + 1)),
        start=np.zeros(MAX_DEPTH + 2),
        width=np.zeros(MAX_DEPTH + 2),
        tally=np.zeros(TALLY_SIZE),
        cursor=np.zeros(4, dtype=np.int64),
        near=np.zeros(5),
        saved=np.zeros((blocks, 2)),
        events=np.zeros((events, EVENT_COLUMNS + 2 * blocks)),
    )
    clear_tally(work.tally)
    return work


@kernel
def clear_tally(tally: Floats) -> None:
    """Begin the tally of a half period: nothing seen yet. What was left undecided goes on adding up."""
    undecided = tally[UNDECIDED]
    tally[:] = 0.0
    tally[UNDECIDED] = undecided
    tally[LEAST_SPEED] = np.inf
    tally[LEAST_UNPRESSED] = np.inf
