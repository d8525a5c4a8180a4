"""Final states of the trajectories of a column, and the impacts of their verified orbits, if observables need them."""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.maps.kernels.lane_tables import LANES
from grazemap_core.maps.kernels.lockstep import RESTING, Lanes
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.orbits.kernels.verification import Verification, VerificationScratch, unit_of_speeds
from grazemap_core.orbits.tolerances import MAX_VERIFIED_IMPACTS
from grazemap_core.records import NamedTuple

MAX_ORBIT_IMPACTS = 2 * MAX_VERIFIED_IMPACTS
"""Maximum number of impacts in a whole period of a verified orbit. A symmetric orbit is solved for over half its period
only, so its whole period may have twice MAX_VERIFIED_IMPACTS."""


class FinalStates(NamedTuple):
    """Final states of n trajectories; with n = 0 nothing is kept."""

    states: Floats
    """(n, 2 N) State at phase 0 of the forcing. If a trajectory of a symmetric motion ended after an odd number of half
    periods, this is the mirror image of its state."""
    resting_stop: Floats
    """(n,) The stop on which the contact rests in this state, or 0."""
    impacts: Floats
    """(n, 3, MAX_ORBIT_IMPACTS) Stops, phases and signed velocities of the impacts in one period of the last orbit that
    was verified near the trajectory."""
    counts: Floats
    """(n,) Number of these impacts."""


def final_states(count: int, blocks: int) -> FinalStates:
    """Return new arrays for `count` trajectories of a structure of `blocks` blocks."""
    return FinalStates(
        states=np.zeros((count, 2 * blocks)),
        resting_stop=np.zeros(count),
        impacts=np.zeros((count, 3, MAX_ORBIT_IMPACTS)),
        counts=np.zeros(count),
    )


@kernel
def keep_state(final: FinalStates, group: Lanes, lane: int, trajectory: int, k: int) -> None:
    """Keep the state of a lane after k half periods as the final state of a trajectory."""
    if trajectory >= final.states.shape[0]:  # nothing is kept
        return
    sign = 1.0 if k % 2 == 0 else -1.0
    for c in range(final.states.shape[1]):
        final.states[trajectory, c] = sign * group.even[c * LANES + lane]
    resting = group.regime[lane] == RESTING
    final.resting_stop[trajectory] = sign * group.cursor[lane, runs.HELD] if resting else 0.0


@kernel
def keep_orbit(
    final: FinalStates,
    problem: CellProblem,
    stops: Stops,
    scratch: VerificationScratch,
    verified: Verification,
    trajectory: int,
) -> None:
    """Keep the impacts of the orbit that was just verified near a trajectory."""
    if trajectory >= final.states.shape[0]:  # nothing is kept
        return
    count, unit = verified.right + verified.left, problem.omega * unit_of_speeds(problem, stops)
    halves = 1 + verified.length % 2  # 2 for a symmetric orbit: half the period, and its mirror image after it
    impacts = final.impacts[trajectory]
    final.counts[trajectory] = halves * count
    for half in range(halves):
        sign, shift = 1.0 - 2.0 * half, half * verified.length * math.pi
        for i in range(count):
            impacts[0, half * count + i] = sign * scratch.sides[i]
            impacts[1, half * count + i] = scratch.solution[0, i] + shift
            impacts[2, half * count + i] = sign * scratch.solution[1, i] * unit
