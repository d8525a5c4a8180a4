"""Proof of the motion that a trajectory has come close to: there is one periodic orbit there, a motion, and stable.

A trajectory flows in where it has all but returned. Its impacts since it was there the last time (`recall`), or until
it is there the next time (`replay`), are what Newton's method begins with; what it finds is solved for on its own,
without any more of the trajectory (`orbit_equations`). Out flow what the motion's name is made of and its figures, or a
reason why there is no proof. Proven is, as surely as floating-point numbers can tell:

- the equations have exactly one solution near what was found (`orbit_newton`);
- every impact is one, and mass 1 meets no stop between them (`orbit_contacts.nearest_on_way`), for whatever lies
  within the radius of that certainty;
- all Floquet multipliers lie within the unit circle;
- the motion repeats no earlier: two parts of it are the same only where that certainty says so.

That the trajectory goes to this motion is not proven: it came closer from return to return, in the same sequence of
impacts, and the motion is where that leads.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.codes import (
    GRAZE_UNRESOLVED,
    NOT_DISTINCT,
    NOT_ISOLATED,
    NOT_SOLVED,
    NOT_STABLE,
    NOT_VERIFIED,
    RESOLVED,
    SEQUENCE_UNKNOWN,
)
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.half_period import run_half
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.kernels.workspace import (
    HALF,
    IMPACT,
    KIND,
    OK,
    ROWS,
    STOP,
    TIME,
    VELOCITY,
    Workspace,
    workspace,
)
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.kernels.response_sums import ALTERNATING, SAME_SIGN, block_sum
from grazemap_core.model.tolerances import RESPONSE_ROUNDOFF
from grazemap_core.numerics.jit.by_reference import reference
from grazemap_core.numerics.jit.compiled import kernel, plain
from grazemap_core.numerics.kernels.eigenvalues import OK as EIGENVALUES_OK
from grazemap_core.numerics.kernels.eigenvalues import eigenvalues
from grazemap_core.orbits.kernels.admissibility import CLEAR, STACK, nearest_on_way
from grazemap_core.orbits.kernels.equations import OrbitProblem, curvature
from grazemap_core.orbits.kernels.multipliers import block_scale
from grazemap_core.orbits.kernels.shooting import Shooting, norm_of_inverse, shooting, solve_step, walk_orbit
from grazemap_core.orbits.tolerances import (
    KANTOROVICH,
    MOST_PROVEN_IMPACTS,
    ORBIT_FLOOR,
    ORBIT_NEARBY,
    ORBIT_RESIDUAL,
    ORBIT_SETTLED,
    PROOF_STEPS,
    SURELY_STABLE,
)


class ImpulseBlocks(NamedTuple):
    """The blocks of a chain, as mass 1 feels them.

    Attributes
    ----------
    decay, discriminant, frequency_squared, frequency : (N,)
    unit_impulse : (N, 2)
        As in `orbit_equations.OrbitProblem`.
    provable : bool
        Whether motions can be proven at all: not with an undamped mode or ill-conditioned modes, nor if not wanted.
    """

    decay: Floats
    discriminant: Floats
    frequency_squared: Floats
    frequency: Floats
    unit_impulse: Floats
    provable: bool


class VerificationScratch(NamedTuple):
    """Scratch.

    Attributes
    ----------
    start, replay : (N, 2), Workspace
        Of `replay`; with room for MOST_PROVEN_IMPACTS events.
    stops, guess, found : (impacts,), (2, impacts), (2, impacts)
    behind, unused : (N, 2)
    shooting : Shooting
    states, flow, stack, here, matrix, real, imaginary
        As in `orbit_batches`.
    """

    start: Floats
    replay: Workspace
    stops: Floats
    guess: Floats
    found: Floats
    behind: Floats
    unused: Floats
    shooting: Shooting
    states: Floats
    flow: Floats
    stack: Floats
    here: Floats
    matrix: Floats
    real: Floats
    imaginary: Floats


class Proof(NamedTuple):
    """What is proven of a motion.

    Attributes
    ----------
    doubt : int
        NAMED, or a code of `closing` that says why there is no proof; all else then means nothing.
    length : int
        Half periods after which it returns in the frame of z: m odd is a symmetric motion of m forcing periods, m even
        one of m/2.
    right, left : int
        Impacts on the stops in `length` half periods.
    least : float
        Least impact speed.
    multiplier : float
        Largest modulus over `length` half periods.
    mean_position, mean_velocity : float
        Mean of mass 1's place and velocity, less the steady motion, where the trajectory's forcing periods begin.
    """

    doubt: int
    length: int
    right: int
    left: int
    least: float
    multiplier: float
    mean_position: float
    mean_velocity: float


def verification_scratch(blocks: int) -> VerificationScratch:
    """Return scratch for an oscillator of `blocks` masses."""
    most = MOST_PROVEN_IMPACTS
    return VerificationScratch(
        start=np.zeros((blocks, 2)),
        replay=workspace(blocks, most),
        stops=np.zeros(most),
        guess=np.zeros((2, most)),
        found=np.zeros((2, most)),
        behind=np.zeros((blocks, 2)),
        unused=np.zeros((blocks, 2)),
        shooting=shooting(most, blocks),
        states=np.zeros((4, blocks, 2)),
        flow=np.zeros((blocks, 4)),
        stack=np.zeros((STACK, 2)),
        here=np.zeros((3, 4)),
        matrix=np.zeros((2 * blocks, 2 * blocks)),
        real=np.zeros(2 * blocks),
        imaginary=np.zeros(2 * blocks),
    )


@kernel
def _unproven(doubt: int) -> Proof:
    return Proof(doubt, 0, 0, 0, math.nan, math.nan, math.nan, math.nan)


@kernel
def unit_of_speeds(problem: CellProblem, clearance: float) -> float:
    """Return the length in which places are measured, and speeds in omega times it."""
    return max(problem.steady_bound, clearance)


@kernel
def _as_guess(
    problem: CellProblem,
    scratch: VerificationScratch,
    clearance: float,
    events: Floats,
    first: int,
    end: int,
    half: int,
    sign: float,
) -> int:
    """Write rows first .. end - 1 of events as a guess, phases from half period `half` on, stops and speeds times sign.

    Returns their number, or 0 where there is anything but impacts, or too many.
    """
    count = end - first
    if count > scratch.stops.shape[0]:
        return 0
    unit = unit_of_speeds(problem, clearance)
    for i in range(count):
        event = events[first + i]
        if event[KIND] != IMPACT:
            return 0
        scratch.stops[i] = sign * event[STOP]
        scratch.guess[0, i] = math.pi * (event[HALF] - half) + problem.omega * event[TIME]
        scratch.guess[1, i] = sign * event[VELOCITY] / (problem.omega * unit)
    return count


@kernel
def recall(
    problem: CellProblem,
    scratch: VerificationScratch,
    clearance: float,
    half: int,
    length: int,
    events: Floats,
    rows: int,
) -> int:
    """Write the impacts of the last `length` half periods before `half` as a guess; see `replay`.

    Parameters
    ----------
    events : (capacity, LANE_EVENT_COLUMNS)
        Of the trajectory, `rows` of them, from before these half periods on.
    """
    first = rows
    while first > 0 and events[first - 1, HALF] >= half - length:
        first -= 1
    # at an odd half period the forcing stands as at an even one in the mirror
    sign = 1.0 if length % 2 == 0 else -1.0
    return _as_guess(problem, scratch, clearance, events, first, rows, half - length, sign)


@kernel
def replay(
    problem: CellProblem, held: HeldProblem, scratch: VerificationScratch, clearance: float, half: int, length: int
) -> int:
    """Follow the trajectory for `length` half periods and write its impacts as a guess.

    `scratch.start`, and cursor and near of `scratch.replay`, say where it is after `half` half periods, an even number.
    Phases count from there. Returns the number of impacts, or 0 where there is anything but impacts, or too many.
    """
    work = scratch.replay
    work.cursor[ROWS] = 0
    for k in range(length):
        if run_half(problem, held, scratch.start, clearance, half + k, work) != OK:
            return 0
        if work.cursor[ROWS] > scratch.stops.shape[0]:
            return 0
    return _as_guess(problem, scratch, clearance, work.events, plain(0), work.cursor[ROWS], half, 1.0)


@kernel
def _reach(problem: OrbitProblem, speeds: Floats, radius: float) -> float:
    """Bound by how much mass 1's place moves when every phase and speed moves by at most `radius`, at any time."""
    by_speed, by_phase = 0.0, 0.0
    for j in range(problem.decay.shape[0]):
        y, rate = problem.behind[j, 0], problem.behind[j, 1]
        second_derivative = -problem.frequency_squared[j] * y - 2.0 * problem.decay[j] * rate
        by_speed += math.hypot(y, rate / problem.frequency[j])
        by_phase += math.hypot(problem.frequency[j] * rate, second_derivative) / problem.frequency[j]
    total = 0.0
    for i in range(speeds.shape[0]):
        total += abs(speeds[i])
    reach: float = radius * problem.rebound * (problem.omega * by_speed * speeds.shape[0] + by_phase * total)
    return reach


@kernel
def _repeats(
    stops: Floats, phases: Floats, speeds: Floats, shift: int, angle: float, sign: float
) -> tuple[bool, float]:
    """Compare impacts with those `shift` further on, which should be `angle` later and on the stop times `sign`.

    Returns whether the stops agree, and by how much phases or speeds differ at most.
    """
    count = stops.shape[0]
    away = 0.0
    for i in range(count - shift):
        if stops[i + shift] != sign * stops[i]:
            return False, math.inf
        away = max(away, abs(phases[i + shift] - phases[i] - angle), abs(speeds[i + shift] - sign * speeds[i]))
    return True, away


@kernel
def apparent_length(scratch: VerificationScratch, count: int, length: int, away: float) -> int:
    """Return after how few half periods the impacts of `recall` repeat, as far as speeds and places tell to `away`.

    A trajectory on its way to a motion often comes nearer to where it was some returns ago than to the last one.
    Without impacts it is all of `length`.
    """
    if count == 0:
        return length
    for part in range(1, length // 2 + 1):
        if length % part != 0 or (count * part) % length != 0:
            continue
        shift, sign = count * part // length, -1.0 if part % 2 == 1 else 1.0
        agree = True
        for i in range(count - shift):
            speed = scratch.guess[1, i]
            agree = (
                agree
                and scratch.stops[i + shift] == sign * scratch.stops[i]
                and abs(scratch.guess[1, i + shift] - sign * speed) <= away
                and abs(speed * (scratch.guess[0, i + shift] - scratch.guess[0, i] - math.pi * part)) <= away
            )
        if agree:
            return part
    return length


@kernel
def _least_length(
    stops: Floats, phases: Floats, speeds: Floats, turn: float, length: int, radius: float, alone: float
) -> int:
    """Return the least number of half periods after which the motion returns; 0 where that is hidden by round-off.

    Parameters
    ----------
    radius, alone : float
        There is a solution within `radius` of the numbers given, and no other one within `alone`.
    """
    count = stops.shape[0]
    for part in range(1, length // 2 + 1):
        if length % part != 0 or (count * part) % length != 0:
            continue
        sign = -1.0 if part % 2 == 1 else 1.0
        agree, away = _repeats(stops, phases, speeds, count * part // length, turn * part / length, sign)
        if not agree or away > 4.0 * radius:
            continue
        # shifted by this part the motion is a solution of the same equations
        return part if away + radius < alone else 0
    return length


@kernel
def _behind_first(problem: OrbitProblem, speeds: Floats, scratch: VerificationScratch) -> None:
    """Write into room.states[0] where the blocks are just behind the first impact, of the motion that was walked."""
    strength = -problem.rebound * problem.omega * speeds[0]
    for j in range(problem.decay.shape[0]):
        for c in range(2):
            scratch.states[0, j, c] = scratch.shooting.state[0, j, c] + strength * problem.unit_impulse[j, c]


@kernel
def _means(
    problem: OrbitProblem, length: int, phases: Floats, speeds: Floats, across: Floats, state: Floats
) -> tuple[float, float]:
    """Return the mean of mass 1's place and velocity, less the steady motion, at whole multiples of the phase 2 pi.

    In lengths, and omega times them; of a symmetric motion over both halves, so that its mirror image has the same.
    `across` (k, N, 4) are the flows between impacts; `state` (N, 2) is that just
    behind the first impact, and overwritten.
    """
    count = phases.shape[0]
    turns = 2 if length % 2 == 1 else 1
    sections = length * turns // 2
    x, v = 0.0, 0.0
    section = math.ceil(phases[0] / (2.0 * math.pi))
    seen, sign = 0, 1.0
    for turn in range(turns):
        for i in range(count):
            begin = phases[i] + turn * problem.turn
            end = (phases[i + 1] if i + 1 < count else phases[0] + problem.turn) + turn * problem.turn
            while seen < sections and 2.0 * math.pi * section < end:
                time = (2.0 * math.pi * section - begin) / problem.omega
                for j in range(state.shape[0]):
                    e11, e12, e21, e22 = block_flow(
                        problem.decay[j], problem.discriminant[j], problem.frequency_squared[j], time
                    )
                    x += e11 * state[j, 0] + e12 * state[j, 1]
                    v += (e21 * state[j, 0] + e22 * state[j, 1]) / problem.omega
                section += 1
                seen += 1
            if i + 1 == count:
                sign *= problem.sign
            speed = sign * speeds[(i + 1) % count]
            for j in range(state.shape[0]):
                y, rate = state[j, 0], state[j, 1]
                strength = -problem.rebound * problem.omega * speed
                state[j, 0] = across[i, j, 0] * y + across[i, j, 1] * rate + strength * problem.unit_impulse[j, 0]
                state[j, 1] = across[i, j, 2] * y + across[i, j, 3] * rate + strength * problem.unit_impulse[j, 1]
    return x / max(seen, 1), v / max(seen, 1)


@kernel
def _solve(
    problem: OrbitProblem, stops: Floats, clearance: float, phases: Floats, speeds: Floats, scratch: VerificationScratch
) -> tuple[float, float]:
    """Take phases and speeds to the motion by Newton's method, in place.

    Returns the number of Newton and Kantorovich and the radius, as `orbit_newton.certificate`; infinite where there is
    no motion nearby.
    """
    count = stops.shape[0]
    settled = False
    for _ in range(PROOF_STEPS):
        residual, terms = walk_orbit(problem, stops, clearance, phases, speeds, scratch.shooting)
        step = solve_step(problem, speeds, scratch.shooting)
        if not step < math.inf or (settled and not residual <= ORBIT_RESIDUAL * terms):
            return math.inf, math.inf
        if settled:
            inverse = norm_of_inverse(problem, speeds, scratch.shooting)
            step += inverse * RESPONSE_ROUNDOFF * terms
            return inverse * step * curvature(problem, speeds, 2.0 * step), 2.0 * step
        for i in range(count):
            phases[i] += scratch.shooting.step[i, 0]
            speeds[i] += scratch.shooting.step[i, 1]
        for i in range(count):
            following = phases[i + 1] if i + 1 < count else phases[0] + problem.turn
            if not (following > phases[i] and stops[i] * speeds[i] > 0.0):
                return math.inf, math.inf
        settled = step <= ORBIT_SETTLED
    return math.inf, math.inf


@kernel
def _largest_multiplier(problem: OrbitProblem, scratch: VerificationScratch) -> float:
    """Return the largest modulus of the eigenvalues of what changes come to in one turn; infinite if there are none."""
    size = scratch.matrix.shape[0]
    for row in range(size):
        for column in range(size):
            scratch.matrix[row, column] = problem.sign * scratch.shooting.turned[row, column]
    for j in range(size // 2):  # place and velocity in one unit, blocks in units in which kick and readout are alike
        scale, frequency = block_scale(problem, j), problem.frequency[j]
        for other in range(size):
            scratch.matrix[2 * j, other] *= frequency / scale
            scratch.matrix[2 * j + 1, other] /= scale
            scratch.matrix[other, 2 * j] *= scale / frequency
            scratch.matrix[other, 2 * j + 1] *= scale
    if eigenvalues(scratch.matrix, scratch.real, scratch.imaginary) != EIGENVALUES_OK:
        return math.inf
    largest = 0.0
    for i in range(size):
        largest = max(largest, math.hypot(scratch.real[i], scratch.imaginary[i]))
    return largest


@kernel
def prove(
    problem: CellProblem,
    chain: ImpulseBlocks,
    scratch: VerificationScratch,
    clearance: float,
    count: int,
    length: int,
    distance: float,
) -> Proof:
    """Look for the motion near a trajectory that is between the stops, and prove it.

    Parameters
    ----------
    scratch : Proving
        `stops` and `guess` hold what `recall` or `replay` has written.
    count : int
        Number of impacts that it returned.
    length : int
        Half periods after which the trajectory all but returns.
    distance : float
        How far the motion may be, in units of the clearance.
    """
    if not chain.provable:
        return _unproven(NOT_VERIFIED)
    if count == 0:
        return _unproven(SEQUENCE_UNKNOWN)
    unit = unit_of_speeds(problem, clearance)
    span = 0.5 * length * problem.cells * problem.step
    kind = SAME_SIGN if length % 2 == 0 else ALTERNATING
    for j in range(chain.decay.shape[0]):
        square, twice = chain.frequency_squared[j], 2.0 * chain.decay[j]
        p, q, _ = block_sum(kind, chain.decay[j], chain.discriminant[j], square, 0.0, span)
        first, second = chain.unit_impulse[j, 0], chain.unit_impulse[j, 1]
        scratch.shooting.closing[j, 0], scratch.shooting.closing[j, 1] = p, q
        scratch.behind[j, 0] = first + p * first + q * second
        scratch.behind[j, 1] = second + p * second - q * (square * first + twice * second)
    sign = 1.0 if length % 2 == 0 else -1.0
    record = OrbitProblem(  # by position: numba takes no more than fifteen names
        chain.decay,
        chain.discriminant,
        chain.frequency_squared,
        chain.frequency,
        chain.unit_impulse,
        scratch.behind,
        scratch.unused,  # a series that is mirrored the other way, how sums change with the span: neither is needed
        scratch.unused,
        problem.steady_table[0, 0] / unit,
        problem.steady_table[0, 1] / unit,
        0.0,
        0.0,
        problem.omega,
        unit,
        problem.restitution,
        1.0 + problem.restitution,
        span,
        length * math.pi,
        sign,
    )
    orbit = reference(record)
    stops, phases, speeds = scratch.stops[:count], scratch.found[0, :count], scratch.found[1, :count]
    for i in range(count):
        phases[i], speeds[i] = scratch.guess[0, i], scratch.guess[1, i]
    number, radius = _solve(orbit, stops, clearance, phases, speeds, scratch)
    if not number < math.inf:
        return _unproven(NOT_SOLVED)
    moved = 0.0
    for i in range(count):
        turned = abs(phases[i] - scratch.guess[0, i]) * abs(speeds[i])
        moved = max(moved, turned, abs(speeds[i] - scratch.guess[1, i]))
    if not moved * unit <= ORBIT_NEARBY * distance * clearance:
        return _unproven(NOT_SOLVED)
    if not number <= KANTOROVICH:
        return _unproven(NOT_ISOLATED)
    least = math.inf
    for i in range(count):
        least = min(least, stops[i] * speeds[i])
    if not least > radius:
        return _unproven(GRAZE_UNRESOLVED)
    walked = scratch.shooting.flow[:count]
    _behind_first(orbit, speeds, scratch)
    contact, excess, _, _ = nearest_on_way(
        orbit,
        stops,
        clearance,
        phases,
        speeds,
        -ORBIT_FLOOR,
        walked,
        scratch.states,
        scratch.flow,
        scratch.stack,
        scratch.here,
    )
    if contact != CLEAR or not excess + _reach(orbit, speeds, radius) < 0.0:
        return _unproven(GRAZE_UNRESOLVED)
    multiplier = _largest_multiplier(orbit, scratch)
    if not multiplier < SURELY_STABLE:
        return _unproven(NOT_STABLE)
    # the solution is the only one within this: the larger zero of Kantorovich's majorant
    alone = 0.5 * radius * (1.0 + math.sqrt(1.0 - 2.0 * number)) / number
    true_length = _least_length(stops, phases, speeds, orbit.turn, length, radius, alone)
    if true_length == 0:
        return _unproven(NOT_DISTINCT)
    parts = length // true_length
    right, left = 0, 0
    for i in range(count // parts):
        if stops[i] > 0.0:
            right += 1
        else:
            left += 1
    _behind_first(orbit, speeds, scratch)
    x, v = _means(orbit, length, phases, speeds, walked, scratch.states[0])
    return Proof(
        RESOLVED,
        true_length,
        right,
        left,
        least * unit * problem.omega,
        multiplier ** (1.0 / parts),
        x * unit / clearance,
        v * unit / clearance,
    )
