"""The run of a trajectory: its state, regime, counts and record of events, and scratch. Kernels change it in place.

`cursor` is the regime. Between the stops the state of a trajectory is the free state `u`. Near a stop that the contact
has just left (the *anchor*) the run also holds the gap to that stop and its rate, each to its own relative precision,
so that arbitrarily small bounces are resolved across the ends of cells too. While the contact rests on a stop the state
is the held state.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.numerics.jit.compiled import copy_matrix, copy_vector, inlined, inlined_formula, kernel
from grazemap_core.numerics.kernels.bernstein import STACK_SHAPE
from grazemap_core.numerics.tolerances import TAYLOR_DEGREE
from grazemap_core.records import NamedTuple

OK = 0
"""The trajectory continues."""
NO_HELD_FLOW = 1
"""The contact comes to rest on a stop, and the motion of the other masses has no accurate closed form."""
IMPACT_BUDGET_SPENT = 2
"""More impacts in half a forcing period than complete chatter explains: time hardly advances."""
NOT_FINITE = 3
"""A number overflowed."""

RECORD_FULL = 100
"""The record of events is full; the state is back at the start of the half period."""
AT_STOP = 4
"""The contact is on a stop and may come to rest, or rests; `half_period.rest_in_cell` continues."""

# entries of `cursor`
ANCHOR = 0
"""The stop that the contact rests on or has just left (+1 right, -1 left), or 0."""
EVENT_COUNT = 1
"""Number of events."""
HELD = 2
"""The stop that the contact rests on, also during the summed impacts of a complete chatter; or 0."""
ZERO_ORDER = 3
"""Order of the zero of the gap to the anchor at this moment: 1 after an impact, 2 from rest, 3 after a release; 0 when
the contact has left the stop and the gap is in `near`."""

# entries of `tally`: counts of the current half period
RIGHT_IMPACTS, LEFT_IMPACTS = 0, 1
"""Impacts on the right and on the left stop; infinite with a complete chatter."""
MIN_SPEED = 2
"""Minimum impact speed; 0 with a complete chatter."""
UNDECIDED = 3
"""Undecided events: grazes (`GRAZE`), and times at which the contact acceleration of a resting contact touches zero.
Such a touch may be a release, but the contact is taken to stay."""
MIN_UNPRESSED_SPEED = 4
"""Minimum speed of the impacts without acceleration toward the stop: only these can become grazes. It is 0 if there is
a graze to within round-off."""
HELD_RIGHT, HELD_LEFT = 5, 6
"""1 if the contact has rested on that stop."""
FOLLOWED = 7
"""Impacts that were computed one by one; always finite."""
MIN_GAP = 8
"""Lower bound of the distance from the stops in passages without a contact; negative where it is not wanted."""
TALLY_SIZE = 9

# columns of `events`
HALF, TIME, STOP, VELOCITY, KIND, DELAY = 0, 1, 2, 3, 4, 5
"""Index of the half period, time within it, stop, velocity before the event, kind, and time until the contact is at
rest."""
EVENT_COLUMNS = 6
"""Columns of an event before the state after it, which has 2 N numbers if it is free, or 2 (N - 1) if it is held."""

IMPACT = 0
"""An impact; the state is free."""
CHATTER = 1
"""The impact after which infinitely many others follow within the delay; the state is held."""
IMPACT_AND_REST = 2
"""An impact after which the contact stays on the stop (restitution 0); the state is held."""
REST = 3
"""The contact rests on the stop at the start of the record; the state is held."""
RELEASE = 4
"""The contact is released from the stop; the state is free."""
GRAZE = 5
"""The contact comes so near the stop that round-off hides whether it touches it. It is taken as a touch at zero speed,
which changes nothing; the state is free."""

# entries of `near`
ANCHOR_GAP, ANCHOR_RATE, CELL_OFFSET = 0, 1, 2
"""Gap to the anchor, its rate, and the time reached in an unfinished cell."""
GRAZE_STOP, GRAZE_BACK = 3, 4
"""The stop of a graze in this cell, or 0, and the time from the graze to the end of the cell."""


class HeldRun(NamedTuple):
    """A trajectory while its contact rests on a stop."""

    state: Floats
    """(N - 1, 2) The held state."""
    since: Floats
    """(2,) The half period in which the contact came to rest, and the time in it."""
    turn: Floats
    """(H, 2) Scratch of `sticking.turn_to`: exp(i order phase) of the harmonics at one moment."""
    physical: Floats
    """(2 N,) Scratch: displacements, then velocities."""


class Run(NamedTuple):
    """State, regime, counts and record of a trajectory, and scratch of the contact search."""

    u: Floats
    """(N, 2) The free state; meaningless while the contact rests."""
    held: HeldRun
    """The trajectory while the contact rests."""
    cursor: Integers
    """(4,) The regime."""
    near: Floats
    """(5,) By the entries above."""
    tally: Floats
    """(TALLY_SIZE,) Counts of the current half period."""
    events: Floats
    """(capacity, EVENT_COLUMNS + 2 N) One row for each event; further events are counted in `cursor` but not
    written."""
    saved: Floats
    """(N, 2) The state from which cells without contact are counted."""
    taylor: Floats
    """(TAYLOR_DEGREE + 1,) Series of the contact coordinate over the next part of a cell."""
    terms: Floats
    """(N + 1, 4) Scratch of `cells.expand`."""
    distance: Floats
    """(TAYLOR_DEGREE + 1,) Series of the gap to a stop, or of the contact acceleration at rest."""
    stack: Floats
    """Scratch of `bernstein.first_negative`."""
    start: Floats
    """Scratch of `bernstein.first_negative`: starts of parts."""
    width: Floats
    """Scratch of `bernstein.first_negative`: widths of parts."""


class ContactState(NamedTuple):
    """What a trajectory is but for its free state, of one trajectory or with an axis of lanes before the axes given."""

    cursor: Integers
    """(4,) As in `Run`."""
    near: Floats
    """(3,) The first entries of `Run.near`."""
    held: Floats
    """(N - 1, 2) As `HeldRun.state`; without meaning unless the contact rests."""
    since: Floats
    """(2,) As in `HeldRun`; without meaning unless the contact rests."""


class Moment(NamedTuple):
    """A moment of a trajectory."""

    cell: int
    """Index of the cell in the forcing period."""
    offset: float
    """Time since the start of the cell."""
    half: int
    """Index of the half period since the start of the trajectory, for the record."""


def new_run(masses: int, harmonics: int, events: int = 0) -> Run:
    """Return a new run, in which the contact is between the stops, with the capacity for a number of events.

    The oscillator has so many masses and harmonics of the forces.
    """
    held = HeldRun(np.zeros((masses - 1, 2)), np.zeros(2), np.zeros((harmonics, 2)), np.zeros(2 * masses))
    run = Run(
        u=np.zeros((masses, 2)),
        held=held,
        cursor=np.zeros(4, dtype=np.int64),
        near=np.zeros(5),
        tally=np.zeros(TALLY_SIZE),
        events=np.zeros((events, EVENT_COLUMNS + 2 * masses)),
        saved=np.zeros((masses, 2)),
        taylor=np.zeros(TAYLOR_DEGREE + 1),
        terms=np.zeros((masses + 1, 4)),
        distance=np.zeros(TAYLOR_DEGREE + 1),
        stack=np.zeros(STACK_SHAPE),
        start=np.zeros(STACK_SHAPE[0]),
        width=np.zeros(STACK_SHAPE[0]),
    )
    clear_tally(run.tally)
    return run


def contact_states(masses: int, *lanes: int) -> ContactState:
    """Return contact states between the stops: of one trajectory, or of a number of lanes."""
    return ContactState(
        cursor=np.zeros((*lanes, 4), dtype=np.int64),
        near=np.zeros((*lanes, 3)),
        held=np.zeros((*lanes, masses - 1, 2)),
        since=np.zeros((*lanes, 2)),
    )


@inlined
def contact_of_run(run: Run) -> ContactState:
    """Return the contact state of a run."""
    return ContactState(run.cursor, run.near[:3], run.held.state, run.held.since)


@inlined
def contact_of_lane(contacts: ContactState, lane: int) -> ContactState:
    """Return the contact state of a lane."""
    return ContactState(contacts.cursor[lane], contacts.near[lane], contacts.held[lane], contacts.since[lane])


@inlined
def copy_contact(target: ContactState, source: ContactState) -> None:
    """Copy a contact state; the held state only while the contact rests."""
    copy_vector(target.cursor, source.cursor)
    copy_vector(target.near, source.near)
    if source.cursor[HELD] != 0:
        copy_matrix(target.held, source.held)
        copy_vector(target.since, source.since)


@kernel
def clear_tally(tally: Floats) -> None:
    """Reset the tally for a new half period, except for the number of undecided events."""
    undecided = tally[UNDECIDED]
    tally[:] = 0.0
    tally[UNDECIDED] = undecided
    tally[MIN_SPEED] = np.inf
    tally[MIN_UNPRESSED_SPEED] = np.inf
    tally[MIN_GAP] = -np.inf


@kernel
def copy_state(target: Run, source: Run) -> None:
    """Copy state and regime of a trajectory, and its number of undecided events, from one run to another."""
    copy_matrix(target.u, source.u)
    copy_contact(contact_of_run(target), contact_of_run(source))
    target.tally[UNDECIDED] = source.tally[UNDECIDED]


@inlined_formula
def rests(kind: Any) -> Any:
    """Return whether the contact rests, or makes the summed impacts before that, after an event of this kind."""
    return (kind != IMPACT) & (kind != RELEASE) & (kind != GRAZE)


@inlined_formula
def put_on_stop(cursor: Integers, near: Floats, stop: int, leaving: float) -> None:
    """Note in a cursor and in `near` that the contact is on a stop, which it leaves with a speed, or 0."""
    cursor[ANCHOR] = stop
    cursor[ZERO_ORDER] = 1 if leaving > 0.0 else 2
    near[ANCHOR_GAP] = 0.0
    near[ANCHOR_RATE] = leaving


@inlined
def write_state(event: Floats, state: Floats) -> None:
    """Write a state (n, 2) into a row of `events`."""
    for j in range(state.shape[0]):
        event[EVENT_COLUMNS + 2 * j] = state[j, 0]
        event[EVENT_COLUMNS + 2 * j + 1] = state[j, 1]


@inlined
def read_state(event: Floats, state: Floats) -> None:
    """Fill a state (n, 2) from a row of `events`."""
    for j in range(state.shape[0]):
        state[j, 0] = event[EVENT_COLUMNS + 2 * j]
        state[j, 1] = event[EVENT_COLUMNS + 2 * j + 1]


@kernel
def write_start(event: Floats, run: Run, half: int, half_time: float) -> None:
    """Write the state of a run at the start of a half period into a row of `events`: after an IMPACT, or at REST.

    It is the free state, too, if the record already has an event at that time, after which the contact rests.
    """
    event[:] = 0.0
    event[HALF], event[KIND] = half, IMPACT
    if run.cursor[HELD] != 0 and run.cursor[EVENT_COUNT] == 0:
        event[STOP], event[KIND] = run.cursor[HELD], REST
        event[DELAY] = max(0.0, (run.held.since[0] - half) * half_time + run.held.since[1])
        write_state(event, run.held.state)
    else:
        write_state(event, run.u)


@inlined
def record_event(run: Run, half: int, time: float, stop: float, velocity: float, kind: int) -> None:
    """Record an event without a delay, and the free state after it; if the record is full it is only counted."""
    row = run.cursor[EVENT_COUNT]
    if row < run.events.shape[0]:
        run.events[row, HALF] = half
        run.events[row, TIME] = time
        run.events[row, STOP] = stop
        run.events[row, VELOCITY] = velocity
        run.events[row, KIND] = kind
        run.events[row, DELAY] = 0.0
        write_state(run.events[row], run.u)
    run.cursor[EVENT_COUNT] = row + 1
