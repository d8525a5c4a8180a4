"""Orbits with one impact on each stop in n forcing periods, between any stops and under any harmonics.

At a given lag of the second impact the speeds are linear in the steady motion, so the gap of the first stop is a
trigonometric polynomial of the phase, as with one impact (`single_impact.orbits`). The lag is searched for.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.stops import Stops, gap_of
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.orbits.family import ForcedFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.equations import rebound_of
from grazemap_core.orbits.single_impact.harmonics import Harmonics, Places, bracketed_zero
from grazemap_core.orbits.tolerances import LAG_ACCURACY, LAG_STEPS


def two_impact_sequences(forced: ForcedFamily, stops: Stops, first: int) -> list[ImpactSequence]:
    """Return the impacts of orbits with one impact on each stop in the family's period, the one on `first` first.

    The lag is that at which the second impact is on its stop. It is searched on a grid. Two orbits whose lags differ
    by less than a step may be missed, and one next to a lag at which the phase of the first impact ceases to exist.
    """
    lags = _Lags(forced, stops, first)
    turn = 2.0 * math.pi * lags.multiple
    grid = np.linspace(0.0, turn, LAG_STEPS * lags.multiple + 1)[1:-1].tolist()
    at_each: list[list[tuple[float, float]]] = [[] for _ in grid]
    places, mismatches = lags.mismatches(grid)
    for phase, row, mismatch in zip(*(column.tolist() for column in (*places, mismatches)), strict=True):
        at_each[row].append((phase, mismatch))
    sequences: list[ImpactSequence] = []
    before: list[tuple[float, float]] = []
    for place, here in enumerate(at_each):
        for phase, mismatch in here:
            near = min(before, key=lambda other: abs(math.remainder(other[0] - phase, 2.0 * math.pi)), default=None)
            if near is not None and near[1] * mismatch <= 0.0 and mismatch != 0.0:
                sequences += lags.between(grid[place - 1], grid[place], near[0])
        before = here
    return sequences


class _Lags:
    """Orbits with two impacts, as functions of the lag of the second one and the phase of the first one."""

    def __init__(self, forced: ForcedFamily, stops: Stops, first: int) -> None:
        self.omega, self.sides = forced.omega, (first, -first)
        self.gaps = [gap_of(stops, stop) for stop in self.sides]
        self.rebounds = [rebound_of(stops, stop) for stop in self.sides]
        pattern, response, sums = forced.family.pattern, forced.family.response, forced.sums
        self.multiple, self.span = pattern.multiple, forced.span
        self.steady = Harmonics.of_steady([forced])
        self.blocks = list(zip(response.decay, response.discriminant, response.frequency_squared, strict=True))
        self.at_impulse, self.after = (sums.displacement, sums.velocity), sums.after

    def _response(self, time: float) -> tuple[float, float]:
        """Return displacement and velocity a time after one of the periodic unit impulses; 0: just before one."""
        if time == 0.0:
            return self.at_impulse
        place, rate = 0.0, 0.0
        for (decay, discriminant, square), (first, second) in zip(self.blocks, self.after.tolist(), strict=True):
            e11, e12, e21, e22 = block_flow(decay, discriminant, square, time)
            place += e11 * first + e12 * second
            rate += e21 * first + e22 * second
        return place, rate

    def _matrices(self, lag: float) -> tuple[Floats, Floats]:
        """Return what speeds have to be multiplied by to give the changes of displacement and velocity, (2, 2) each."""
        time = lag / self.omega
        times = ((0.0, self.span - time), (time, 0.0))
        both = (
            np.array([[self._response(times[i][j]) for j in range(2)] for i in range(2)])
            * np.array(self.rebounds)[None, :, None]
        )
        return both[:, :, 0], both[:, :, 1]

    def _polynomials(self, lags: list[float]) -> tuple[list[Harmonics], list[Harmonics]]:
        """Return the speeds over omega, and the displacements minus the stops', at lags (m,).

        They are functions of the first phase, of the first and of the second impact.
        """
        place, rate = (np.array(each) for each in zip(*map(self._matrices, lags), strict=True))
        inverse = np.linalg.inv(np.eye(2) + rate)
        steady = [self.steady, self.steady.turned(lags)]
        rates = [motion.derivative() for motion in steady]
        speeds = [rates[0].times(inverse[:, i, 0]).plus(inverse[:, i, 1], rates[1]) for i in range(2)]
        places = []
        for i in range(2):
            moved = steady[i].plus(-place[:, i, 0] * self.omega, speeds[0])
            moved = moved.plus(-place[:, i, 1] * self.omega, speeds[1])
            places.append(moved._replace(constants=np.full(len(lags), -self.sides[i] * self.gaps[i])))
        return speeds, places

    def mismatches(self, lags: list[float]) -> tuple[Places, Floats]:
        """Return the phases at which the first impact is on its stop, and by how much the second one is beyond its own.

        Rows are lags.
        """
        first, second = self._polynomials(lags)[1]
        zeros = first.zeros()
        return zeros, second.at(*zeros)

    def between(self, low: float, high: float, phase: float) -> Iterator[ImpactSequence]:
        """Yield the orbit between two lags, with a phase near the given one, if neither impact is virtual."""

        def nearest(lag: float) -> tuple[float, float]:
            places, mismatches = self.mismatches([lag])
            if not places.phases.size:
                raise _PhaseEnds
            at_lag = zip(places.phases.tolist(), mismatches.tolist(), strict=True)
            return min(at_lag, key=lambda other: abs(math.remainder(other[0] - phase, 2.0 * math.pi)))

        try:
            lag = bracketed_zero(lambda lag: nearest(lag)[1], low, high, LAG_ACCURACY)
            if lag is None:
                return
            first, _ = nearest(lag)
        except _PhaseEnds:
            return
        speeds = [float(self.omega * polynomial.at(first)) for polynomial in self._polynomials([lag])[0]]
        if all(stop * speed > 0.0 for stop, speed in zip(self.sides, speeds, strict=True)):
            yield ImpactSequence.create(self.multiple, self.sides, [first, first + lag], speeds)


class _PhaseEnds(Exception):
    """There is no phase any more that could be followed."""
