"""The leading multiplier of a periodic motion, and the two largest Lyapunov exponents of any other motion.

The kernels do not allocate, so that a map can call them at every point; all scratch is in `Tangents`:

    begin_matrix, the linearised flow over the period, leading_multiplier           for a periodic motion
    begin_first, begin_second, orthonormalise every half period, classify_growth    for an unresolved motion

The growth of two perturbations is measured over every half period in the energy norm of the blocks, the sum of
w^2 u^2 + u'^2, and they are made orthonormal after it (Benettin et al. 1980). The mean over n periods differs from the
exponent by c/n, which depends on the initial perturbations, and for a chaotic motion by a statistical error. The latter
is estimated from the spread of the means over a few long windows of the run (`standard_error`); many short blocks, as
of Flyvbjerg & Petersen (1989), do not show that intermittent growth changes slowly.

References
----------
G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980) 9-30.
H. Flyvbjerg, H. G. Petersen, J. Chem. Phys. 91 (1989) 461-466.
S. Das, Y. Saiki, E. Sander, J. A. Yorke, Nonlinearity 30 (2017) 4111-4140.
"""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.codes import CHAOTIC, GROWTH_UNDECIDED, QUASI_PERIODIC
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.kernels.eigenvalues import spectral_radius
from grazemap_core.records import NamedTuple
from grazemap_core.simulation import tolerances


class Tangents(NamedTuple):
    """Scratch for perturbations of a state, and their growth."""

    full: Floats
    """(2 N, 2 N) The perturbations of all coordinates, as columns."""
    eigen: Floats
    """(2 N, 2 N) Their matrix, balanced, of which the multipliers are computed."""
    real: Floats
    """(2 N,) Receives the real parts of the multipliers."""
    imaginary: Floats
    """(2 N,) Receives their imaginary parts."""
    growth: Floats
    """(halves, 2) Receives the logarithms of the growth factors of the two columns over every half period."""
    series: Floats
    """(halves,) Growth rates by forcing period."""
    moments: Floats
    """(2, 2 N, 2) Sums and sums of squares over the stroboscopic orbit, in the first and in the second half of the
    run."""


def tangents(blocks: int, periods: int = 0) -> Tangents:
    """Return new scratch for an oscillator of `blocks` masses and a run over a number of forcing periods."""
    size = 2 * blocks
    return Tangents(
        full=np.zeros((size, size)),
        eigen=np.zeros((size, size)),
        real=np.zeros(size),
        imaginary=np.zeros(size),
        growth=np.zeros((2 * periods, 2)),
        series=np.zeros(2 * periods),
        moments=np.zeros((2, size, 2)),
    )


@kernel
def begin_matrix(scratch: Tangents) -> None:
    """Set scratch.full to the identity, whose columns are the perturbations of every coordinate."""
    size = scratch.full.shape[0]
    for i in range(size):
        for j in range(size):
            scratch.full[i, j] = 1.0 if i == j else 0.0


@kernel
def leading_multiplier(problem: CellProblem, scratch: Tangents) -> float:
    """Return the largest modulus of the multipliers of a periodic motion; NaN where they could not be computed.

    Parameters
    ----------
    scratch : Tangents
        Its matrix is that of `begin_matrix` after the linearised flow (`run_half_linearised`) over the time after which
        the motion repeats, or is mirrored. The result is 0 if all perturbations vanish in it (as for a single mass that
        rests on a stop).
    """
    size = scratch.full.shape[0]
    # in the energy norm, in which all entries have the same unit
    for i in range(size):
        row = problem.frequency[i // 2] if i % 2 == 0 else 1.0
        for j in range(size):
            column = problem.frequency[j // 2] if j % 2 == 0 else 1.0
            scratch.eigen[i, j] = scratch.full[i, j] * row / column
    return spectral_radius(scratch.eigen, scratch.real, scratch.imaginary)


@kernel
def _length(columns: Floats, c: int) -> float:
    """Return the Euclidean norm of a column without overflow or underflow."""
    square = 0.0
    for i in range(columns.shape[0]):
        square += columns[i, c] * columns[i, c]
    if tolerances.MIN_SAFE_SQUARE < square < 1.0 / tolerances.MIN_SAFE_SQUARE:
        return math.sqrt(square)
    length = 0.0
    for i in range(columns.shape[0]):
        length = math.hypot(length, columns[i, c])
    return length


@kernel
def orthonormalise(frequency: Floats, columns: Floats, growth: Floats) -> None:
    """Make the columns (2 N, k) orthonormal in the energy norm, in place, and write the logarithms of R_jj to growth.

    A column that is zero, or in the span of the previous ones to round-off, becomes zero and remains so; its logarithm
    is minus infinity.
    """
    size = columns.shape[0]
    for c in range(columns.shape[1]):
        for i in range(0, size, 2):
            columns[i, c] *= frequency[i // 2]  # to coordinates in which the norm is Euclidean
        before = _length(columns, c)
        for b in range(c):
            overlap = 0.0
            for i in range(size):
                overlap += columns[i, b] * columns[i, c]
            for i in range(size):
                columns[i, c] -= overlap * columns[i, b]
        length = before if c == 0 else _length(columns, c)
        lost = not length > tolerances.RANK_ROUNDING * before
        growth[c] = -np.inf if lost else math.log(length)
        for i in range(size):
            columns[i, c] = 0.0 if lost else columns[i, c] / length
    for c in range(columns.shape[1]):
        for i in range(0, size, 2):
            columns[i, c] /= frequency[i // 2]


@kernel
def begin_first(frequency: Floats, columns: Floats) -> None:
    """Set the first column to a perturbation without the symmetries of the chain."""
    for i in range(columns.shape[0]):
        columns[i, 0] = 1.0 / (i + 1.0)
        if i % 2 == 0:
            columns[i, 0] /= frequency[i // 2]


@kernel
def begin_second(frequency: Floats, columns: Floats) -> None:
    """Set the second column to another one."""
    for i in range(columns.shape[0]):
        columns[i, 1] = -1.0 / frequency[i // 2] if i % 2 == 0 else 1.0


@kernel
def _error_of_independent(values: Floats, count: int) -> float:
    """Return the standard error of the mean of the first `count` values, as if they were independent."""
    mean = 0.0
    for i in range(count):
        mean += values[i] / count
    square = 0.0
    for i in range(count):
        square += (values[i] - mean) ** 2
    return math.sqrt(square / (count - 1.0) / count)


@kernel
def standard_error(values: Floats, count: int) -> float:
    """Return the standard error of the mean of the first `count` values of a time series; overwrites them.

    It is that of the mean of EXPONENT_WINDOWS means over consecutive windows of equal length, at the end of the series,
    times EXPONENT_STUDENT; or that of independent values, if this is larger: the windows of a bounded sum may agree to
    far less than the error c/count of its mean. Infinite if a window has fewer than SHORTEST_WINDOW values.
    """
    windows = tolerances.EXPONENT_WINDOWS
    length = count // windows
    if length < tolerances.SHORTEST_WINDOW:
        return np.inf
    independent = _error_of_independent(values, count)
    first = count - windows * length
    for window in range(windows):
        total = 0.0
        for i in range(first + window * length, first + (window + 1) * length):
            total += values[i]
        values[window] = total / length
    return max(tolerances.EXPONENT_STUDENT * _error_of_independent(values, windows), independent)


@kernel
def exponent(scratch: Tangents, column: int, skipped: int, half_time: float) -> tuple[float, float]:
    """Return an exponent per unit of time and its standard error, from scratch.growth without its first rows.

    Minus infinity and 0 if the column vanished, NaN if no rows are left.
    """
    halves = scratch.growth.shape[0]
    if skipped >= halves:
        return np.nan, np.nan
    total = 0.0
    for k in range(skipped, halves):
        total += scratch.growth[k, column]
    if not np.isfinite(total):
        return -np.inf, 0.0
    count = (halves - skipped) // 2
    for i in range(count):
        first = skipped + 2 * i
        scratch.series[i] = (scratch.growth[first, column] + scratch.growth[first + 1, column]) / (2.0 * half_time)
    return total / ((halves - skipped) * half_time), standard_error(scratch.series, count)


@kernel
def weighted_exponent(scratch: Tangents, skipped: int, half_time: float) -> float:
    """Return the first exponent as a weighted Birkhoff mean of the growth; the weights decrease to 0 at both ends.

    For a periodic or quasi-periodic motion it converges faster than any power of the time (Das et al. 2017), whereas
    the unweighted mean converges as the inverse of the time; for a chaotic motion it is no better.
    """
    total, weights = 0.0, 0.0
    count = scratch.growth.shape[0] - skipped
    for k in range(count):
        share = (k + 0.5) / count
        weight = math.exp(-1.0 / (share * (1.0 - share)))
        weights += weight
        total += weight * scratch.growth[skipped + k, 0]
    return total / (weights * half_time)


@kernel
def _range(scratch: Tangents, begin: int, end: int) -> float:
    """Return the range of the summed growth of the first column from half period `begin` to `end`."""
    total, smallest, largest = 0.0, 0.0, 0.0
    for k in range(begin, end):
        total += scratch.growth[k, 0]
        smallest, largest = min(smallest, total), max(largest, total)
    return largest - smallest


@kernel
def _extent(problem: CellProblem, scratch: Tangents, part: int, count: int) -> float:
    """Return the root mean square distance of the stroboscopic orbit from its mean, in one half of the run."""
    square = 0.0
    for i in range(scratch.moments.shape[1]):
        mean = scratch.moments[part, i, 0] / count
        variance = scratch.moments[part, i, 1] / count - mean * mean
        square += max(0.0, variance) * problem.displacement_scale[i // 2, i % 2] ** 2
    return math.sqrt(square)


@kernel
def classify_growth(
    problem: CellProblem, unit: float, skipped: int, second_skipped: int, scratch: Tangents
) -> tuple[int, float, float]:
    """Return the kind of a motion that its exponents imply, and the largest one.

    Parameters
    ----------
    unit : float
        The unit of the stops.
    skipped, second_skipped : int
        Even numbers of half periods at the beginning, in which the first and the second perturbation align; they do not
        count.
    scratch : Tangents
        Growth and moments of the whole run.

    Returns
    -------
    kind : CHAOTIC, QUASI_PERIODIC or GROWTH_UNDECIDED. Both kinds refer to the time of the run: a longer chaotic
        transient is not distinguished from chaos, nor a spiral that shrinks by less than ORBIT_EXTENT from a torus.
    first, first_error : float
        The largest exponent per unit of time, with its standard error.
    """
    half_time = problem.step * (problem.cells // 2)
    first, first_error = exponent(scratch, 0, skipped, half_time)
    second, second_error = exponent(scratch, 1, second_skipped, half_time)
    halves = scratch.growth.shape[0]
    middle = skipped + (halves - skipped) // 2
    if not (np.isfinite(first) and np.isfinite(first_error)):
        return GROWTH_UNDECIDED, first, first_error
    early, late = 0.0, 0.0
    for k in range(skipped, halves):
        if k < middle:
            early += scratch.growth[k, 0]
        else:
            late += scratch.growth[k, 0]
    least = min(early / (middle - skipped), late / (halves - middle)) / half_time
    positive = first > tolerances.EXPONENT_MARGIN * first_error
    if (positive and least > tolerances.EXPONENT_MARGIN * first_error) or min(early, late) > tolerances.GROWTH_SURE:
        return CHAOTIC, first, first_error
    if positive:
        return GROWTH_UNDECIDED, first, first_error
    # a bounded sum has the same range over an eighth of the run as over the run; a random walk a far smaller one
    counted = halves - skipped
    whole, least = _range(scratch, skipped, halves), np.inf
    for k in range(8):
        least = min(least, _range(scratch, skipped + k * counted // 8, skipped + (k + 1) * counted // 8))
    bounded = whole <= tolerances.GROWTH_BOUND * least
    drifts = abs(weighted_exponent(scratch, skipped, half_time)) * counted * half_time > tolerances.GROWTH_DRIFT
    early_extent = _extent(problem, scratch, 0, middle - skipped)
    late_extent = _extent(problem, scratch, 1, halves - middle)
    persists = abs(late_extent - early_extent) <= tolerances.ORBIT_EXTENT * early_extent
    wide = early_extent > tolerances.MIN_ORBIT_EXTENT * unit
    attracts = second < -tolerances.EXPONENT_MARGIN * (first_error + second_error)
    kind = QUASI_PERIODIC if bounded and not drifts and persists and wide and attracts else GROWTH_UNDECIDED
    return kind, first, first_error
