"""Verification of the motion that a trajectory converges to: an isolated orbit, admissible, stable, of minimum period.

The impacts of a trajectory that nearly returns, taken from its events (`guess_from_record`) or from a simulation of its
next half periods (`guess_from_replay`), are the guess from which Newton's method starts. The orbit is then a solution
of its own equations (`shooting`), independent of the trajectory. It is verified when, as certainly as floating-point
numbers allow,

- it is isolated: the equations have exactly one solution within a radius of the numbers (`newton`);
- it is admissible: every impact velocity points at its stop, and the contact has no other contact with a stop
  (`admissibility.further_contact_from`), for all phases and velocities within that radius;
- it is stable: all Floquet multipliers lie inside the unit circle;
- its period is the minimum: two parts of the orbit count as the same only where the uniqueness of the solution implies
  it.

Whether the trajectory is captured by this orbit is decided too (`capture`): the orbit may exist and the trajectory may
still touch a stop where the orbit only passes near it.
"""

from __future__ import annotations

import math

import numpy as np

from grazemap_core import codes
from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import CellProblem, Forced
from grazemap_core.contact.kernels.half_period import run_half
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.model.kernels.block_flow import advance_block
from grazemap_core.model.kernels.response_sums import ALTERNATING, SAME_SIGN, block_sum
from grazemap_core.model.tolerances import RESPONSE_ROUNDOFF
from grazemap_core.numerics.jit.compiled import copy_matrix, kernel
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.numerics.kernels.eigenvalues import spectral_radius
from grazemap_core.orbits import tolerances
from grazemap_core.orbits.kernels.admissibility import (
    NO_FURTHER_CONTACT,
    ContactScratch,
    add_impulse,
    apply_flow,
    contact_scratch,
    further_contact_from,
)
from grazemap_core.orbits.kernels.capture import CaptureScratch, capture_ratio, capture_scratch
from grazemap_core.orbits.kernels.equations import (
    OrbitImpacts,
    OrbitProblem,
    largest_rebound,
    next_phase,
    second_derivative_bound,
)
from grazemap_core.orbits.kernels.multipliers import block_scale
from grazemap_core.orbits.kernels.shooting import (
    Shooting,
    ShotOrbit,
    norm_of_inverse,
    shoot,
    shooting,
    solve_step,
)
from grazemap_core.records import NamedTuple


class ImpulseBlocks(NamedTuple):
    """What verification takes of the blocks of a structure, beside the fields of `CellProblem`."""

    frequency: Floats
    """(N,) The root of frequency_squared, also for a free mode: verification then fails."""
    unit_impulse: Floats
    """(N, 2) As in `equations.OrbitProblem`."""
    verifiable: bool
    """Whether motions are to be verified and all modes are damped and well-conditioned."""


class Guess(NamedTuple):
    """What is expected of the orbit near a trajectory."""

    impacts: int
    """Number of its impacts, which `VerificationScratch` has; 0 where they are not known."""
    length: int
    """Half periods after which the trajectory nearly returns; even, unless the stops are symmetric."""
    distance: float
    """Distance of the orbit from the trajectory, in units of `Stops.unit`."""
    error: float
    """Distance up to which the trajectory is known, in displacement of the contact."""


class VerificationScratch(NamedTuple):
    """Scratch of a verification, for up to MAX_VERIFIED_IMPACTS impacts and N blocks."""

    replay: runs.Run
    """The run of `guess_from_replay`."""
    sides: Floats
    """(impacts,) Stops of the impacts."""
    guess: Floats
    """(2, impacts) Phases and speeds of the guess."""
    solution: Floats
    """(2, impacts) Phases and speeds of the orbit."""
    periodic_impulse: Floats
    """(N, 2) A field of `OrbitProblem`."""
    unused: Floats
    """(N, 2) Takes the place of fields of `OrbitProblem` that are not needed."""
    shooting: Shooting
    """For the solution of the orbit."""
    contact: ContactScratch
    """For the search for contacts."""
    capture: CaptureScratch
    """For the ball of capture."""
    real: Floats
    """(2 N,) Real parts of the Floquet multipliers."""
    imaginary: Floats
    """(2 N,) Imaginary parts of these multipliers."""


class Verification(NamedTuple):
    """The result of a verification."""

    reason: int
    """RESOLVED where the motion is verified; otherwise the code of `codes` that says why it is not, and all other
    fields are meaningless."""
    length: int
    """Half periods after which the motion repeats, or is mirrored: an odd m stands for a symmetric motion of m forcing
    periods, an even m for a motion of m/2."""
    right: int
    """Impacts on the right stop in `length` half periods."""
    left: int
    """Impacts on the left stop in `length` half periods."""
    min_impact_speed: float
    """Speed of the slowest impact."""
    multiplier: float
    """Largest modulus of the Floquet multipliers over `length` half periods."""
    mean_position: float
    """Mean displacement of q, less the steady motion, at the beginnings of forcing periods, in units of
    `Stops.unit`."""
    mean_velocity: float
    """Mean velocity of q, likewise, in units of omega times `Stops.unit`."""
    ratio: float
    """Below 1: the trajectory is captured by the orbit (`capture.capture_ratio`). Otherwise the factor by which its
    distance from the orbit has to become smaller."""


def verification_scratch(blocks: int, harmonics: int) -> VerificationScratch:
    """Return scratch for an oscillator with so many masses and harmonics of the forces."""
    most = tolerances.MAX_VERIFIED_IMPACTS
    return VerificationScratch(
        replay=runs.new_run(blocks, harmonics, most),
        sides=np.zeros(most),
        guess=np.zeros((2, most)),
        solution=np.zeros((2, most)),
        periodic_impulse=np.zeros((blocks, 2)),
        unused=np.zeros((blocks, 2)),
        shooting=shooting(most, blocks),
        contact=contact_scratch(0, blocks),
        capture=capture_scratch(most, blocks),
        real=np.zeros(2 * blocks),
        imaginary=np.zeros(2 * blocks),
    )


@kernel
def _not_verified(reason: int) -> Verification:
    return Verification(reason, 0, 0, 0, math.nan, math.nan, math.nan, math.nan, math.inf)


@kernel
def unit_of_speeds(problem: CellProblem, stops: Stops) -> float:
    """Return the unit of displacements; that of velocities is omega times it."""
    return max(problem.lasting_bound, stops.unit)


@kernel
def _write_guess(
    problem: CellProblem, stops: Stops, events: Floats, half: int, sign: float, scratch: VerificationScratch
) -> int:
    """Write the impacts in rows of events as a guess, and return their number.

    Phases count from the beginning of half period `half`; stops and speeds are multiplied by sign. The number is 0
    where an event is no impact, or there are too many.
    """
    count: int = events.shape[0]
    if count > scratch.sides.shape[0]:
        return 0
    unit = unit_of_speeds(problem, stops)
    for i in range(count):
        event = events[i]
        if event[runs.KIND] != runs.IMPACT:
            return 0
        scratch.sides[i] = sign * event[runs.STOP]
        scratch.guess[0, i] = math.pi * (event[runs.HALF] - half) + problem.omega * event[runs.TIME]
        scratch.guess[1, i] = sign * event[runs.VELOCITY] / (problem.omega * unit)
    return count


@kernel
def guess_from_record(
    problem: CellProblem, stops: Stops, half: int, length: int, events: Floats, scratch: VerificationScratch
) -> int:
    """Write the impacts of the last `length` half periods before `half` as a guess; return as `guess_from_replay`.

    `events` (m, LANE_EVENT_COLUMNS) are those of the trajectory, complete from half period ``half - length`` on.
    """
    first = events.shape[0]
    while first > 0 and events[first - 1, runs.HALF] >= half - length:
        first -= 1
    # half a period later the forcing has the opposite sign, so the motion is mirrored
    sign = 1.0 if length % 2 == 0 else -1.0
    return _write_guess(problem, stops, events[first:], half - length, sign, scratch)


@kernel
def guess_from_replay(forced: Forced, stops: Stops, half: int, length: int, scratch: VerificationScratch) -> int:
    """Simulate the next `length` half periods and write their impacts as a guess; return the number of impacts.

    State and regime of `scratch.replay` are those after `half` half periods, an even number. Phases count from there.
    The number is 0 where an event is no impact, or there are too many.
    """
    run = scratch.replay
    run.cursor[runs.EVENT_COUNT] = 0
    for k in range(length):
        if run_half(forced, stops, run, half + k) != runs.OK:
            return 0
        if run.cursor[runs.EVENT_COUNT] > scratch.sides.shape[0]:
            return 0
    return _write_guess(forced.free, stops, run.events[: run.cursor[runs.EVENT_COUNT]], half, 1.0, scratch)


@kernel
def _reach(problem: OrbitProblem, impacts: OrbitImpacts, radius: float) -> float:
    """Return a bound on the change of q when every phase and speed changes by at most `radius`."""
    speeds, by_speed, by_phase = impacts.speeds, 0.0, 0.0
    for j in range(problem.decay.shape[0]):
        y, rate = problem.periodic_impulse[j, 0], problem.periodic_impulse[j, 1]
        second_derivative = -problem.frequency_squared[j] * y - 2.0 * problem.decay[j] * rate
        by_speed += math.hypot(y, rate / problem.frequency[j])
        by_phase += math.hypot(problem.frequency[j] * rate, second_derivative) / problem.frequency[j]
    total = 0.0
    for i in range(speeds.shape[0]):
        total += abs(speeds[i])
    rebound = largest_rebound(impacts)
    reach: float = radius * rebound * (problem.omega * by_speed * speeds.shape[0] + by_phase * total)
    return reach


@kernel
def _repeats(impacts: OrbitImpacts, shift: int, angle: float, sign: float) -> tuple[bool, float]:
    """Compare each impact with the one `shift` impacts later, moved back by `angle` and multiplied by `sign`.

    Returns whether the stops agree, and the largest difference of phases or speeds.
    """
    sides, phases, speeds = impacts.sides, impacts.phases, impacts.speeds
    count = sides.shape[0]
    away = 0.0
    for i in range(count - shift):
        if sides[i + shift] != sign * sides[i]:
            return False, math.inf
        away = max(away, abs(phases[i + shift] - phases[i] - angle), abs(speeds[i + shift] - sign * speeds[i]))
    return True, away


@kernel
def apparent_length(scratch: VerificationScratch, stops: Stops, count: int, length: int, away: float) -> int:
    """Return the smallest number of half periods after which the impacts of the guess repeat, to a distance `away`.

    A trajectory that converges to a motion is often closer to where it was several returns ago than to where it was one
    return ago, so `length` may be a multiple of the time after which its impacts repeat. `length` itself is returned if
    no part repeats.
    """
    if count == 0:
        return length
    for part in range(1, length // 2 + 1):
        if length % part != 0 or (count * part) % length != 0 or (part % 2 == 1 and not stops.symmetric):
            continue
        shift, sign = count * part // length, -1.0 if part % 2 == 1 else 1.0
        agree = True
        for i in range(count - shift):
            speed = scratch.guess[1, i]
            agree = (
                agree
                and scratch.sides[i + shift] == sign * scratch.sides[i]
                and abs(scratch.guess[1, i + shift] - sign * speed) <= away
                and abs(speed * (scratch.guess[0, i + shift] - scratch.guess[0, i] - math.pi * part)) <= away
            )
        if agree:
            return part
    return length


@kernel
def _least_length(impacts: OrbitImpacts, turn: float, length: int, radius: float, uniqueness_radius: float) -> int:
    """Return the minimum number of half periods after which the motion repeats; 0 if round-off hides it.

    Parameters
    ----------
    radius, uniqueness_radius : float
        There is a solution within `radius` of the numbers given, and no other one within `uniqueness_radius`.
    """
    count, symmetric = impacts.sides.shape[0], impacts.stops.symmetric
    for part in range(1, length // 2 + 1):
        if length % part != 0 or (count * part) % length != 0 or (part % 2 == 1 and not symmetric):
            continue
        sign = -1.0 if part % 2 == 1 else 1.0
        agree, away = _repeats(impacts, count * part // length, turn * part / length, sign)
        if not agree or away > tolerances.REPEATED_RADII * radius:
            continue
        # shifted by this part the motion is a solution of the same equations
        return part if away + radius < uniqueness_radius else 0
    return length


@kernel
def _state_after_first_impact(problem: OrbitProblem, impacts: OrbitImpacts, scratch: VerificationScratch) -> None:
    """Write the state just after the first impact into `contact.states[0]`; `shoot` has written the state before it."""
    after = scratch.contact.states[0]
    copy_matrix(after, scratch.shooting.state[0])
    add_impulse(problem, impacts, 0, 1.0, after)


@kernel
def _means(
    problem: OrbitProblem, impacts: OrbitImpacts, length: int, flow_between: Floats, state: Floats
) -> tuple[float, float]:
    """Return the means of displacement and velocity of q, less the steady motion, at multiples of the phase 2 pi.

    The means are in units of length, and of omega times length. For a symmetric motion they are taken over both halves,
    so its mirror image has the same means. `flow_between` (k, N, 4) are the flows between impacts; `state` (N, 2) is
    that just after the first impact, and overwritten.
    """
    phases, count = impacts.phases, impacts.phases.shape[0]
    turns = 2 if length % 2 == 1 else 1
    sections = length * turns // 2
    x, v = 0.0, 0.0
    section = math.ceil(phases[0] / (2.0 * math.pi))
    seen, sign = 0, 1.0
    for turn in range(turns):
        for i in range(count):
            begin = phases[i] + turn * problem.turn
            end = next_phase(problem, phases, i) + turn * problem.turn
            while seen < sections and 2.0 * math.pi * section < end:
                time = (2.0 * math.pi * section - begin) / problem.omega
                for j in range(state.shape[0]):
                    y, rate = advance_block(problem, j, state[j, 0], state[j, 1], time)
                    x += y
                    v += rate / problem.omega
                section += 1
                seen += 1
            if i + 1 == count:
                sign *= problem.sign
            apply_flow(flow_between[i], state, state)
            # a motion whose halves are mirror images is one between symmetric stops
            add_impulse(problem, impacts, (i + 1) % count, sign, state)
    return x / max(seen, 1), v / max(seen, 1)


@kernel
def _solve(problem: OrbitProblem, impacts: OrbitImpacts, scratch: VerificationScratch) -> tuple[float, float]:
    """Solve for the orbit near the phases and speeds of impacts by Newton's method, in place.

    Returns the Newton-Kantorovich quantity and the radius, as `newton.newton_kantorovich`; infinity where Newton's
    method does not converge.
    """
    sides, phases, speeds = impacts.sides, impacts.phases, impacts.speeds
    count = sides.shape[0]
    settled = False
    for _ in range(tolerances.VERIFICATION_STEPS):
        residual, terms = shoot(problem, impacts, scratch.shooting)
        step = solve_step(problem, impacts, scratch.shooting)
        if not step < math.inf or (settled and not residual <= tolerances.ORBIT_RESIDUAL * terms):
            return math.inf, math.inf
        if settled:
            inverse = norm_of_inverse(problem, impacts, scratch.shooting)
            step += inverse * RESPONSE_ROUNDOFF * terms
            return inverse * step * second_derivative_bound(problem, impacts, 2.0 * step), 2.0 * step
        for i in range(count):
            phases[i] += scratch.shooting.step[i, 0]
            speeds[i] += scratch.shooting.step[i, 1]
        for i in range(count):
            if not (next_phase(problem, phases, i) > phases[i] and sides[i] * speeds[i] > 0.0):
                return math.inf, math.inf
        settled = step <= tolerances.ORBIT_SETTLED
    return math.inf, math.inf


@kernel
def _write_floquet_matrix(problem: OrbitProblem, scratch: VerificationScratch) -> None:
    """Write the Floquet matrix before the first impact, in balanced block coordinates, into `capture.matrix`."""
    matrix = scratch.capture.matrix
    size = matrix.shape[0]
    for row in range(size):
        for column in range(size):
            matrix[row, column] = problem.sign * scratch.shooting.turned[row, column]
    for j in range(size // 2):
        # displacement and velocity in one unit; block units in which the impulse and its effect have equal size
        scale, frequency = block_scale(problem, j), problem.frequency[j]
        for other in range(size):
            matrix[2 * j, other] *= frequency / scale
            matrix[2 * j + 1, other] /= scale
            matrix[other, 2 * j] *= scale / frequency
            matrix[other, 2 * j + 1] *= scale


@kernel
def _repeated_impulses(problem: CellProblem, blocks: ImpulseBlocks, length: int, scratch: VerificationScratch) -> None:
    """Write the sums over all earlier spans of `length` half periods into scratch.

    The sums of the flow go into `shooting.closing`, the sums of a unit impulse into `periodic_impulse`.
    """
    span = 0.5 * length * problem.cells * problem.step
    kind = SAME_SIGN if length % 2 == 0 else ALTERNATING
    for j in range(problem.decay.shape[0]):
        square, twice = problem.frequency_squared[j], 2.0 * problem.decay[j]
        p, q, _ = block_sum(kind, problem.decay[j], problem.discriminant[j], square, 0.0, span)
        first, second = blocks.unit_impulse[j, 0], blocks.unit_impulse[j, 1]
        scratch.shooting.closing[j, 0], scratch.shooting.closing[j, 1] = p, q
        scratch.periodic_impulse[j, 0] = first + p * first + q * second
        scratch.periodic_impulse[j, 1] = second + p * second - q * (square * first + twice * second)


@kernel
def _orbit_problem(
    problem: CellProblem, blocks: ImpulseBlocks, stops: Stops, length: int, scratch: VerificationScratch
) -> OrbitProblem:
    """Return the equations of motions that repeat, or are mirrored, after `length` half periods.

    Without `doubled_impulse` and `periodic_impulse_by_span`, which verification does not use.
    """
    unit = unit_of_speeds(problem, stops)
    return OrbitProblem(  # by position: numba takes at most fifteen keyword arguments
        problem.decay,
        problem.discriminant,
        problem.frequency_squared,
        blocks.frequency,
        blocks.unit_impulse,
        scratch.periodic_impulse,
        scratch.unused,
        scratch.unused,
        problem.orders,
        problem.lasting_steady,
        problem.lasting_steady,  # in place of its derivative, which verification does not use
        unit,
        problem.omega,
        unit,
        length * math.pi,
        1.0 if length % 2 == 0 else -1.0,
    )


@kernel
def _distance_moved(impacts: OrbitImpacts, scratch: VerificationScratch) -> float:
    """Return the largest change of a speed, or of a phase times its speed, from the guess."""
    phases, speeds, moved = impacts.phases, impacts.speeds, 0.0
    for i in range(phases.shape[0]):
        shifted = abs(phases[i] - scratch.guess[0, i]) * abs(speeds[i])
        moved = max(moved, shifted, abs(speeds[i] - scratch.guess[1, i]))
    return moved


@kernel
def _slowest(impacts: OrbitImpacts) -> float:
    """Return the smallest impact speed."""
    sides, speeds, least = impacts.sides, impacts.speeds, math.inf
    for i in range(sides.shape[0]):
        least = min(least, sides[i] * speeds[i])
    return least


@kernel
def _smallest_gap(
    problem: OrbitProblem, impacts: OrbitImpacts, radius: float, floor: float, scratch: VerificationScratch
) -> float:
    """Return the smallest distance from a stop at an extremum between the impacts of every orbit within `radius`.

    The distance is positive where these orbits are admissible, and infinite where no extremum is within `floor` of a
    stop.
    """
    if not _slowest(impacts) > radius:
        return -math.inf
    _state_after_first_impact(problem, impacts, scratch)
    flow_between = scratch.shooting.flow[: impacts.phases.shape[0]]
    status, excess, _, _ = further_contact_from(problem, impacts, -floor, flow_between, scratch.contact)
    return -excess - _reach(problem, impacts, radius) if status == NO_FURTHER_CONTACT else -math.inf


@kernel
def _impacts_by_stop(sides: Floats, count: int) -> tuple[int, int]:
    """Return how many of the first `count` impacts are on the right stop, and on the left one."""
    right, left = 0, 0
    for i in range(count):
        if sides[i] > 0.0:
            right += 1
        else:
            left += 1
    return right, left


@kernel
def verify(
    problem: CellProblem, blocks: ImpulseBlocks, stops: Stops, guess: Guess, scratch: VerificationScratch
) -> Verification:
    """Solve for the orbit near a trajectory, and verify that it is isolated, admissible, stable and of minimum period.

    `sides` and `guess` of the scratch are as `guess_from_record` or `guess_from_replay` leave them; `capture.arrival`
    is the state of the trajectory from whose time on the phases of the guess count.
    """
    count, length, distance, error = guess
    if not blocks.verifiable:
        return _not_verified(codes.NOT_VERIFIED)
    if count == 0 or (length % 2 == 1 and not stops.symmetric):
        return _not_verified(codes.SEQUENCE_UNKNOWN)
    _repeated_impulses(problem, blocks, length, scratch)
    record = _orbit_problem(problem, blocks, stops, length, scratch)
    orbit = reference(record)
    sides, phases, speeds = scratch.sides[:count], scratch.solution[0, :count], scratch.solution[1, :count]
    impacts = reference(OrbitImpacts(stops, sides, phases, speeds))
    for i in range(count):
        phases[i], speeds[i] = scratch.guess[0, i], scratch.guess[1, i]
    kantorovich, radius = _solve(orbit, impacts, scratch)
    if not kantorovich < math.inf:
        return _not_verified(codes.NOT_SOLVED)
    if not _distance_moved(impacts, scratch) * orbit.length <= tolerances.ORBIT_NEARBY * distance * stops.unit:
        return _not_verified(codes.NOT_SOLVED)
    if not kantorovich <= tolerances.MAX_KANTOROVICH:
        return _not_verified(codes.NOT_ISOLATED)
    _write_floquet_matrix(orbit, scratch)
    multiplier = spectral_radius(scratch.capture.matrix, scratch.real, scratch.imaginary)
    stable = multiplier < tolerances.MAX_STABLE_MODULUS
    uncertainty = _reach(orbit, impacts, radius)
    ratio, reach, share = math.inf, 0.0, 1.0
    if stable:
        _write_floquet_matrix(orbit, scratch)  # the eigenvalues took its place
        shot, capture = reference(ShotOrbit(orbit, impacts, reference(scratch.shooting))), reference(scratch.capture)
        ratio, reach, share = capture_ratio(problem, shot, multiplier, uncertainty + error / orbit.length, capture)
    floor = max(tolerances.ORBIT_FLOOR, reach + uncertainty)
    gap = _smallest_gap(orbit, impacts, radius, floor, scratch)
    if not gap > 0.0:
        return _not_verified(codes.GRAZE_UNRESOLVED)
    if not stable:
        return _not_verified(codes.NOT_STABLE)
    # the solution is unique up to this distance: the larger zero of Kantorovich's majorant
    uniqueness_radius = 0.5 * radius * (1.0 + math.sqrt(1.0 - 2.0 * kantorovich)) / kantorovich
    least_length = _least_length(impacts, orbit.turn, length, radius, uniqueness_radius)
    if least_length == 0:
        return _not_verified(codes.NOT_DISTINCT)
    parts = length // least_length
    right, left = _impacts_by_stop(sides, count // parts)
    _state_after_first_impact(orbit, impacts, scratch)
    x, v = _means(orbit, impacts, length, scratch.shooting.flow[:count], scratch.contact.states[0])
    unit = orbit.length
    return Verification(
        codes.RESOLVED,
        least_length,
        right,
        left,
        _slowest(impacts) * unit * problem.omega,
        multiplier ** (1.0 / parts),
        x * unit / stops.unit,
        v * unit / stops.unit,
        max(ratio, reach / gap) / share,
    )
