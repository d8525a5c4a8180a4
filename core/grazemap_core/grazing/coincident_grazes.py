"""Frequencies at which two maxima of the steady motion are equal, or both stops are grazed: all in an interval.

The interval of omega is halved until bounds decide every cell (theory, "Several harmonics"). The peaks of a cell hold
all highest points of the steady motion, with bounds of their rates along omega.

- *Two maxima are equal.* A cell with one peak, in which the motion is concave, has no such frequency. With two of them
  whose rates differ for certain, their difference is monotone: the signs at the ends decide whether it has a zero.
- *A margin vanishes.* It has no zero if it exceeds the radius of the cell times the bound of its rate. If its rate has
  one sign, it is monotone.

All this is done for displacements relative to the largest harmonic of a cell (`trig_maxima.relative`).

Where a cell is shorter than NEAR_DOUBLE_WIDTH and undecided, the function and its derivative vanish together to
round-off, or a maximum has no curvature there: it is reported as near-double.
"""

from __future__ import annotations

import math
from abc import abstractmethod

import numpy as np

from grazemap_core.arrays import Booleans, Complexes, Floats, Integers
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.grazing_curve import SteadyMotion, VariedStop, steady_motion, wrapped
from grazemap_core.grazing.tolerances import (
    CELL_ROUNDING,
    END_WIDTH,
    EQUAL_HEIGHTS,
    MAX_CELLS,
    NEAR_DOUBLE_GAP,
    NEAR_DOUBLE_WIDTH,
    OMEGA_ACCURACY,
    SHORTEST_CELL,
)
from grazemap_core.model.harmonic_response import steady_curvature_bound
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.numerics.trig_maxima import (
    Coefficients,
    Peaks,
    Relative,
    derivatives,
    highest_of_cells,
    highest_peaks,
    relative,
    top,
)
from grazemap_core.records import ABC, NamedTuple, dataclass
from grazemap_core.tolerances import EPSILON

_NONE, _ONE, _UNDECIDED = 0, 1, 2
"""What bounds say of a cell: it has no zero, one at most, or they do not decide."""

_ALIKE = "the interval has nearly equal maxima that bounds do not tell apart; shorten it"


class Coincidence(NamedTuple):
    """A frequency at which two maxima are equal, or a margin vanishes."""

    omega: float
    """The frequency; of a near-double one, the middle of the undecided interval."""
    error: float
    """Error of the frequency by round-off; of a near-double zero, half of the width of the undecided interval."""
    residual: float
    """The difference there, over the sum of the amplitudes."""
    phases: tuple[float, float] = (math.nan, math.nan)
    """omega t of the two maxima, of which the one with the smaller slope comes first: of two equal ones it is the
    larger one below omega. NaN of a near-double one."""
    slopes: tuple[float, float] = (math.nan, math.nan)
    """Derivatives of the two maxima with respect to omega. NaN of a near-double one."""
    simple: bool = False
    """Whether the zero is not near-double."""


def equal_maxima(oscillator: Oscillator, stop: int, start: float, end: float) -> list[Coincidence]:
    """Return every frequency in [start, end] at which the largest displacement toward a stop is reached twice.

    Parameters
    ----------
    oscillator : Oscillator
        Its harmonics have no common divisor; there are several.
    stop : {+1, -1}
    start, end : float
        0 < start < end.

    Raises
    ------
    ParameterError
        Bounds leave too many cells undecided, or the amplitude underflows.
    SteadyMotionError
        A resonance is practically undamped.
    """
    return _EqualMaxima(oscillator, stop).zeros(start, end)


def vanishing_margins(oscillator: Oscillator, varied: VariedStop, start: float, end: float) -> list[Coincidence]:
    """Return every frequency in [start, end] at which a graze of the varied stop is one of the other stop too.

    Parameters and Raises as for `equal_maxima`.
    """
    return _VanishingMargin(oscillator, varied.stop, varied).zeros(start, end)


def united(intervals: list[tuple[float, float]], apart: float = 4.0 * END_WIDTH) -> list[tuple[float, float]]:
    """Return the union of intervals as disjoint ones, increasing; gaps up to the relative width `apart` are closed."""
    unions: list[tuple[float, float]] = []
    for left, right in sorted(intervals):
        if unions and left <= unions[-1][1] * (1.0 + apart):
            unions[-1] = (unions[-1][0], max(right, unions[-1][1]))
        else:
            unions.append((left, right))
    return unions


class _PeakPairs(NamedTuple):
    """Where the two peaks of each of m cells are, relative to the largest harmonic."""

    ranges: Floats
    """(m, 2, 2) Left and right end of the phase; zeros of a margin."""
    largest: Integers
    """(m,) Index of the largest harmonic."""
    reference: Complexes
    """(m,) Its amplitude in the middle of the cell."""

    def of(self, cells: Booleans | Integers) -> _PeakPairs:
        """Return those of some cells."""
        return _PeakPairs._make(each[cells] for each in self)

    def at(self, motion: SteadyMotion) -> Floats:
        """Return the ranges of the phase of a motion at a frequency in each cell, (m, 2, 2)."""
        turn = motion.response[np.arange(len(self.largest)), self.largest] / self.reference
        return np.asarray(self.ranges - (np.angle(turn) / motion.orders[self.largest])[:, None, None])


@dataclass(frozen=True, eq=False)
class _ZeroSearch(ABC):
    """A function of omega whose zeros are sought."""

    oscillator: Oscillator
    """The oscillator."""
    stop: int
    """The stop that varies."""

    @abstractmethod
    def judge(self, cells: Relative) -> tuple[Integers, Floats, Floats]:
        """Return the verdict on each of m cells, the ranges of the two peaks, (m, 2, 2), and the value's modulus.

        The modulus is that in the middle of a cell, 0 where a maximum may have no curvature.
        """

    @abstractmethod
    def value(self, motion: SteadyMotion, places: _PeakPairs) -> Floats:
        """Return the function at m frequencies, of which each is in a cell with these places."""

    @abstractmethod
    def compared(self, motion: SteadyMotion, places: _PeakPairs) -> tuple[Floats, Floats]:
        """Return the phases of the two maxima at one frequency, and their slopes along omega; (2,) each."""

    def zeros(self, start: float, end: float) -> list[Coincidence]:
        """Return all zeros, increasing."""
        cells, places, narrow = self._isolated(start * (1.0 - END_WIDTH), end * (1.0 + END_WIDTH))
        coincidences = [_near_double(*ends) for ends in united(narrow, NEAR_DOUBLE_GAP)]
        for i, ends in enumerate(cells):
            each = places.of(np.array([i]))
            omega = self._zero(ends, each)
            coincidences += [] if omega is None else [self._coincidence(omega, each)]
        apart: list[Coincidence] = []
        for coincidence in sorted(coincidences):
            if apart and coincidence.omega - apart[-1].omega <= coincidence.error + apart[-1].error:
                apart[-1] = _same(apart[-1], coincidence)
            else:
                apart.append(coincidence)
        return apart

    def _isolated(self, start: float, end: float) -> tuple[Floats, _PeakPairs, list[tuple[float, float]]]:
        """Return cells (m, 2) with one zero at most, with their places, and those with a near-double one."""
        cells, count = np.array([[start, end]]), 0
        ones, narrow = [np.zeros((0, 2))], [np.zeros((0, 2))]
        places = [_PeakPairs(np.zeros((0, 2, 2)), np.zeros(0, np.int64), np.zeros(0, np.complex128))]
        while len(cells):
            count += len(cells)
            if count > MAX_CELLS:
                raise ParameterError("omega", _ALIKE)
            middle, radius = cells.mean(axis=1), 0.5 * np.diff(cells, axis=1)[:, 0] * CELL_ROUNDING
            verdict, distance, place, noise = self._judged(middle, radius)
            ones.append(cells[verdict == _ONE])
            places.append(place.of(verdict == _ONE))
            tie = (
                (verdict == _UNDECIDED)
                & (radius <= 0.5 * NEAR_DOUBLE_WIDTH * middle)
                & (distance <= EQUAL_HEIGHTS * noise)
            )
            narrow.append(cells[tie])
            halved = (verdict == _UNDECIDED) & ~tie
            if np.any(radius[halved] <= SHORTEST_CELL * middle[halved]):
                raise ParameterError("omega", _ALIKE)
            left, middle, right = cells[halved, 0], middle[halved], cells[halved, 1]
            cells = np.concatenate([np.stack([left, middle], axis=1), np.stack([middle, right], axis=1)])
        near = [(float(left), float(right)) for left, right in np.concatenate(narrow)]
        joined = _PeakPairs._make(np.concatenate(arrays) for arrays in zip(*places, strict=True))
        return np.concatenate(ones), joined, near

    def _judged(self, middle: Floats, radius: Floats) -> tuple[Integers, Floats, _PeakPairs, Floats]:
        """Return verdicts on cells of omega, distances as of `judge`, places, and the round-off of displacements."""
        coefficients = self._coefficients(middle, radius)
        seen = relative(coefficients)
        verdict, distance = np.full(len(middle), _UNDECIDED), np.full(len(middle), np.inf)
        ranges = np.zeros((len(middle), 2, 2))
        if np.any(seen.exists):
            some = np.flatnonzero(seen.exists)
            verdict[some], ranges[some], distance[some] = self.judge(seen.of(some))
        reference = self.stop * coefficients.value[np.arange(len(middle)), seen.largest]
        return verdict, distance, _PeakPairs(ranges, seen.largest, reference), coefficients.roundoff

    def _coefficients(self, middle: Floats, radius: Floats) -> Coefficients:
        motion = steady_motion(self.oscillator, middle, slopes=True)
        motion.require_amplitude()
        ends = middle - radius, middle + radius
        bounds = [steady_curvature_bound(self.oscillator, harmonic, *ends) for harmonic in self.oscillator.drive]
        value, slope = self.stop * motion.response, self.stop * motion.slopes
        return Coefficients(motion.orders, value, slope, np.stack(bounds, axis=1), radius)

    def _zero(self, ends: Floats, place: _PeakPairs) -> float | None:
        """Return the zero between two ends, where the function is monotone; None if there is none."""
        from scipy.optimize import brentq  # half as long to import as all that a grazing curve needs

        def value(omega: float) -> float:
            return float(self.value(steady_motion(self.oscillator, np.array([omega])), place)[0])

        motion = steady_motion(self.oscillator, ends)
        values = self.value(motion, place.of(np.zeros(2, np.int64)))
        within = np.abs(values) <= 2.0 * motion.roundoff
        if np.any(within):
            return float(ends[np.argmax(within)])
        if (values[0] > 0.0) == (values[1] > 0.0):
            return None
        return float(brentq(value, *ends, xtol=EPSILON * ends[0], rtol=OMEGA_ACCURACY))

    def _coincidence(self, omega: float, place: _PeakPairs) -> Coincidence:
        motion = steady_motion(self.oscillator, np.array([omega]), slopes=True)
        (difference,), (roundoff,) = self.value(motion, place), 2.0 * motion.roundoff
        phases, slopes = self.compared(motion, place)
        error = OMEGA_ACCURACY * omega + roundoff / abs(slopes[0] - slopes[1])
        residual = abs(difference) / np.abs(motion.response).sum()
        first, second = np.argsort(slopes).tolist()
        two = [(float(each[first]), float(each[second])) for each in (phases, slopes)]
        return Coincidence(omega, float(error), float(residual), two[0], two[1], simple=True)


class _EqualMaxima(_ZeroSearch):
    """The difference of the two highest peaks."""

    def judge(self, cells: Relative) -> tuple[Integers, Floats, Floats]:
        peaks, number = highest_peaks(cells.coefficients), np.arange(len(cells.largest))
        count = np.bincount(peaks.cell, minlength=len(number))
        single = np.bincount(peaks.cell, ~peaks.single, minlength=len(number)) == 0.0
        first = np.searchsorted(peaks.cell, number)
        second = first + (count > 1)
        apart = peaks.least_rate[first] > peaks.largest_rate[second]
        apart |= peaks.least_rate[second] > peaks.largest_rate[first]
        verdict = np.where(single & (count == 1), _NONE, np.where(single & (count == 2) & apart, _ONE, _UNDECIDED))
        ends = np.stack([peaks.left, peaks.right], axis=1)
        heights = peaks.height[np.lexsort((-peaks.height, peaks.cell))]
        return verdict, np.stack([ends[first], ends[second]], axis=1), heights[first] - heights[second]

    def _tops(self, motion: SteadyMotion, places: _PeakPairs) -> tuple[Floats, Floats]:
        """Return phases and heights of the two peaks, (2, m) each."""
        response, ranges = self.stop * motion.response, places.at(motion)
        ends = ((each[:, 0], each[:, 1]) for each in (ranges[:, 0], ranges[:, 1]))
        tops = [top(motion.orders, response, left, right, 0.5 * (left + right)) for left, right in ends]
        return np.stack([phase for phase, _, _ in tops]), np.stack([height for _, height, _ in tops])

    def value(self, motion: SteadyMotion, places: _PeakPairs) -> Floats:
        _, heights = self._tops(motion, places)
        return np.asarray(heights[0] - heights[1])

    def compared(self, motion: SteadyMotion, places: _PeakPairs) -> tuple[Floats, Floats]:
        phases = self._tops(motion, places)[0][:, 0]
        slopes, _, _ = derivatives(motion.orders, self.stop * motion.slopes, phases)
        return wrapped(phases), slopes


@dataclass(frozen=True, eq=False)
class _VanishingMargin(_ZeroSearch):
    """The margin of the other stop along the grazes of the varied one."""

    varied: VariedStop
    """The varied stop, with the other one."""

    def judge(self, cells: Relative) -> tuple[Integers, Floats, Floats]:
        right = cells.coefficients
        left = right._replace(value=-right.value, slope=-right.slope)
        (amplitude, *rates), (other, *others) = (_highest(highest_peaks(side)) for side in (right, left))
        margin = self.varied.margin(self.oscillator, amplitude, other)
        # the margin is that of the peaks, and a constant that is scaled with them
        constant = margin - (self._moves * amplitude - other)
        scaled = constant * cells.scale_rate
        low = self._moves * rates[0] - others[1] + np.min(scaled, axis=0)
        high = self._moves * rates[1] - others[0] + np.max(scaled, axis=0)
        reach = right.radius * np.maximum(np.abs(low), np.abs(high)) + 2.0 * right.roundoff
        monotone = (low > 0.0) | (high < 0.0)
        verdict = np.where(np.abs(margin) > reach, _NONE, np.where(monotone, _ONE, _UNDECIDED))
        return verdict, np.zeros((len(margin), 2, 2)), np.abs(margin)

    @property
    def _moves(self) -> float:
        """The rate of the varied stop's clearance over that of its amplitude: 0 where the other one stays."""
        return float(self.varied.together)

    def value(self, motion: SteadyMotion, places: _PeakPairs) -> Floats:
        return self.varied.margins(self.oscillator, motion, motion.toward(self.stop).amplitude)

    def compared(self, motion: SteadyMotion, places: _PeakPairs) -> tuple[Floats, Floats]:
        maxima, other = motion.toward(self.stop), motion.toward(-self.stop)
        return np.append(maxima.phase, other.phase), np.append(self._moves * maxima.slope, other.slope)


def _near_double(left: float, right: float) -> Coincidence:
    return Coincidence(0.5 * (left + right), 0.5 * (right - left), 0.0)


def _same(first: Coincidence, second: Coincidence) -> Coincidence:
    """Return two coincidences that round-off does not separate as one.

    A zero at the common end of two cells is found in both. Two zeros at which the difference changes its sign in
    opposite directions, so that the maxima change their places, are near-double.
    """
    here, there = (np.exp(1j * np.array(each.phases)) for each in (first, second))
    if abs(here[0] - there[0]) <= abs(here[0] - there[1]):
        return first
    ends = [(each.omega - each.error, each.omega + each.error) for each in (first, second)]
    return _near_double(ends[0][0], max(ends[0][1], ends[1][1]))


def _highest(peaks: Peaks) -> tuple[Floats, Floats, Floats]:
    """Return the largest height in the middle of each cell, and bounds of its rate over the cell."""
    first = np.flatnonzero(np.append(True, np.diff(peaks.cell) > 0))
    return (
        peaks.height[highest_of_cells(peaks)],
        np.minimum.reduceat(peaks.least_rate, first),
        np.maximum.reduceat(peaks.largest_rate, first),
    )
