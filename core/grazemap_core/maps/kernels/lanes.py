"""The lanes: trajectories side by side, each with its own stops, state and regime, and how one starts in a lane."""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats, Integers, aligned
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import (
    CellProblem,
    bounds,
    contact_acceleration_of,
    contact_motion,
    reach_from,
    reference_at,
    reference_at_half,
)
from grazemap_core.contact.kernels.first_contact import HERMITE_DIVISOR
from grazemap_core.contact.kernels.half_period import may_rest
from grazemap_core.contact.kernels.runs import ContactState, contact_of_lane, contact_states, copy_contact, put_on_stop
from grazemap_core.contact.kernels.stops import Stops, restitution_of
from grazemap_core.contact.tolerances import CONTACT_ROUNDING
from grazemap_core.maps.kernels.first_pass import LaneBatch, lane_batch
from grazemap_core.maps.kernels.lane_tables import LANES
from grazemap_core.maps.kernels.second_pass import PASS_ROWS, WIDTH
from grazemap_core.maps.tolerances import CLOSE_PASSAGE
from grazemap_core.numerics.jit.compiled import copy_vector, inlined, kernel, plain
from grazemap_core.records import NamedTuple

OUT_OF_REACH = 1e300
"""Gap of a lane that is out of use; finite, so that differences are finite too."""

FREE, NEAR, RESTING = 0, 1, 2
"""Regimes at the boundary of a cell."""

EVENT_ACCELERATION = runs.KIND + 1
"""Column of a lane's events after those of `runs.Run` up to KIND: acceleration toward the stop after an impact."""
LANE_EVENT_COLUMNS = runs.KIND + 2


class Lanes(NamedTuple):
    """States and regimes of all lanes."""

    even: Floats
    """((2 N + 2) * LANES,) State: (u, u') of every block, q and q'. `even` and `odd` alternate as the start and the end
    of a cell; a half period starts and ends in `even`."""
    odd: Floats
    """((2 N + 2) * LANES,) The other one of them."""
    gap: Floats
    """(2 * LANES,) Gap of the right stop of every lane, then of the left one."""
    restitution: Floats
    """(2 * LANES,) Restitution of the right stop of every lane, then of the left one."""
    unit: Floats
    """(LANES,) As in `stops.Stops`."""
    chatter_impacts: Floats
    """(LANES,) As in `stops.Stops`."""
    settling_chatter: Floats
    """(LANES,) As in `stops.Stops`."""
    symmetric: Integers
    """(LANES,) As in `stops.Stops`."""
    close: Floats
    """(LANES,) Distance from the stops up to which passages without a contact are bounded."""
    limit: Floats
    """(2 * LANES,) Limit of `first_pass.advance`."""
    reach: Floats
    """(LANES,) Bound of |q| for all time to come without impacts."""
    tally: Floats
    """(TALLY_SIZE, LANES) As in `runs.Run`."""
    regime: Integers
    """(LANES,) FREE between the stops, NEAR a stop that the contact has just left, RESTING on one."""
    contacts: ContactState
    """Of a lane that is not FREE, at the boundary of a cell; of all lanes the number of events."""
    status: Integers
    """(LANES,) OK, or why the trajectory ended."""
    events: Floats
    """(LANES, capacity, LANE_EVENT_COLUMNS) Events since the start of the trajectory, or since the caller emptied them
    (`cursor`); those beyond the capacity are counted only."""
    mixed: Integers
    """(LANES,) 1 if the events of the last half period are not all impacts with a speed, or if the contact rested in
    it."""
    deferred: Integers
    """(LANES,) Lanes that go through the present cell one by one."""
    deferred_state: Floats
    """(LANES, 2 N) (u, u') at which they start."""
    deferred_offset: Floats
    """(LANES,) Time in the cell at which they start."""
    flags: Integers
    """(LANES,) 1 if a lane may have a contact in the present cell."""
    flagged: Integers
    """(LANES + 1,) These lanes; then those of them that are FREE."""
    not_free: Integers
    """(LANES,) Those of them that are not FREE."""
    lane_of: Integers
    """(WIDTH,) Lanes of the second pass."""
    active: Integers
    """(WIDTH,) 1 if the second pass goes on with the lane."""
    first_pass: LaneBatch
    """Lanes of the first pass over the present cell."""
    second_pass: LaneBatch
    """Lanes of the second pass over it."""


def lanes(masses: int, events: int = 0) -> Lanes:
    """Return lanes out of use for an oscillator, each with the capacity for `events` events."""
    return Lanes(
        even=aligned(np.zeros((2 * masses + 2) * LANES)),
        odd=aligned(np.zeros((2 * masses + 2) * LANES)),
        gap=aligned(np.full(2 * LANES, OUT_OF_REACH)),
        restitution=aligned(np.zeros(2 * LANES)),
        unit=aligned(np.ones(LANES)),
        chatter_impacts=np.zeros(LANES),
        settling_chatter=np.zeros(LANES),
        symmetric=np.zeros(LANES, dtype=np.int64),
        close=aligned(np.zeros(LANES)),
        limit=aligned(np.full(2 * LANES, OUT_OF_REACH)),
        reach=aligned(np.zeros(LANES)),
        tally=aligned(np.zeros((runs.TALLY_SIZE, LANES))),
        regime=np.zeros(LANES, dtype=np.int64),
        contacts=contact_states(masses, LANES),
        status=np.zeros(LANES, dtype=np.int64),
        events=np.zeros((LANES, events, LANE_EVENT_COLUMNS)),
        mixed=np.zeros(LANES, dtype=np.int64),
        deferred=np.zeros(LANES, dtype=np.int64),
        deferred_state=np.zeros((LANES, 2 * masses)),
        deferred_offset=np.zeros(LANES),
        flags=aligned(np.zeros(LANES, dtype=np.int64)),
        flagged=np.zeros(LANES + 1, dtype=np.int64),
        not_free=np.zeros(LANES, dtype=np.int64),
        lane_of=np.zeros(WIDTH, dtype=np.int64),
        active=np.zeros(WIDTH, dtype=np.int64),
        first_pass=lane_batch(masses),
        second_pass=lane_batch(masses, WIDTH, PASS_ROWS),
    )


@kernel
def set_stops(group: Lanes, lane: int, stops: Stops) -> None:
    """Set the stops of a lane."""
    group.gap[lane], group.gap[LANES + lane] = stops.right, stops.left
    group.restitution[lane], group.restitution[LANES + lane] = stops.restitution_right, stops.restitution_left
    group.unit[lane] = stops.unit
    group.chatter_impacts[lane], group.settling_chatter[lane] = stops.chatter_impacts, stops.settling_chatter
    group.symmetric[lane] = 1 if stops.symmetric else 0


@kernel
def lane_stops(group: Lanes, lane: int) -> Stops:
    """Return the stops of a lane."""
    return Stops(
        group.gap[lane],
        group.gap[LANES + lane],
        group.restitution[lane],
        group.restitution[LANES + lane],
        group.unit[lane],
        group.chatter_impacts[lane],
        group.settling_chatter[lane],
        group.symmetric[lane] != 0,
    )


@inlined
def set_limits(limit: Floats, gap: Floats, lane: int, loss: float) -> None:
    """Set both limits of a lane, by how much they are below the gaps."""
    limit[lane] = (1.0 - CONTACT_ROUNDING) * gap[lane] - loss
    limit[LANES + lane] = (1.0 - CONTACT_ROUNDING) * gap[LANES + lane] - loss


@inlined
def no_limits(group: Lanes, lane: int) -> None:
    """Have every cell of a lane examined."""
    group.limit[lane] = -np.inf
    group.limit[LANES + lane] = -np.inf


@kernel
def clear_lane(group: Lanes, lane: int) -> None:
    """Take a lane out of use: at rest, with stops out of reach."""
    for c in range(group.even.shape[0] // LANES):
        group.even[c * LANES + lane] = 0.0
        group.odd[c * LANES + lane] = 0.0
    group.gap[lane], group.gap[LANES + lane] = OUT_OF_REACH, OUT_OF_REACH
    group.close[lane] = 0.0
    group.limit[lane], group.limit[LANES + lane] = OUT_OF_REACH, OUT_OF_REACH
    group.regime[lane] = FREE


@kernel
def state_of_lane(states: Floats, lane: int, u: Floats) -> None:
    """Write the state of a lane, of `states` like `Lanes.even`, to u (N, 2)."""
    for j in range(u.shape[0]):
        u[j, 0] = states[2 * j * LANES + lane]
        u[j, 1] = states[(2 * j + 1) * LANES + lane]


@kernel
def put_state(states: Floats, lane: int, u: Floats, x: float, v: float) -> None:
    """Write a state u (N, 2), with q = x and q' = v, to a lane of `states`."""
    blocks = u.shape[0]
    for j in range(blocks):
        states[2 * j * LANES + lane] = u[j, 0]
        states[(2 * j + 1) * LANES + lane] = u[j, 1]
    states[2 * blocks * LANES + lane] = x
    states[(2 * blocks + 1) * LANES + lane] = v


@kernel
def loss_of_limits(problem: CellProblem, u: Floats, close: float) -> float:
    """Return by how much the limits of `first_pass.advance` are below the gaps, but for the rounding of these."""
    reach, fourth = bounds(problem, u)
    square = problem.step * problem.step
    return close + CONTACT_ROUNDING * reach + square * square / HERMITE_DIVISOR * fourth


@kernel
def start_lane(group: Lanes, lane: int, problem: CellProblem, stops: Stops, u: Floats) -> None:
    """Start a trajectory between the stops in a lane, at the start of an even half period: u (N, 2) at phase 0."""
    set_stops(group, lane, stops)
    group.close[lane] = CLOSE_PASSAGE * stops.unit
    x, v = contact_motion(problem, u, *reference_at_half(problem, plain(0)))
    put_state(group.even, lane, u, x, v)
    group.reach[lane] = reach_from(problem, stops, u, plain(0))
    set_limits(group.limit, group.gap, lane, loss_of_limits(problem, u, group.close[lane]))
    group.regime[lane] = FREE
    group.contacts.cursor[lane] = 0
    group.status[lane] = runs.OK
    group.tally[:, lane] = 0.0
    group.tally[runs.MIN_SPEED, lane] = np.inf
    group.tally[runs.MIN_UNPRESSED_SPEED, lane] = np.inf
    group.tally[runs.MIN_GAP, lane] = np.inf


@kernel
def start_lane_on_stop(group: Lanes, lane: int, problem: CellProblem, stops: Stops, u: Floats, stop: int) -> None:
    """Start a trajectory on a stop in a lane, not moving into it, at the start of an even half period."""
    start_lane(group, lane, problem, stops, u)
    _, v = contact_motion(problem, u, *reference_at_half(problem, plain(0)))
    leaving = max(0.0, -stop * v)
    _, _, acceleration = reference_at(problem, plain(0), 0.0)
    contact_acceleration = stop * contact_acceleration_of(problem, u, acceleration)
    put_on_stop(group.contacts.cursor[lane], group.contacts.near[lane], stop, leaving)
    group.regime[lane] = RESTING  # its first cell is computed for this lane alone
    no_limits(group, lane)
    if may_rest(restitution_of(stops, stop), problem.step, contact_acceleration, leaving):
        group.status[lane] = runs.AT_STOP


@kernel
def move_lane(group: Lanes, source: int, target: int) -> None:
    """Copy a trajectory to a lane that is out of use, at the start of a half period."""
    for c in range(group.even.shape[0] // LANES):
        group.even[c * LANES + target] = group.even[c * LANES + source]
    set_stops(group, target, lane_stops(group, source))
    group.close[target] = group.close[source]
    group.limit[target], group.limit[LANES + target] = group.limit[source], group.limit[LANES + source]
    group.reach[target] = group.reach[source]
    group.regime[target] = group.regime[source]
    group.status[target] = group.status[source]
    copy_vector(group.tally[:, target], group.tally[:, source])
    copy_contact(contact_of_lane(group.contacts, target), contact_of_lane(group.contacts, source))
    for row in range(min(group.contacts.cursor[source, runs.EVENT_COUNT], group.events.shape[1])):
        copy_vector(group.events[target, row], group.events[source, row])
