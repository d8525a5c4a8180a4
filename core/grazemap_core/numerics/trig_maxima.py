"""Maxima of trigonometric polynomials with bounds: no highest one is missed, also while the coefficients change.

A polynomial is ``u(theta) = sum_k Im(X_k e^{i k theta})`` over a turn of theta. Its coefficients, which are finite and
not all 0, depend on omega, which varies over a cell: ``X_k = value + slope x + rest``, with ``|rest| <= bound x^2/2``
for ``|x| <= radius``. The turn is cut into ranges of theta, which are halved. A range holds no highest point of any
omega of the cell, and is left out, if bounds show that

- another point is higher throughout;
- u has no critical point in it;
- u is convex in it.

Adjacent ranges that are left form a peak. With the radius 0 the coefficients are those at one omega.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Booleans, Complexes, Floats, Integers
from grazemap_core.numerics.tolerances import (
    PEAK_RANGE,
    PEAK_ROUNDOFF,
    PEAK_STEPS,
    RANGES_PER_ORDER,
    RATE_RANGE,
)
from grazemap_core.records import NamedTuple
from grazemap_core.tolerances import EPSILON

_AT_ONCE = 1 << 20
"""Values of one harmonic that are computed together: 16 MiB."""


class Coefficients(NamedTuple):
    """Coefficients of polynomials with H orders over m cells of omega."""

    orders: Floats
    """(H,) k, increasing."""
    value: Complexes
    """(m, H) X_k in the middle of a cell."""
    slope: Complexes
    """(m, H) Its derivative there."""
    bound: Floats
    """(m, H) Bound of its second derivative over the cell."""
    radius: Floats
    """(m,) Half of the width of the cell."""

    @property
    def roundoff(self) -> Floats:
        """Bound of the round-off of u in the middle of each cell, (m,)."""
        return roundoff(self.orders, self.value)

    def of(self, cells: Integers | slice) -> Coefficients:
        """Return those of some cells."""
        return Coefficients(self.orders, self.value[cells], self.slope[cells], self.bound[cells], self.radius[cells])


class Relative(NamedTuple):
    """Coefficients relative to the largest one of each of m cells, and that one; see `relative`."""

    coefficients: Coefficients
    """The coefficients, relative to the largest one."""
    largest: Integers
    """(m,) Index of the order of the largest one."""
    scale_rate: Floats
    """(2, m) Bounds, over the cell, of the rate of what they are multiplied by."""
    exists: Booleans
    """(m,) False where the largest one changes too much in the cell; the rest has no meaning there."""

    def of(self, cells: Integers) -> Relative:
        """Return those of some cells."""
        return Relative(self.coefficients.of(cells), self.largest[cells], self.scale_rate[:, cells], self.exists[cells])


class Peaks(NamedTuple):
    """p peaks: ranges of theta that hold all highest points in a cell; by cell, then by theta; arrays of shape (p,)."""

    cell: Integers
    """Index of the cell."""
    left: Floats
    """Left end of the range, in [-pi, pi)."""
    right: Floats
    """Right end of the range."""
    single: Booleans
    """Whether u is concave in the whole range, for every omega of the cell: it then has one highest point there."""
    phase: Floats
    """theta of the highest point in the middle of the cell."""
    height: Floats
    """u there."""
    curvature: Floats
    """-u'' there."""
    least_rate: Floats
    """Lower bound of d u/d omega over the range and the cell."""
    largest_rate: Floats
    """Upper bound, likewise."""

    def of(self, chosen: Booleans | Integers) -> Peaks:
        """Return some of the peaks."""
        return Peaks._make(values[chosen] for values in self)


def relative(coefficients: Coefficients) -> Relative:
    """Return coefficients that change in a cell only as far as they change relative to the largest one, X_l.

    theta is shifted and u scaled, so that X_l stays what it is in the middle: X_k is multiplied by ``exp(-(re + i k/l
    im))`` with the real and the imaginary part of ``log X_l(omega) - log X_l(middle)``. Which maxima are equal does not
    depend on that, and near a resonance of one harmonic the others hardly change in this way.
    """
    orders, value, slope, bound, radius = coefficients
    cells, largest = np.arange(len(radius)), np.argmax(np.abs(value), axis=1)
    size, rate, bend = (np.abs(each)[cells, largest] for each in (value, slope, bound))
    least = size - radius * (rate + 0.5 * radius * bend)
    exists = least > 0.5 * size
    least = np.where(exists, least, size)
    # bounds over the cell: of the derivatives of log X_l, of the factor, and of the rates by which X_k are multiplied
    first = (rate + radius * bend) / least
    second, factor = (bend / least + first * first)[:, None], (size / least)[:, None]
    ratio, r = orders / orders[largest, None], radius[:, None]
    turning = (slope[cells, largest] / value[cells, largest])[:, None]
    bent = np.maximum(ratio, 1.0) * second
    multiplied = np.abs(turning.real) + ratio * np.abs(turning.imag) + r * bent
    moved = value * (turning.real + 1j * ratio * turning.imag)
    most = np.abs(value) + r * (np.abs(slope) + 0.5 * r * bound)
    bends = 2.0 * multiplied * (np.abs(slope) + r * bound) + (multiplied * multiplied + bent) * most
    bends = factor * (bound + bends)
    # the round-off of the difference of slopes counts as a bend
    bends += 16.0 * EPSILON * (np.abs(slope) + np.abs(moved)) / r
    slopes = slope - moved
    slopes[cells, largest], bends[cells, largest] = 0.0, 0.0
    spread = (r * factor * (second + first[:, None] ** 2))[:, 0]
    scale = -turning.real[:, 0]
    return Relative(
        Coefficients(orders, value, slopes, bends, radius),
        largest,
        np.stack([scale - spread, scale + spread]),
        exists,
    )


def highest_peaks(coefficients: Coefficients) -> Peaks:
    """Return the peaks of which each is the highest one at some omega of its cell, as far as bounds tell."""
    many = RANGES_PER_ORDER * int(coefficients.orders[-1]) * len(coefficients.orders)
    count, chunk = len(coefficients.radius), max(1, _AT_ONCE // many)
    parts = []
    for start in range(0, count, chunk):
        peaks = _highest_peaks(coefficients.of(slice(start, start + chunk)))
        parts.append(peaks._replace(cell=peaks.cell + start))
    return Peaks._make(np.concatenate(arrays) for arrays in zip(*parts, strict=True))


def highest_points(orders: Floats, amplitudes: Complexes) -> Peaks:
    """Return the highest peak of each of m polynomials, of orders (H,) and amplitudes (m, H) that do not change."""
    still = np.zeros_like(amplitudes)
    peaks = highest_peaks(Coefficients(orders, amplitudes, still, still.real, np.zeros(len(amplitudes))))
    return peaks.of(highest_of_cells(peaks))


def highest_of_cells(peaks: Peaks) -> Integers:
    """Return the index of the peak that is the highest one in the middle of each cell, shape (m,)."""
    order = np.lexsort((-peaks.height, peaks.cell))
    return np.asarray(order[np.append(True, np.diff(peaks.cell) > 0)])


def roundoff(orders: Floats, amplitudes: Complexes) -> Floats:
    """Return a bound of the round-off of u for amplitudes (m, H), shape (m,)."""
    return np.asarray(PEAK_ROUNDOFF * (np.abs(amplitudes) * (1.0 + orders)).sum(axis=1))


def derivatives(orders: Floats, amplitudes: Complexes, phase: Floats) -> tuple[Floats, Floats, Floats]:
    """Return u, u' and u'' of amplitudes (m, H) at phases (m,).

    They do not depend on the other phases, as matrix products would.
    """
    turned = amplitudes * np.exp(1j * phase[:, None] * orders)
    return turned.imag.sum(axis=1), (turned.real * orders).sum(axis=1), -(turned.imag * orders**2).sum(axis=1)


def top(
    orders: Floats, amplitudes: Complexes, left: Floats, right: Floats, phase: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return where u is largest in ranges in which it is concave, and u and -u'' there; all of shape (m,).

    `phase` is where the search starts.
    """
    low, high = left, right
    settled = np.zeros(len(phase), dtype=np.bool_)
    for _ in range(PEAK_STEPS):
        _, slope, second = derivatives(orders, amplitudes, phase)
        low, high = np.where(slope > 0.0, phase, low), np.where(slope > 0.0, high, phase)
        with np.errstate(divide="ignore", invalid="ignore"):
            following = phase - slope / second
        following = np.where((following >= low) & (following <= high), following, 0.5 * (low + high))
        settles = np.abs(following - phase) <= 4.0 * EPSILON
        phase = np.where(settled, phase, following)
        settled |= settles
        if np.all(settled):
            break
    height, _, second = derivatives(orders, amplitudes, phase)
    return phase, height, -second


class _AngleRanges(NamedTuple):
    """Ranges of theta that are left, by cell and theta; arrays of shape (r,)."""

    cell: Integers
    """Index of the cell."""
    middle: Floats
    """Middle of the range."""
    width: Floats
    """Width of the range."""
    single: Booleans
    """As in `Peaks`."""
    value: Floats
    """u in the middle of the range."""
    least_rate: Floats
    """As in `Peaks`."""
    largest_rate: Floats
    """As in `Peaks`."""

    def touch(self, first: Integers | slice, second: Integers | slice, turn: float = 0.0) -> Booleans:
        """Return whether ranges end where others begin, after a turn."""
        gap = self.middle[second] + turn - self.middle[first] - 0.5 * (self.width[first] + self.width[second])
        return np.asarray(gap < 0.25 * np.minimum(self.width[first], self.width[second]))

    def begins(self) -> Booleans:
        """Return whether a range is the first one of a run of adjacent ranges of a cell."""
        return np.append(True, (np.diff(self.cell) > 0) | ~self.touch(slice(None, -1), slice(1, None)))


def _highest_peaks(coefficients: Coefficients) -> Peaks:
    ranges = _unwrapped(_ranges(coefficients))
    begins = ranges.begins()
    start = np.flatnonzero(begins)
    stop = np.append(start[1:], len(begins)) - 1
    cell = ranges.cell[start]
    left = ranges.middle[start] - 0.5 * ranges.width[start]
    right = ranges.middle[stop] + 0.5 * ranges.width[stop]
    best = np.lexsort((-ranges.value, np.cumsum(begins)))[start]
    peaks = Peaks(
        cell,
        left,
        right,
        np.logical_and.reduceat(ranges.single, start),
        *top(coefficients.orders, coefficients.value[cell], left, right, ranges.middle[best]),
        np.minimum.reduceat(ranges.least_rate, start),
        np.maximum.reduceat(ranges.largest_rate, start),
    )
    return _that_tie(peaks, coefficients)


def _unwrapped(ranges: _AngleRanges) -> _AngleRanges:
    """Return ranges of which the first run of a cell is a turn further where it goes on from the last one."""
    begins = ranges.begins()
    start = np.flatnonzero(begins)
    stop = np.append(start[1:], len(begins)) - 1
    head = np.flatnonzero(np.append(True, np.diff(ranges.cell[start]) > 0))
    tail = np.append(head[1:], len(start)) - 1
    across = (head < tail) & ranges.touch(stop[tail], start[head], 2.0 * np.pi)
    turned = np.isin(np.cumsum(begins) - 1, head[across])
    middle = np.where(turned, ranges.middle + 2.0 * np.pi, ranges.middle)
    order = np.lexsort((middle, ranges.cell))
    return _AngleRanges._make(values[order] for values in ranges._replace(middle=middle))


def _that_tie(peaks: Peaks, coefficients: Coefficients) -> Peaks:
    """Return the peaks that are as high as the one that is the highest in the middle of the cell, somewhere in it."""
    highest = highest_of_cells(peaks)
    leader = highest[np.cumsum(np.append(0, np.diff(peaks.cell) > 0))]
    closing = np.maximum(peaks.largest_rate - peaks.least_rate[leader], peaks.largest_rate[leader] - peaks.least_rate)
    reach = coefficients.radius[peaks.cell] * closing + coefficients.roundoff[peaks.cell]
    return peaks.of(peaks.height[leader] - peaks.height <= reach)


def _ranges(coefficients: Coefficients) -> _AngleRanges:
    """Return the ranges of theta that may hold a highest point, ordered by cell and theta."""
    orders, value, slope, bound, radius = coefficients
    # sums of k^j over the moduli: bounds of derivatives along theta
    powers = orders ** np.arange(4)[:, None]
    sizes, rates, bends = (np.abs(each) @ powers.T for each in (value, slope, bound))
    rests = 0.5 * radius[:, None] ** 2 * bends
    third = sizes[:, 3] + radius * rates[:, 3] + rests[:, 3]
    noise = PEAK_ROUNDOFF * (sizes[:, :3] + sizes[:, 1:])
    lowest = np.full(len(radius), -np.inf)

    number = RANGES_PER_ORDER * int(orders[-1])
    width = 2.0 * np.pi / number
    cell = np.repeat(np.arange(len(radius)), number)
    middle = np.tile((np.arange(number) + 0.5) * width - np.pi, len(radius))
    left: list[_AngleRanges] = []
    while len(cell):
        half, r = 0.5 * width, radius[cell]
        (u, du, ddu), (p, dp, ddp) = (derivatives(orders, each[cell], middle) for each in (value, slope))
        moves = [r * np.abs(each) + rests[cell, j] + noise[cell, j] for j, each in enumerate((p, dp, ddp))]
        within = half * third[cell]
        uncertain = moves[2] + within
        turns = half * (np.abs(ddu) + uncertain)
        np.maximum.at(lowest, cell, u - moves[0])
        rises = np.abs(du) + moves[1] + 0.5 * half * np.maximum(ddu + uncertain, 0.0)
        may = u + moves[0] + half * rises >= lowest[cell]
        may &= np.abs(du) <= moves[1] + turns
        may &= ddu <= uncertain
        single = ddu < -uncertain
        # halving the range would tell less than the change of omega over the cell hides
        narrow = turns <= RATE_RANGE * moves[1]
        tiny = (narrow & (within <= moves[2])) | (half * orders[-1] <= PEAK_RANGE)
        done = may & np.where(single, narrow | (r == 0.0), tiny)
        spread = half * (np.abs(dp) + 0.5 * half * rates[cell, 2]) + r * bends[cell, 0]
        widths = np.full(len(cell), width)
        kept = (cell, middle, widths, single, u, p - spread, p + spread)
        left.append(_AngleRanges._make(each[done] for each in kept))
        halved = may & ~done
        cell, middle = np.repeat(cell[halved], 2), np.repeat(middle[halved], 2)
        width = half
        middle[0::2] -= 0.5 * width
        middle[1::2] += 0.5 * width
    ranges = _AngleRanges._make(np.concatenate(arrays) for arrays in zip(*left, strict=True))
    order = np.lexsort((ranges.middle, ranges.cell))
    return _AngleRanges._make(each[order] for each in ranges)
