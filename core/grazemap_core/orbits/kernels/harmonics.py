"""Trigonometric polynomials of a phase, many at a time: their values and their zeros.

A polynomial is a constant and the sum of Im(amplitude exp(i order phase)) over the orders.
"""

from __future__ import annotations

import math

from grazemap_core.arrays import Complexes, Floats, Integers
from grazemap_core.numerics.jit.compiled import inlined, inlined_formula, kernel
from grazemap_core.orbits.tolerances import ON_UNIT_CIRCLE, PHASE_POLISHING_STEPS, SAME_ZERO


@inlined
def _value_and_slope(orders: Floats, amplitudes: Complexes, constant: float, phase: float) -> tuple[float, float]:
    """Return a polynomial with amplitudes (H,) at a phase, and its derivative there."""
    value, slope = constant, 0.0
    for h in range(orders.shape[0]):
        order, real, imag = orders[h], amplitudes[h].real, amplitudes[h].imag
        sine, cosine = math.sin(order * phase), math.cos(order * phase)
        value += real * sine + imag * cosine
        slope += order * real * cosine - order * imag * sine
    return value, slope


@kernel
def values_at(
    orders: Floats, amplitudes: Complexes, constants: Floats, phases: Floats, rows: Integers, values: Floats
) -> None:
    """Write into values (p,) those at phases (p,) of the polynomials `rows` (p,).

    Orders are (H,), amplitudes (m, H) and constants (m,).
    """
    for i in range(rows.shape[0]):
        row = rows[i]
        values[i], _ = _value_and_slope(orders, amplitudes[row], constants[row], phases[i])


@kernel
def near_zeros_of_sines(order: float, amplitudes: Complexes, constants: Floats, near: Floats) -> None:
    """Write phases near all zeros of polynomials of one harmonic into near (m, 2 order).

    The rows of polynomials without a zero are left as they are.
    """
    turns = near.shape[1] // 2
    for row in range(near.shape[0]):
        amplitude, constant = amplitudes[row, 0], constants[row]
        size = abs(amplitude)
        if size == 0.0 or abs(constant) > math.cosh(ON_UNIT_CIRCLE) * size:  # the roots are apart from the unit circle
            continue
        lag = math.atan2(amplitude.imag, amplitude.real)
        angle = math.asin(max(-1.0, min(-constant / size, 1.0)))
        for turn in range(turns):
            near[row, turn] = (angle - lag + 2.0 * math.pi * turn) / order
            near[row, turns + turn] = (math.pi - angle - lag + 2.0 * math.pi * turn) / order


@kernel
def zeros_near(
    orders: Floats, amplitudes: Complexes, constants: Floats, near: Floats, zeros: Floats, counts: Integers
) -> None:
    """Write into zeros (m, k), increasing in [0, 2 pi), those of the polynomials next to phases near (m, k).

    Those closer than SAME_ZERO are one. How many a row has is written into counts (m,). NaN is near no zero.
    """
    for row in range(near.shape[0]):
        constant, size, count = constants[row], 0.0, 0
        for h in range(orders.shape[0]):
            size += abs(amplitudes[row, h])
        size += abs(constant)
        for k in range(near.shape[1]):
            phase = near[row, k]
            if math.isnan(phase):
                continue
            value, slope = _value_and_slope(orders, amplitudes[row], constant, phase)
            for _ in range(PHASE_POLISHING_STEPS):
                before = phase
                phase -= value / slope if slope != 0.0 else 0.0
                if phase == before:
                    break
                value, slope = _value_and_slope(orders, amplitudes[row], constant, phase)
            if abs(value) <= ON_UNIT_CIRCLE * size:
                _insert(zeros[row], count, within_turn(phase))
                count += 1
        counts[row] = _apart_on_circle(zeros[row], count)


@inlined
def _insert(ordered: Floats, count: int, phase: float) -> None:
    """Insert a phase into the first, increasing, numbers of an array."""
    place = count
    while place > 0 and ordered[place - 1] > phase:
        ordered[place] = ordered[place - 1]
        place -= 1
    ordered[place] = phase


@inlined
def _apart_on_circle(ordered: Floats, count: int) -> int:
    """Take from increasing phases those that follow another one, on the circle, within SAME_ZERO; return how many stay.

    One always stays.
    """
    if count == 0:
        return 0
    last, kept = ordered[count - 1] - 2.0 * math.pi, 0
    for i in range(count):
        phase = ordered[i]
        if phase - last > SAME_ZERO:
            ordered[kept] = phase
            kept += 1
        last = phase
    return max(kept, 1)


@inlined_formula
def within_turn(phase: float) -> float:
    """Return a phase in [0, 2 pi); the remainder of a tiny negative one is rounded to 2 pi."""
    turned = phase % (2.0 * math.pi)
    return turned if turned < 2.0 * math.pi else 0.0
