"""Final states of the trajectories of a column, and the impacts of their verified orbits, where they are wanted."""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels import workspace
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.maps.kernels.lane_tables import LANES
from grazemap_core.maps.kernels.lockstep import RESTING, Lanes
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.orbits.kernels.verification import Verification, VerificationScratch, unit_of_speeds
from grazemap_core.orbits.tolerances import MAX_VERIFIED_IMPACTS
from grazemap_core.records import NamedTuple

MOST_IMPACTS = 2 * MAX_VERIFIED_IMPACTS
"""Maximum number of impacts of a verified orbit; of a symmetric one, those of half the period are solved for."""


class FinalStates(NamedTuple):
    """Final states of n trajectories; without trajectories they are not wanted."""

    states: Floats
    """(n, 2 N) State at phase 0 of the forcing. It is mirrored where the motion is symmetric and the trajectory ended
    half a period later."""
    rests: Floats
    """(n,) The stop on which the contact rests there, or 0."""
    impacts: Floats
    """(n, 3, MOST_IMPACTS) Stops, phases and signed velocities of the impacts in one period of the last orbit that was
    verified near the trajectory."""
    counts: Floats
    """(n,) Number of these impacts."""


def final_states(count: int, blocks: int) -> FinalStates:
    """Return new arrays for so many trajectories."""
    return FinalStates(
        states=np.zeros((count, 2 * blocks)),
        rests=np.zeros(count),
        impacts=np.zeros((count, 3, MOST_IMPACTS)),
        counts=np.zeros(count),
    )


@kernel
def keep_state(final: FinalStates, group: Lanes, lane: int, trajectory: int, k: int) -> None:
    """Keep the state of a lane after k half periods as that in which a trajectory ends."""
    if trajectory >= final.states.shape[0]:
        return
    sign = 1.0 if k % 2 == 0 else -1.0
    for c in range(final.states.shape[1]):
        final.states[trajectory, c] = sign * group.even[c * LANES + lane]
    resting = group.regime[lane] == RESTING
    final.rests[trajectory] = sign * group.cursor[lane, workspace.HELD] if resting else 0.0


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
    if trajectory >= final.states.shape[0]:
        return
    count, unit = verified.right + verified.left, problem.omega * unit_of_speeds(problem, stops)
    parts = 1 + verified.length % 2  # an orbit that is mirrored after half its period
    impacts = final.impacts[trajectory]
    final.counts[trajectory] = parts * count
    for part in range(parts):
        sign, shift = 1.0 - 2.0 * part, part * verified.length * math.pi
        for i in range(count):
            impacts[0, part * count + i] = sign * scratch.sides[i]
            impacts[1, part * count + i] = scratch.solution[0, i] + shift
            impacts[2, part * count + i] = sign * scratch.solution[1, i] * unit
