"""Guesses for a periodic orbit of which only the period and the stops are known.

Motions with one impact a period are known in closed form; others are taken from trajectories that settle to them.
Neither finds unstable motions with more impacts: their phases and velocities have to be given.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.checks import checked_order
from grazemap_core.errors import ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.impact_sequences import ImpactSequence, impacts_of
from grazemap_core.orbits.one_impact_branches import OneImpactBranch, one_impact_branch
from grazemap_core.simulation.trajectories import trajectory

RANDOM_STATES = 24
"""Number of initial states tried besides rest."""
TRANSIENT_PERIODS = 400
"""Number of forcing periods in which a trajectory must settle."""


def sequence_of_stops(
    oscillator: Oscillator, omega: float, clearance: float, period: int, stops: Sequence[int], seed: int = 0
) -> ImpactSequence | None:
    """Return the impacts of a motion with a given period and stops, or None where none was found.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega, clearance : float
    period : int
        n, forcing periods, >= 1.
    stops : sequence of +1 (stop A) or -1 (C)
        Stops of the impacts of a whole period, in order, starting with any impact.
    seed : int
        Seed of the random initial states that are tried.

    Raises
    ------
    ParameterError
        A number is out of range.
    SteadyMotionError, ConditioningError
        As for `one_impact_branches.one_impact_branch`.
    """
    checked_order("period", period, 1)
    wanted = np.array(stops)
    if wanted.ndim != 1 or wanted.size == 0 or not np.all(np.isin(wanted, (1, -1))):
        raise ParameterError("stops", "must be a list of at least one stop, each 1 or -1")
    one_a_period = wanted.size == 1 or (wanted.size == 2 and wanted[0] == -wanted[1] and period % 2 == 1)
    if one_a_period:
        branch = one_impact_branch(oscillator, omega, period, symmetric=wanted.size == 2)
        angles = branch.angles(clearance)
        if angles:
            return _of_closed_form(branch, angles[-1], int(wanted[0]))
    for sequence in _settled(oscillator, omega, clearance, seed):
        for candidate in (sequence.whole, _mirrored(sequence.whole)):
            turned = _turned_to(candidate, period, wanted)
            if turned is not None:
                return turned.half() if turned.mirrors() else turned
    return None


def _of_closed_form(branch: OneImpactBranch, angle: float, stop: int) -> ImpactSequence:
    """Return the impacts of the orbit at an angle of a branch whose first impact is on this stop."""
    phase = angle - float(np.angle(branch.steady[0])) + (math.pi if stop < 0 else 0.0)
    phase = math.remainder(phase, 2.0 * math.pi)
    pattern = branch.pattern
    return ImpactSequence.create(
        pattern.multiple,
        [stop],
        [phase if phase > -math.pi else math.pi],
        [stop * branch.impact_velocity(angle)],
        pattern.symmetric,
    )


def _settled(oscillator: Oscillator, omega: float, clearance: float, seed: int) -> Iterator[ImpactSequence]:
    """Yield the impacts of the motions that trajectories settle to, from rest first."""
    random = np.random.default_rng(seed)
    size = oscillator.size
    starts: list[tuple[Floats, Floats]] = [(np.zeros(size), np.zeros(size))]
    starts += [
        (clearance * random.uniform(-1.0, 1.0, size), omega * clearance * random.uniform(-1.0, 1.0, size))
        for _ in range(RANDOM_STATES)
    ]
    for displacement, velocity in starts:
        run = trajectory(
            oscillator,
            omega,
            clearance,
            displacement,
            velocity,
            transient_periods=TRANSIENT_PERIODS,
            periods=64,
            samples_per_period=1,
        )
        try:
            yield impacts_of(run)
        except ParameterError:  # not settled, or no sequence of impacts
            continue


def _mirrored(sequence: ImpactSequence) -> ImpactSequence:
    """Return the mirror image, half a forcing period later."""
    return ImpactSequence.create(
        sequence.period, -sequence.stops, sequence.phases + math.pi, -sequence.velocities, sequence.symmetric
    )


def _turned_to(sequence: ImpactSequence, period: int, wanted: Integers) -> ImpactSequence | None:
    """Return a whole sequence, rotated so that its stops are those wanted, or None."""
    if sequence.period != period or sequence.stops.size != wanted.size:
        return None
    whole = 2.0 * math.pi * period
    for first in range(wanted.size):
        if np.array_equal(np.roll(sequence.stops, -first), wanted):
            phases = np.concatenate([sequence.phases[first:], sequence.phases[:first] + whole])
            return ImpactSequence.create(
                period, np.roll(sequence.stops, -first), phases, np.roll(sequence.velocities, -first)
            )
    return None
