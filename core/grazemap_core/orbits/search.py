"""Guesses for a periodic orbit of which only the period and the stops are known.

Motions with one impact a period, or one on each stop, are explicit; others are taken from trajectories that settle to
them. Neither finds unstable motions with more impacts: their phases and velocities have to be given.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.stops import gap_of
from grazemap_core.contact.stops import Clearance, stops_between
from grazemap_core.errors import ParameterError, checked_order
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence, impacts_of
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.single_impact.orbits import one_impact_sequences
from grazemap_core.orbits.tolerances import RANDOM_STATES, RECORDED_PERIODS, TRANSIENT_PERIODS
from grazemap_core.orbits.two_impact_orbits import two_impact_sequences
from grazemap_core.simulation.start import ForcedOscillator, forced_oscillator
from grazemap_core.simulation.trajectories import trajectory


@in_own_period
def sequence_of_stops(
    oscillator: Oscillator, omega: float, clearance: Clearance, period: int, sides: Sequence[int], seed: int = 0
) -> ImpactSequence | None:
    """Return the impacts of a motion with a given period and stops, or None where none was found.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega : float
    clearance : Clearance
        As for `periodic_orbits.periodic_orbit`.
    period : int
        n, forcing periods, >= 1.
    sides : sequence of +1 (right stop) or -1 (left)
        Stops of the impacts of a whole period, in order, starting with any impact.
    seed : int
        Seed of the random initial states that are tried.

    Raises
    ------
    ParameterError
        A number is out of range, or a stop is absent.
    SteadyMotionError, ConditioningError
        As for `periodic_orbits.periodic_orbit`.
    """
    checked_order("period", period, 1)
    wanted = np.array(sides)
    if wanted.ndim != 1 or wanted.size == 0 or not np.all(np.isin(wanted, (1, -1))):
        raise ParameterError("stops", "must be a list of at least one stop, each 1 or -1")
    forced = forced_oscillator(oscillator, omega, clearance)
    stops = forced.stops
    if any(math.isinf(gap_of(stops, stop)) for stop in wanted.tolist()):
        raise ParameterError("stops", "has an impact on a stop that is absent")
    if wanted.size == 1 or (wanted.size == 2 and wanted[0] == -wanted[1]):
        explicit = _explicit(forced, period, wanted)
        if explicit is not None:
            return explicit
    for sequence in _settled(forced, seed):
        mirror = [mirrored(sequence.whole)] if stops.symmetric else []
        for candidate in (sequence.whole, *mirror):
            turned = turned_to(candidate, period, wanted)
            if turned is not None:
                return turned.half() if turned.mirrors() else turned
    return None


@in_own_period
def explicit_sequences(
    oscillator: Oscillator, omega: float, clearance: Clearance, period: int, sides: Integers
) -> list[ImpactSequence]:
    """Return the impacts of all orbits with one impact, or with one on each stop; none for other stops.

    Raises as `sequence_of_stops`.
    """
    if not (sides.size == 1 or (sides.size == 2 and sides[0] == -sides[1])):
        return []
    family = OrbitFamily.of(oscillator, period, symmetric=False).at(omega)
    stops = stops_between(oscillator, clearance, family.steady_size)
    sequences = one_impact_sequences if sides.size == 1 else two_impact_sequences
    return sequences(family, stops, int(sides[0]))


def _explicit(forced: ForcedOscillator, period: int, wanted: Integers) -> ImpactSequence | None:
    """Return the impacts of an orbit with one impact, or one on each stop; one that is admissible, if there is one."""
    first = None
    for sequence in _explicit_sequences(forced, period, wanted):
        if periodic_orbit(forced.oscillator, forced.omega, forced.clearance, sequence).admissible:
            return sequence
        first = first or sequence
    return first


def _explicit_sequences(forced: ForcedOscillator, period: int, wanted: Integers) -> Iterator[ImpactSequence]:
    """Yield the impacts of orbits with one impact, or one on each stop, symmetric ones first."""
    if wanted.size == 2 and period % 2 == 1 and forced.stops.symmetric:
        family = OrbitFamily.of(forced.oscillator, period, symmetric=True).at(forced.omega)
        yield from one_impact_sequences(family, forced.stops, int(wanted[0]))
    yield from explicit_sequences(forced.oscillator, forced.omega, forced.clearance, period, wanted)


def _settled(forced: ForcedOscillator, seed: int) -> Iterator[ImpactSequence]:
    """Yield the impacts of the motions that trajectories settle to, from rest first."""
    random = np.random.default_rng(seed)
    size, unit, omega = forced.oscillator.size, forced.stops.unit, forced.omega
    starts: list[tuple[Floats | None, Floats]] = [(None, np.zeros(size))]
    for _ in range(RANDOM_STATES):
        place, rate = forced.equilibrium + unit * random.uniform(-1.0, 1.0, size), random.uniform(-1.0, 1.0, size)
        starts.append((forced.oscillator.between(place, forced.clearances), omega * unit * rate))
    for displacement, velocity in starts:
        run = trajectory(
            forced.oscillator,
            omega,
            forced.clearance,
            displacement,
            velocity,
            transient_periods=TRANSIENT_PERIODS,
            periods=RECORDED_PERIODS,
            samples_per_period=1,
        )
        try:
            yield impacts_of(run)
        except ParameterError:  # not settled, or no sequence of impacts
            continue


def mirrored(sequence: ImpactSequence) -> ImpactSequence:
    """Return the mirror image, half a forcing period later: a motion too between symmetric stops."""
    return ImpactSequence.create(
        sequence.period, -sequence.stops, sequence.phases + math.pi, -sequence.velocities, sequence.symmetric
    )


def turned_to(sequence: ImpactSequence, period: int, wanted: Integers) -> ImpactSequence | None:
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
