"""Small changes of the state along all lanes, half period by half period, as in `lyapunov` for one trajectory.

After a half period the lanes' events hold its impacts, which determine the propagation of changes between rests. Pairs
and single changes are propagated side by side (`tangent_batches`) where the flow over half a period is tabulated, lanes
with about as many impacts together. A half period with a rest, with an impact at speed 0, or with more impacts than the
events hold is computed again for the lane alone (`tangent`), from the lane's state at its start. The errors of the
lanes (`lane_errors`) are carried along; the change that gives them is the first one whose growth is measured.

    begin_matrix_of, begin_growth_of     start propagating changes along a lane
    save_lane_starts                     at the start of a half period, all lanes
    count_impacts, carry_changes         at its end
"""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.codes import GROWTH_UNDECIDED
from grazemap_core.contact.kernels.cells import CellProblem, contact_acceleration_of, reference_at
from grazemap_core.contact.kernels.runs import (
    EVENT_COLUMNS,
    EVENT_COUNT,
    HELD_LEFT,
    HELD_RIGHT,
    IMPACT,
    KIND,
    OK,
    STOP,
    TIME,
    VELOCITY,
    ContactState,
    Run,
    contact_of_lane,
    contact_of_run,
    contact_states,
    copy_contact,
    new_run,
)
from grazemap_core.contact.kernels.stops import Stops, restitution_of
from grazemap_core.maps.kernels.lane_errors import (
    LaneErrors,
    begin_change,
    carry_error,
    lane_errors,
    largest_reach,
    lose_error,
    move_error,
    shorten_change,
    steepest_impact,
)
from grazemap_core.maps.kernels.lane_tables import LANES, LaneModel, LaneModels
from grazemap_core.maps.kernels.lanes import EVENT_ACCELERATION, FREE, Lanes, lane_stops, state_of_lane
from grazemap_core.maps.kernels.lockstep import Engine
from grazemap_core.maps.kernels.tangent_batches import (
    BATCH,
    REMAINDER,
    SHARPEST,
    SQUARE,
    STEEPEST,
    TangentBatch,
    carry_batch,
    tangent_batch,
)
from grazemap_core.maps.tolerances import HALF_PERIOD_EVENTS
from grazemap_core.model.kernels.block_flow import advance_columns
from grazemap_core.numerics.jit.compiled import copy_matrix, copy_vector, kernel, plain
from grazemap_core.numerics.jit.lane_values import record_of
from grazemap_core.orbits.tolerances import MAX_VERIFIED_IMPACTS
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.kernels import lyapunov
from grazemap_core.simulation.kernels.tangent import apply_saltation, run_half_linearised
from grazemap_core.simulation.tolerances import GROWTH_SURE

RECORDED_IMPACTS = MAX_VERIFIED_IMPACTS + HALF_PERIOD_EVENTS
"""Capacity of a lane's events. In at least half of all cases this suffices for all impacts of a motion that is to be
verified; otherwise the motion is run again to obtain them."""
SCALAR_EVENTS = 4096
"""Maximum number of events in half a period with which changes are propagated."""

NOTHING, ALL, FIRST, PAIR, LOST = 0, 1, 2, 3, 4
"""Changes along a lane, but the one of its error: none; a basis of all; that one, with its growth; it and another one,
which are kept orthonormal, with their growth; or propagation has failed."""

NOT_ALL = -1
"""Number of impacts of a half period that are not all in a lane's events, or not all of nonzero speed."""
MOST_SORTED = 16
"""Number of impacts from which on lanes are not sorted by it any further."""


class LaneTangents(NamedTuple):
    """Small changes of the state along every lane."""

    carried: Integers
    """(LANES,) NOTHING, ALL, FIRST, PAIR or LOST."""
    grown: Integers
    """(LANES,) Half periods over which growth was measured."""
    paired: Integers
    """(LANES,) Half periods of these before the second change."""
    full: Floats
    """(LANES, 2 N, 2 N) A basis of all changes, as columns."""
    growth: Floats
    """(LANES, halves, 2) As in `lyapunov.Tangents`."""
    moments: Floats
    """(LANES, 2, 2 N, 2) As in `lyapunov.Tangents`."""
    errors: LaneErrors
    """The errors of the lanes."""
    wanted: Integers
    """(LANES,) Number of changes that are carried along."""
    impacts: Integers
    """(LANES,) Number of impacts in the half period; NOT_ALL with others or with a rest."""
    sorted: Integers
    """(LANES,) Lanes, sorted by `impacts`."""
    places: Integers
    """(MOST_SORTED + 2,) Scratch."""
    even: Floats
    """`Lanes.even` at the start of the half period."""
    contacts: ContactState
    """`Lanes.contacts` at the start of the half period."""
    batch: TangentBatch
    """Scratch of a batch of lanes."""
    scratch: lyapunov.Tangents
    """Scratch for the changes along a lane alone."""
    run: Run
    """Scratch for a lane alone."""
    began: Run
    """Scratch for a lane alone: its state at the start of the half period."""


def lane_tangents(masses: int, harmonics: int, halves: int) -> LaneTangents:
    """Return arrays for changes along lanes, none of which has any, and for growth over `halves` half periods.

    The oscillator has so many masses and harmonics of the forces.
    """
    size = 2 * masses
    return LaneTangents(
        carried=np.zeros(LANES, dtype=np.int64),
        grown=np.zeros(LANES, dtype=np.int64),
        paired=np.zeros(LANES, dtype=np.int64),
        full=np.zeros((LANES, size, size)),
        growth=np.zeros((LANES, halves, 2)),
        moments=np.zeros((LANES, 2, size, 2)),
        errors=lane_errors(masses),
        wanted=np.zeros(LANES, dtype=np.int64),
        impacts=np.zeros(LANES, dtype=np.int64),
        sorted=np.zeros(LANES, dtype=np.int64),
        places=np.zeros(MOST_SORTED + 2, dtype=np.int64),
        even=np.zeros((2 * masses + 2) * LANES),
        contacts=contact_states(masses, LANES),
        batch=tangent_batch(masses),
        scratch=lyapunov.tangents(masses, (halves + 1) // 2),
        run=new_run(masses, harmonics, SCALAR_EVENTS),
        began=new_run(masses, harmonics),
    )


@kernel
def tangents_of_lane(tangents: LaneTangents, lane: int) -> lyapunov.Tangents:
    """Return the changes along one lane as the argument of functions of `lyapunov`."""
    return lyapunov.Tangents(
        tangents.full[lane],
        tangents.scratch.eigen,
        tangents.scratch.real,
        tangents.scratch.imaginary,
        tangents.growth[lane],
        tangents.scratch.series,
        tangents.moments[lane],
    )


@kernel
def move_tangents(tangents: LaneTangents, source: int, target: int) -> None:
    """Move a lane's changes to another lane, between half periods."""
    tangents.carried[target] = tangents.carried[source]
    tangents.carried[source] = NOTHING
    tangents.grown[target] = tangents.grown[source]
    tangents.paired[target] = tangents.paired[source]
    copy_matrix(tangents.full[target], tangents.full[source])
    copy_matrix(tangents.growth[target], tangents.growth[source])
    for part in range(2):
        copy_matrix(tangents.moments[target, part], tangents.moments[source, part])
    move_error(tangents.errors, source, target)


@kernel
def save_lane_starts(group: Lanes, tangents: LaneTangents, used: int) -> None:
    """Save the states of the lanes at the start of a half period."""
    even, saved, regime = group.even, tangents.even, group.regime
    cursor, saved_cursor = group.contacts.cursor, tangents.contacts.cursor
    for c in range(even.shape[0] // LANES):
        copy_vector(saved[c * LANES : c * LANES + used], even[c * LANES : c * LANES + used])
    for lane in range(used):
        for c in range(4):
            saved_cursor[lane, c] = cursor[lane, c]
        if regime[lane] != FREE:  # few lanes are not
            copy_contact(contact_of_lane(tangents.contacts, lane), contact_of_lane(group.contacts, lane))


@kernel
def _carry_through_impacts(model: LaneModel, stops: Stops, impacts: Floats, columns: Floats) -> None:
    """Propagate changes along a half period without rests, whose impacts are these rows of a lane's events."""
    problem, viscous_term, passed, count = model.forced.free, model.forced.held.viscous_term, 0.0, impacts.shape[0]
    for row in range(count + 1):
        time = impacts[row, TIME] if row < count else problem.step * (problem.cells // 2)
        advance_columns(problem, columns, time - passed)
        passed = time
        if row < count:
            # the viscous term of the acceleration changes sign with the velocity
            speed, restitution = abs(impacts[row, VELOCITY]), restitution_of(stops, impacts[row, STOP])
            before = impacts[row, EVENT_ACCELERATION] - viscous_term * (1.0 + restitution) * speed
            apply_saltation(problem, restitution, speed, before, columns)


@kernel
def _carry_alone(engine: Engine, tangents: LaneTangents, lane: int, half: int, columns: Floats, elapsed: float) -> int:
    """Propagate changes to the end of a half period of one lane. Returns a status as `tangent.run_half_linearised`."""
    model, group, run = record_of(engine.models, lane), engine.group, tangents.run
    problem, stops, impacts = model.forced.free, lane_stops(group, lane), tangents.impacts[lane]
    if elapsed > 0.0:
        advance_columns(problem, columns, elapsed)
    if impacts == NOT_ALL:
        state_of_lane(tangents.even, lane, run.u)
        copy_contact(contact_of_run(run), contact_of_lane(tangents.contacts, lane))
        return run_half_linearised(model.forced, stops, run, half, columns, tangents.began)
    first = tangents.contacts.cursor[lane, EVENT_COUNT]
    _carry_through_impacts(model, stops, group.events[lane][first : first + impacts], columns)
    return OK


@kernel
def count_impacts(group: Lanes, tangents: LaneTangents, used: int) -> None:
    """Write `tangents.impacts` of the half period that `run_half` has run since `save_lane_starts`."""
    before, after, mixed, impacts = tangents.contacts.cursor, group.contacts.cursor, group.mixed, tangents.impacts
    for lane in range(used):
        rows = after[lane, EVENT_COUNT]
        known = mixed[lane] == 0 and rows <= group.events.shape[1]
        impacts[lane] = rows - before[lane, EVENT_COUNT] if known else NOT_ALL


@kernel
def _sort_by_impacts(models: LaneModels, tangents: LaneTangents, changes: int, used: int) -> int:
    """Write the lanes with `changes` changes that can be carried in batches to `tangents.sorted`, by number of impacts.

    Returns their number.
    """
    wanted, impacts, places, ready = tangents.wanted, tangents.impacts, tangents.places, tangents.sorted
    if models.shared.tables.block_response.shape[0] == 0:
        return 0
    last = places.shape[0] - 1
    for place in range(last + 1):
        places[place] = 0
    for lane in range(used):
        if wanted[lane] == changes and impacts[lane] != NOT_ALL:
            places[min(impacts[lane], last - 1) + 1] += 1
    for place in range(last):
        places[place + 1] += places[place]
    for lane in range(used):
        if wanted[lane] == changes and impacts[lane] != NOT_ALL:
            number = min(impacts[lane], last - 1)
            ready[places[number]] = lane
            places[number] += 1
    return int(places[last])


@kernel
def _fill_batch(tangents: LaneTangents, begin: int, count: int) -> int:
    """Put lanes of `tangents.sorted` into the batch, from number `begin` on; `count` are sorted. Returns how many.

    Only the first batch, with the fewest impacts, may have fewer than WIDTH.
    """
    batch = tangents.batch
    filled = (count - 1) % BATCH + 1 if begin == 0 else BATCH
    for k in range(filled):
        lane = tangents.sorted[begin + k]
        batch.lanes[k], batch.first[k] = lane, tangents.contacts.cursor[lane, EVENT_COUNT]
        batch.impacts[k] = tangents.impacts[lane]
    return filled


@kernel
def _is_measured(tangents: LaneTangents, lane: int) -> bool:
    """Return whether the growth of changes along a lane is measured."""
    return bool(tangents.carried[lane] == FIRST or tangents.carried[lane] == PAIR)


@kernel
def _flow_to_end(problem: CellProblem, tangents: LaneTangents, lane: int) -> None:
    """Carry changes on to the end of a half period, and add their growth to it."""
    k, growth, columns = tangents.grown[lane], tangents.growth[lane], tangents.errors.changes[lane]
    elapsed = tangents.errors.elapsed[lane]
    advance_columns(problem, columns, elapsed)
    first, second = growth[k, 0], growth[k, 1]
    lyapunov.orthonormalise(problem.frequency, columns, growth[k])
    growth[k, 0] += first
    growth[k, 1] += second
    tangents.errors.elapsed[lane] = 0.0


@kernel
def _is_chaotic(tangents: LaneTangents, lane: int, skipped: int) -> bool:
    """Return whether the change along a lane has grown, as far as this was measured, as only chaos makes it."""
    k, growth, total = tangents.grown[lane], tangents.growth[lane], 0.0
    for row in range(skipped, k):
        total += growth[row, 0]
    return total > GROWTH_SURE


@kernel
def _begin_pair(problem: CellProblem, tangents: LaneTangents, lane: int) -> None:
    """Propagate a second change too."""
    k, columns = tangents.grown[lane], tangents.errors.changes[lane]
    tangents.carried[lane], tangents.paired[lane] = PAIR, k
    lyapunov.begin_second(problem.frequency, columns)
    lyapunov.orthonormalise(problem.frequency, columns, tangents.growth[lane, k])


@kernel
def carry_changes(engine: Engine, tangents: LaneTangents, half: int, skipped: int, used: int) -> None:
    """Propagate changes along the half period since `save_lane_starts`, and the errors, after `count_impacts`.

    Parameters
    ----------
    half : int
        Index of the half period.
    skipped : int
        Half periods at the start of a measurement of growth that do not count.
    """
    carried, errors, status = tangents.carried, tangents.errors, engine.group.status
    for lane in range(used):
        if status[lane] != OK:
            carried[lane], errors.carried[lane] = NOTHING, 0
        if _is_measured(tangents, lane) and tangents.grown[lane] == tangents.growth.shape[1]:
            carried[lane] = NOTHING
        if carried[lane] == ALL and _carry_alone(engine, tangents, lane, half, tangents.full[lane], 0.0) != OK:
            carried[lane] = LOST
    wanted, singles, pairs = tangents.wanted, 0, 0
    for lane in range(used):
        if carried[lane] == PAIR:
            wanted[lane] = 2
            pairs += 1
        elif carried[lane] == FIRST or errors.carried[lane] != 0:
            wanted[lane] = 1
            singles += 1
        else:
            wanted[lane] = 0
    if pairs > 0:
        _carry_lanes((0, 0), engine, tangents, half, skipped, used)
    if singles > 0:
        _carry_lanes((0,), engine, tangents, half, skipped, used)


@kernel
def _carry_lanes(
    columns: tuple[int, ...], engine: Engine, tangents: LaneTangents, half: int, skipped: int, used: int
) -> None:
    """Propagate the changes of the lanes that want as many of them as `columns` has entries."""
    models, group = engine.models, engine.group
    errors, wanted, batch = tangents.errors, tangents.wanted, tangents.batch
    count = _sort_by_impacts(models, tangents, len(columns), used)
    for lane in range(used):
        if wanted[lane] == len(columns) and (count == 0 or tangents.impacts[lane] == NOT_ALL):
            _carry_by_itself(engine, tangents, lane, half, skipped)
    begin = plain(0)
    while begin < count:
        filled = _fill_batch(tangents, begin, count)
        begin += filled
        carry_batch(columns, engine, batch, filled, errors.changes, errors.elapsed)
        for k in range(filled):
            lane, square, rest = batch.lanes[k], batch.rows[SQUARE * BATCH + k], batch.rows[REMAINDER * BATCH + k]
            problem = record_of(models, lane).forced.free
            if not square > 0.0:
                square = _make_orthonormal(problem.frequency, tangents, lane)
            elif _is_measured(tangents, lane):
                entry = tangents.growth[lane, tangents.grown[lane]]
                entry[0] = 0.5 * math.log(square)
                if len(columns) == 2:
                    entry[1] = 0.5 * math.log(rest) if rest > 0.0 else -np.inf
            if errors.carried[lane] != 0:
                sharpest, steepest = batch.rows[SHARPEST * BATCH + k], batch.rows[STEEPEST * BATCH + k]
                carry_error(group, errors, lane, square, sharpest / largest_reach(problem), steepest)
            _enter_growth(engine, tangents, lane, half, skipped)


@kernel
def _carry_by_itself(engine: Engine, tangents: LaneTangents, lane: int, half: int, skipped: int) -> None:
    """Propagate the changes of one lane."""
    group, errors, impacts, steepest = engine.group, tangents.errors, tangents.impacts[lane], 0.0
    if impacts != NOT_ALL:
        first = tangents.contacts.cursor[lane, EVENT_COUNT]
        steepest = steepest_impact(group.events[lane][first : first + impacts])
    if _carry_alone(engine, tangents, lane, half, errors.changes[lane], errors.elapsed[lane]) != OK:
        if errors.carried[lane] != 0:
            lose_error(errors, lane)
        if _is_measured(tangents, lane):
            tangents.carried[lane] = LOST
        return
    errors.elapsed[lane] = 0.0
    problem = record_of(engine.models, lane).forced.free
    if impacts == NOT_ALL:
        rests = group.tally[HELD_RIGHT, lane] + group.tally[HELD_LEFT, lane] != 0.0
        steepest = steepest_in_run(problem, tangents.run, half, rests)
    square = _make_orthonormal(problem.frequency, tangents, lane)
    if errors.carried[lane] != 0:
        carry_error(group, errors, lane, square, steepest, steepest)
    _enter_growth(engine, tangents, lane, half, skipped)


@kernel
def steepest_in_run(problem: CellProblem, run: Run, half: int, rests: bool) -> float:
    """Return the largest 2 |a|/v^2 of the impacts of a half period that was run alone.

    Where the contact rests, impacts that press it against the stop do not count, as those of the chatter before the
    rest: they cannot vanish.
    """
    first_cell, steepest = half % 2 * (problem.cells // 2), 0.0
    for row in range(run.cursor[EVENT_COUNT]):
        velocity = run.events[row, VELOCITY]
        if run.events[row, KIND] != IMPACT:
            if not rests:
                return np.inf
            continue
        after = run.events[row, EVENT_COLUMNS:].reshape(run.u.shape)
        _, _, reference = reference_at(problem, first_cell, run.events[row, TIME])
        toward = run.events[row, STOP] * contact_acceleration_of(problem, after, reference)
        if rests and toward > 0.0:
            continue
        if velocity == 0.0:
            return np.inf
        steepest = max(steepest, 2.0 * abs(toward) / velocity**2)
    return steepest


@kernel
def _make_orthonormal(frequency: Floats, tangents: LaneTangents, lane: int) -> float:
    """Make a lane's changes orthonormal, and write their growth where it is measured.

    Where nothing is left of the first one, another begins. Returns the square of its growth.
    """
    errors, carried = tangents.errors, tangents.carried[lane]
    if not _is_measured(tangents, lane):
        return shorten_change(frequency, errors, lane)
    growth = tangents.growth[lane, tangents.grown[lane]]
    if carried == FIRST:
        square = shorten_change(frequency, errors, lane)
        growth[0] = 0.5 * math.log(square) if square > 0.0 else -np.inf
        return square
    lyapunov.orthonormalise(frequency, errors.changes[lane], growth)
    if growth[0] == -np.inf:
        begin_change(frequency, errors, lane)
    return math.exp(2.0 * growth[0])


@kernel
def _enter_growth(engine: Engine, tangents: LaneTangents, lane: int, half: int, skipped: int) -> None:
    """Count a half period in which the growth along a lane was written; enter the moments of the orbit."""
    if not _is_measured(tangents, lane):
        return
    problem, even, first = (
        record_of(engine.models, lane).forced.free,
        engine.group.even,
        tangents.carried[lane] == FIRST,
    )
    k, halves, sign = tangents.grown[lane], tangents.growth.shape[1], 1.0 if half % 2 == 0 else -1.0
    middle = skipped + (halves - skipped) // 2  # of those that count, as in `lyapunov`
    if (k + 1 == skipped or k + 1 == middle or k + 1 == halves) and tangents.errors.elapsed[lane] != 0.0:
        _flow_to_end(problem, tangents, lane)  # so that sums over what counts are those of whole half periods
    tangents.grown[lane] = k + 1
    if k >= skipped and not (first and k >= middle):  # without a second change the motion is chaotic
        moments = tangents.moments[lane, 0 if 2 * (k - skipped) < halves - skipped else 1]
        for c in range(moments.shape[0]):
            z = sign * even[c * LANES + lane]
            moments[c, 0] += z
            moments[c, 1] += z * z
    if first and k + 1 == middle and not _is_chaotic(tangents, lane, skipped):
        _begin_pair(problem, tangents, lane)


@kernel
def begin_matrix_of(tangents: LaneTangents, lane: int) -> None:
    """Start propagating a basis of all changes of the state along a lane."""
    tangents.carried[lane] = ALL
    lyapunov.begin_matrix(tangents_of_lane(tangents, lane))


@kernel
def begin_growth_of(problem: CellProblem, tangents: LaneTangents, lane: int) -> None:
    """Start measuring the growth of two changes along a lane, or of one where the error is as large as the motion.

    In the latter case the second change follows in the middle, unless the first has grown by then as only in chaos.
    """
    errors = tangents.errors
    tangents.carried[lane], tangents.grown[lane] = FIRST, 0
    tangents.moments[lane][:] = 0.0
    saturated = errors.carried[lane] == 0 and errors.square[lane] > 0.0
    if errors.carried[lane] == 0:
        begin_change(problem.frequency, errors, lane)
    if not saturated:
        _begin_pair(problem, tangents, lane)


@kernel
def multiplier_of_lane(problem: CellProblem, tangents: LaneTangents, lane: int) -> float:
    """Return the largest modulus of the eigenvalues of a lane's full columns, NaN where they could not be computed."""
    return lyapunov.leading_multiplier(problem, tangents_of_lane(tangents, lane))


@kernel
def growth_of_lane(
    problem: CellProblem, unit: float, skipped: int, tangents: LaneTangents, lane: int
) -> tuple[int, float, float]:
    """Return the kind of motion that the growth along a lane implies, the largest exponent per time, and its error.

    NaN where growth was not measured to the end.
    """
    halves, carried = tangents.growth.shape[1], tangents.carried[lane]
    if not _is_measured(tangents, lane) or tangents.grown[lane] != halves:
        return GROWTH_UNDECIDED, np.nan, np.nan
    paired = tangents.paired[lane]
    second_skipped = paired + paired % 2 + skipped if carried == PAIR else halves  # even
    return lyapunov.classify_growth(problem, unit, skipped, second_skipped, tangents_of_lane(tangents, lane))
