"""Outputs: linear functions of displacements and velocities, integrated between two events of a motion.

An output is a row on displacements and a row on velocities. While the contact is free, or rests on a stop, it is a sum
over the blocks, the harmonics of the steady motion and a constant. In a panel, in which no exponent turns or decays by
more than PANEL_REACH, it has a Taylor series with an error of round-off. Integrals of an output and of its square are
Gauss-Legendre sums. The largest value is found by bisection: a cubic Hermite interpolant with a bound of its error
shows where the output is not larger than what was found already.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.kernels.cells import CellProblem, forced_part
from grazemap_core.contact.kernels.runs import HALF, TIME, read_state
from grazemap_core.model.kernels.block_flow import advance_state
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.tolerances import PANEL_DEGREE, PEAK_ACCURACY

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(10)
NODES, WEIGHTS = 0.5 * (1.0 + _POINTS), 0.5 * _WEIGHTS
"""Nodes and weights of a panel of length 1. The square of an output turns by 4 in it: ten nodes integrate it with an
error of 1e-18."""
INTEGRAL, SQUARE_INTEGRAL, HIGHEST, LOWEST = 0, 1, 2, 3
"""Columns of the totals of an output: its integral, that of its square, its largest value, that of its negative."""


class OutputRows(NamedTuple):
    """R outputs in one regime of the contact, with n blocks and H harmonics."""

    decay: Floats
    """(n,) Decay of the blocks, as in `CellProblem` or `HeldProblem`."""
    discriminant: Floats
    """(n,) Discriminant of the blocks, as in `CellProblem` or `HeldProblem`."""
    frequency_squared: Floats
    """(n,) Squared frequency of the blocks, as in `CellProblem` or `HeldProblem`."""
    values: Floats
    """(R, 2 n) Parts of the blocks (u, u') in an output."""
    harmonics: Complexes
    """(R, H) Amplitudes of the harmonics in an output, the imaginary part of amplitude times exp(i order phase)."""
    constants: Floats
    """(R, 2) Constant, and that per unit of the contact coordinate at rest."""
    panel: float
    """Maximum length of a panel."""
    resonant: bool
    """Whether the reference motion of the half period is subtracted from the blocks, not the whole steady motion."""


class OutputScratch(NamedTuple):
    """Scratch for R outputs and N blocks."""

    state: Floats
    """(N, 2) Blocks at the beginning of a panel."""
    series: Floats
    """(R, PANEL_DEGREE + 1) Outputs in a panel, scaled to t in [0, 1]."""
    forcing: Floats
    """(2, PANEL_DEGREE + 1) Forcing of both equations of a resonant block, likewise."""
    last: Floats
    """(R,) Outputs at the end of the last segment."""
    stack: Floats
    """(PEAK_DEPTH, 6) Parts of a panel in which a peak is still sought."""


@kernel
def _begin_panel(
    problem: CellProblem, outputs: OutputRows, row: Floats, passed: float, scratch: OutputScratch
) -> float:
    """Write the blocks at the beginning of a panel, a time after an event, and return the phase of the forcing."""
    state = scratch.state[: outputs.decay.shape[0]]
    read_state(row, state)
    advance_state(outputs, state, passed)
    time = row[TIME] + passed
    if outputs.resonant:
        forced_part(problem, state, int(row[HALF]), time, 1.0)
    angle: float = math.pi * (row[HALF] % 2.0) + problem.omega * time
    return angle


@kernel
def _expand_forcing(problem: CellProblem, j: int, angle: float, step: float, forcing: Floats) -> None:
    """Write the series of the forcing of a resonant block; `angle` is the phase at the beginning of the panel."""
    forcing[:] = 0.0
    for h in range(problem.orders.shape[0]):
        order = problem.orders[h]
        term = cmath.exp(complex(0.0, order * angle))
        turning = complex(0.0, order * problem.omega * step)
        for m in range(forcing.shape[1]):
            forcing[0, m] += (problem.resonant_forcing[h, j, 0] * term).imag
            forcing[1, m] += (problem.resonant_forcing[h, j, 1] * term).imag
            term *= turning / (m + 1.0)


@kernel
def _expand(
    problem: CellProblem, outputs: OutputRows, angle: float, step: float, place: float, scratch: OutputScratch
) -> None:
    """Write the series of the outputs in a panel, at whose beginning `scratch.state` is."""
    series, count = scratch.series, outputs.constants.shape[0]
    series[:] = 0.0
    for r in range(count):
        series[r, 0] = outputs.constants[r, 0] + outputs.constants[r, 1] * place
    for h in range(problem.orders.shape[0]):
        term = cmath.exp(complex(0.0, problem.orders[h] * angle))
        turning = complex(0.0, problem.orders[h] * problem.omega * step)
        for m in range(PANEL_DEGREE + 1):
            for r in range(count):
                series[r, m] += (outputs.harmonics[r, h] * term).imag
            term *= turning / (m + 1.0)
    for j in range(outputs.decay.shape[0]):
        square, twice = outputs.frequency_squared[j], 2.0 * outputs.decay[j]
        first, second = scratch.state[j, 0], scratch.state[j, 1]
        if outputs.resonant:
            _expand_forcing(problem, j, angle, step, scratch.forcing)
        for m in range(PANEL_DEGREE + 1):
            for r in range(count):
                series[r, m] += outputs.values[r, 2 * j] * first + outputs.values[r, 2 * j + 1] * second
            rate, rate_of_rate = second, -square * first - twice * second
            if outputs.resonant:
                rate += scratch.forcing[0, m]
                rate_of_rate += scratch.forcing[1, m]
            first, second = step * rate / (m + 1.0), step * rate_of_rate / (m + 1.0)


@kernel
def _value_and_rate(series: Floats, t: float) -> tuple[float, float]:
    """Return a series and its derivative at t in [0, 1]."""
    y, rate = series[PANEL_DEGREE], 0.0
    for m in range(PANEL_DEGREE - 1, -1, -1):
        rate = rate * t + y
        y = y * t + series[m]
    return y, rate


@kernel
def _raise_peak(series: Floats, sign: float, highest: float, stack: Floats) -> float:
    """Return the largest value of sign times a series on [0, 1], or `highest` if that is larger.

    The result is NaN where a bound overflows or is NaN, and where `highest` is NaN.

    The stack is never full. On an interval of length l the control points of the interpolant exceed the larger end by
    at most ``l^2 M/6``, with M a bound of the second derivative. With d = PANEL_DEGREE, M and the fourth derivative are
    at most ``d (d - 1)`` and ``d (d - 1) (d - 2) (d - 3)`` times `size`. Round-off of at most e at either end adds
    ``2 e/3``, and Horner's rule has ``e < 2 (d + 1) size 2^-53``. So an interval is not halved once
    ``77 l^2 + 458 l^4 + 3.5e-15`` is less than PEAK_ACCURACY, which is so after 27 halvings. One interval waits for
    each of them: with the last one, 28.
    """
    fourth, size = 0.0, 0.0
    for m in range(PANEL_DEGREE + 1):
        size += abs(series[m])
        fourth += m * (m - 1.0) * (m - 2.0) * (m - 3.0) * abs(series[m])
    fourth /= 384.0  # of the error of a Hermite interpolant
    if not math.isfinite(fourth) or not math.isfinite(size) or math.isnan(highest):
        return math.nan
    stack[0, 0], stack[0, 1] = 0.0, 1.0
    stack[0, 2], stack[0, 3] = _value_and_rate(series, 0.0)
    stack[0, 4], stack[0, 5] = _value_and_rate(series, 1.0)
    depth = 1
    while depth > 0:
        depth -= 1
        begin, end = stack[depth, 0], stack[depth, 1]
        y, rate, y_end, rate_end = stack[depth, 2], stack[depth, 3], stack[depth, 4], stack[depth, 5]
        highest = max(highest, sign * y, sign * y_end)
        length = end - begin
        within = max(sign * (y + length * rate / 3.0), sign * (y_end - length * rate_end / 3.0))
        above = max(within, sign * y, sign * y_end) + fourth * length * length * length * length
        if above <= highest + PEAK_ACCURACY * size:
            continue
        middle = 0.5 * (begin + end)
        y_middle, rate_middle = _value_and_rate(series, middle)
        stack[depth, 0], stack[depth, 1] = middle, end
        stack[depth, 2], stack[depth, 3], stack[depth, 4], stack[depth, 5] = y_middle, rate_middle, y_end, rate_end
        depth += 1
        stack[depth, 0], stack[depth, 1] = begin, middle
        stack[depth, 2], stack[depth, 3], stack[depth, 4], stack[depth, 5] = y, rate, y_middle, rate_middle
        depth += 1
    return highest


@kernel
def observe_segment(
    problem: CellProblem,
    outputs: OutputRows,
    row: Floats,
    place: float,
    length: float,
    first: int,
    totals: Floats,
    scratch: OutputScratch,
) -> None:
    """Add the motion over a time `length` after an event to the totals (R, 4) of the outputs from `first` on.

    The output 0 has no peaks. On return `scratch.last` has the others at the end of that time.

    Parameters
    ----------
    row : (EVENT_COLUMNS + 2 N,)
        The event, with the state after it.
    place : float
        The contact coordinate, if the contact rests.
    """
    count = outputs.constants.shape[0]
    panels = math.ceil(length / outputs.panel)
    step = length / panels
    for p in range(panels):
        angle = _begin_panel(problem, outputs, row, step * p, scratch)
        _expand(problem, outputs, angle, step, place, scratch)
        for r in range(first, count):
            series = scratch.series[r]
            total, square = 0.0, 0.0
            for node in range(NODES.shape[0]):
                y, _ = _value_and_rate(series, NODES[node])
                total += WEIGHTS[node] * y
                square += WEIGHTS[node] * y * y
            totals[r, INTEGRAL] += step * total
            totals[r, SQUARE_INTEGRAL] += step * square
            if r > 0:
                totals[r, HIGHEST] = _raise_peak(series, 1.0, totals[r, HIGHEST], scratch.stack)
                totals[r, LOWEST] = _raise_peak(series, -1.0, totals[r, LOWEST], scratch.stack)
                scratch.last[r], _ = _value_and_rate(series, 1.0)
