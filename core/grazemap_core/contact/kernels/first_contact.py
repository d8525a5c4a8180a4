"""Contacts within a cell (one step of the time grid): a test for their absence, and the search for the first one.

The test: the error of the cubic Hermite interpolant of q on a cell is bounded (HERMITE_DIVISOR), and the interpolant
lies between the smallest and the largest of its four Bernstein coefficients. A cell whose coefficients stay
inside the stops by that bound has no contact. Otherwise q is expanded in a Taylor series, and the first contact with
either stop is found by rigorous root isolation (`bernstein`). Near the stop that the contact has just left, the
*anchor*, the series of the gap starts from exact values: on the stop its zeros at the start (one after an impact, two
from rest, three after a release) are divided out. Arbitrarily small bounces are therefore resolved to full relative
precision.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.runs import Run
from grazemap_core.contact.kernels.stops import Stops, gap_of
from grazemap_core.contact.tolerances import CONTACT_ROUNDING, END_OF_REST, PASSAGE_PARTS, PASSAGE_STEPS, SHORT_DEGREE
from grazemap_core.numerics.jit.compiled import kernel, plain
from grazemap_core.numerics.kernels.bernstein import BECOMES_NEGATIVE, GRAZE_UNDECIDED, first_negative, value_and_slope
from grazemap_core.numerics.tolerances import TAYLOR_DEGREE

HERMITE_DIVISOR = 384.0
"""A function differs from its cubic Hermite interpolant over a cell of length h by at most h^4/384 max |q''''|."""


@kernel
def is_clear(
    x0: float, v0: float, x1: float, v1: float, step: float, fourth: float, rounding: float, stops: Stops
) -> bool:
    """Return True if a cell certainly has no contact; False decides nothing.

    Positions and velocities are those at the ends of the cell; `fourth` is a bound of |q''''|, `rounding` one of the
    round-off of the positions.
    """
    third = step / 3.0
    square = step * step
    early, late = x0 + third * v0, x1 - third * v1
    error = square * square / HERMITE_DIVISOR * fourth
    highest = max(max(x0, early), max(late, x1))
    lowest = min(min(x0, early), min(late, x1))
    return highest + error < stops.right - rounding and error - lowest < stops.left - rounding  # a NaN is never clear


@kernel
def _other_start(run: Run, stop: int, length: float) -> int:
    """Write the gap to the anchor, divided by its zeros at the start, into run.distance, and return its degree.

    Used if the number of zeros is not one.
    """
    roots = run.cursor[runs.ZERO_ORDER]
    for k in range(TAYLOR_DEGREE + 1 - roots):
        run.distance[k] = -stop * run.taylor[k + roots]
    if roots == 0:
        run.distance[0] = run.near[runs.ANCHOR_GAP]
        run.distance[1] = run.near[runs.ANCHOR_RATE] * length
    degree: int = TAYLOR_DEGREE - roots
    return degree


@kernel
def gap_and_rate(taylor: Floats, near: Floats, roots: int, stop: int, length: float, t: float) -> tuple[float, float]:
    """Return the gap to the anchor and its rate at t in [0, 1], from the series of q and the values in `near`.

    `roots` is the number of zeros of the gap at the start (`ZERO_ORDER`). Its lowest coefficients are not those of q:
    they are exactly 0, or the gap and rate in `near`. So gap and rate keep all their digits next to the stop.
    """
    value = -stop * taylor[TAYLOR_DEGREE]
    slope = 0.0
    lowest = 2 if roots < 2 else roots
    for k in range(TAYLOR_DEGREE - 1, lowest - 1, -1):
        slope = slope * t + value
        value = value * t - stop * taylor[k]
    if roots <= 1:
        slope = slope * t + value
        value = value * t + near[runs.ANCHOR_RATE] * length
    if roots == 0:
        slope = slope * t + value
        value = value * t + near[runs.ANCHOR_GAP]
    for _ in range(roots):  # the zeros at the start
        slope = slope * t + value
        value *= t
    return value, slope / length


@kernel
def first_contact(run: Run, stops: Stops, length: float, size: float, tail: float, rest: float) -> tuple[int, float]:
    """Return (stop, t) of the first contact of the series run.taylor on [0, 1], or (0, 1.0).

    If round-off hides whether the contact touches a stop, this is counted in the tally as a graze, not as a contact. If
    no contact follows, run.near[GRAZE_STOP] is the stop of the graze, and run.near[GRAZE_BACK] the time from it to
    the end of the series.

    The anchor of run.cursor is the stop on which, or near which, the series starts. `size`, `tail` and `rest` are as
    `cells.expand` returned them, `length` is the time that the series spans.
    """
    stop_found = 0
    t_found = 1.0
    graze_stop = 0
    t_graze = 2.0
    travel = 0.0
    for k in range(1, TAYLOR_DEGREE + 1):
        travel += abs(run.taylor[k])
    anchor = run.cursor[runs.ANCHOR]
    for stop in (1, -1):
        if stop == anchor:
            # the round-off of q at the start has no effect
            scale = tail + abs(run.near[runs.ANCHOR_GAP]) + abs(run.near[runs.ANCHOR_RATE]) * length
            degree = TAYLOR_DEGREE - 1
            if run.cursor[runs.ZERO_ORDER] == 1:
                for k in range(1, TAYLOR_DEGREE):
                    run.distance[k] = -stop * run.taylor[k + 1]
                run.distance[0] = run.near[runs.ANCHOR_RATE] * length
            else:
                degree = _other_start(run, stop, length)
        else:
            gap = gap_of(stops, stop)
            if gap == np.inf:
                continue  # there is none
            scale = size + abs(gap)
            if stop * run.taylor[0] + travel + CONTACT_ROUNDING * scale + rest < gap:
                continue  # out of reach
            degree = TAYLOR_DEGREE
            for k in range(TAYLOR_DEGREE + 1):
                run.distance[k] = -stop * run.taylor[k]
            run.distance[0] += gap
        error = CONTACT_ROUNDING * scale + rest
        # a short series, with the omitted terms added to the error, nearly always decides at a third of the cost
        left_out = error
        for k in range(SHORT_DEGREE + 1, degree + 1):
            left_out += abs(run.distance[k])
        status, t = first_negative(run.distance, degree, plain(SHORT_DEGREE), left_out, run.stack, run.start, run.width)
        if status == GRAZE_UNDECIDED:
            status, t = first_negative(run.distance, degree, degree, error, run.stack, run.start, run.width)
            if status == GRAZE_UNDECIDED and t < t_graze:
                graze_stop = stop
                t_graze = t
        if status == BECOMES_NEGATIVE and (stop_found == 0 or t < t_found):
            stop_found = stop
            t_found = t
    if t_graze <= t_found:
        run.tally[runs.UNDECIDED] += 1.0
        run.tally[runs.MIN_UNPRESSED_SPEED] = 0.0
        if stop_found == 0:
            run.near[runs.GRAZE_STOP] = graze_stop
            run.near[runs.GRAZE_BACK] = (1.0 - t_graze) * length
    return stop_found, t_found


@kernel
def enter_passage(run: Run, stops: Stops, end: float) -> None:
    """Enter the smallest distance from a stop at which the contact turns back before t = `end` into the tally.

    Nothing is done where MIN_GAP is negative (not wanted) or 0. The series run.taylor is over at most a cell, in which
    its slope changes so slowly that an extremum shows as a change of sign between a few points. A few steps of regula
    falsi determine the distance. It is that of a maximum of q from the right stop, and of a minimum from the left stop.
    After a rest on a stop the first part of the series is left out (END_OF_REST).
    """
    least = run.tally[runs.MIN_GAP]
    if not least > 0.0:
        return
    taylor = run.taylor
    low = END_OF_REST * end if run.cursor[runs.ZERO_ORDER] > 1 else 0.0
    _, slope_low = value_and_slope(taylor, TAYLOR_DEGREE, low)
    for part in range(PASSAGE_PARTS):
        high = low + (end - low) / (PASSAGE_PARTS - part)
        _, slope_high = value_and_slope(taylor, TAYLOR_DEGREE, high)
        if slope_low * slope_high < 0.0:
            a, b, slope_a, slope_b = low, high, slope_low, slope_high
            for _ in range(PASSAGE_STEPS):
                t = a - slope_a * (b - a) / (slope_b - slope_a)
                x, slope = value_and_slope(taylor, TAYLOR_DEGREE, t)
                if slope * slope_a > 0.0:
                    a, slope_a = t, slope
                else:
                    b, slope_b = t, slope
                least = min(least, stops.right - x if slope_low > 0.0 else stops.left + x)
                if slope == 0.0:
                    break
        low, slope_low = high, slope_high
    run.tally[runs.MIN_GAP] = max(least, 0.0)
