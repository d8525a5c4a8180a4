"""The arguments of the trajectory kernels that describe an oscillator, and elementary operations on its state.

Time is cut into cells, an even number per forcing period. A state is the pair (u_j, u_j') of every block of the modal
model *minus the steady motion*, which is tabulated over the cells of one period. A state therefore decays between
impacts, and no phase is accumulated. Functions take a `CellProblem`, built by `grazemap_core.contact.forced`, and
a state of shape (N, 2); docstrings state which arguments are changed in place.

The steady motion of a resonant mode (`model.harmonic_response`) is not subtracted. In its place stands the response of
the mode to the forcing from rest at the start of the half period. The *reference motion* that is tabulated is the sum
of these responses and the steady motion of all other modes. It begins anew with every half period: `begin_half_period`.
"""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.contact.tolerances import CLEARED
from grazemap_core.model.kernels.block_flow import forced_block
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.kernels.double_double import two_sum
from grazemap_core.numerics.tolerances import TAYLOR_DEGREE
from grazemap_core.records import NamedTuple

_ORDERS = np.arange(TAYLOR_DEGREE + 1)
STEP_OF_SERIES = 1.0 / ((_ORDERS + 1.0) * (_ORDERS + 2.0))
"""1 / ((m + 1) (m + 2)), the factor of term m + 2 of the series of a second-order equation, from terms m + 1 and m."""


class CellProblem(NamedTuple):
    """One oscillator at one forcing frequency."""

    decay: Floats
    """(N,) Of the blocks, as in the modal model."""
    discriminant: Floats
    """(N,) Of the blocks, as in the modal model."""
    frequency_squared: Floats
    """(N,) Of the blocks, as in the modal model."""
    frequency: Floats
    """(N,) The root of frequency_squared."""
    output_row: Floats
    """(N, 4) q = sum r0 u + r1 u', q' = sum r2 u + r3 u' (without the steady motion)."""
    unit_impulse: Floats
    """(N, 2) Change of (u, u') by an impulse on the contact that changes q' by 1."""
    unit_impulse_low: Floats
    """(N, 2) Rounding error of `unit_impulse`: with both, q' changes by exactly 1 and q does not."""
    unit_displacement: Floats
    """(N, 2) Change of (u, u') by a displacement in the direction of the jump that changes q by 1."""
    reach: Floats
    """(N,) Bound for all later times: |contribution to q| <= reach * e, where e = frequency |u| + |u'|."""
    fourth: Floats
    """(N,) Bound for all later times: |4th derivative of the contribution to q| <= fourth * e."""
    displacement_scale: Floats
    """(N, 2) Largest displacement for a unit of u, and for a unit of u', in the unit of the contact coordinate; 0 for
    an undamped block that contact does not see."""
    cell_flow: Floats
    """(N, 4) Flow over one cell, row by row."""
    flow_table: Floats
    """(n, N, 8) Flow over 0, 1, .. n - 1 cells, row by row, followed by the rounding errors of the entries."""
    steady_table: Floats
    """(cells + 1, 2) Reference motion of q at the cell boundaries, as (velocity/omega, displacement); with resonant
    modes at the end of a half period that of this half period, not of the next. With one harmonic of the order 1, and
    no resonant mode, it is G exp(i phase) as (real, imaginary)."""
    half_start: Floats
    """(2, 2) Reference motion as in `steady_table`, at the starts of the first and the second half period."""
    steady_bound: float
    """Bound of the reference motion of q: |G| with one harmonic."""
    steady_fourth: float
    """Bound of its fourth derivative: omega^4 |G| with one harmonic."""
    reference_series: Floats
    """(cells, TAYLOR_DEGREE + 1) Series of the reference motion of q over each cell, scaled to t in [0, 1]. No rows
    with one harmonic of the order 1 and no resonant mode."""
    reference_rest: float
    """Bound of the remainder of these series."""
    orders: Floats
    """(H,) Orders of the harmonics of the forces."""
    resonant_forcing: Complexes
    """(H, N, 2) Forcing, by each harmonic, of the equations of u and u' of the modes that are resonant with it, the
    phase at t = 0 included; 0 for other modes. (H, 0, 2) without such modes."""
    half_jump: Floats
    """(2, N, 2) Response of the resonant modes at the end of the first and of the second half period; (2, 0, 2) without
    such modes."""
    resonant_steady: Floats
    """(2, N, 2) Steady motion of the resonant modes at the starts of these half periods; (2, 0, 2) without such
    modes."""
    lasting_steady: Floats
    """(H, 2) Real and imaginary part of the steady amplitudes of q at t = 0, with all modes, harmonic by harmonic;
    infinite if a mode is resonant and undamped."""
    lasting_bound: float
    """Bound of the steady motion of q with all modes: the sum of the moduli of its amplitudes."""
    unreached: Floats
    """(2,) By how much the steady motion falls short of `lasting_bound` toward the right stop, and toward the left one;
    0 with one harmonic."""
    omega: float
    """Forcing frequency."""
    step: float
    """Length of a cell."""
    cells: int
    """Number of cells in a forcing period, even."""
    damped: bool
    """Whether every block that contact sees is damped: a motion without contacts then settles to the steady motion."""


class HeldProblem(NamedTuple):
    """One oscillator at one forcing frequency, the contact at rest on a stop; forces with H harmonics."""

    decay: Floats
    """(n,) Of the blocks of the constrained structure."""
    discriminant: Floats
    """(n,) Of the blocks of the constrained structure."""
    frequency_squared: Floats
    """(n,) Of the blocks of the constrained structure."""
    output_row: Floats
    """(n, 4) Acceleration of q at rest, sum r0 u + r1 u', and its rate, sum r2 u + r3 u'."""
    orders: Floats
    """(H,) Orders of the harmonics."""
    steady_table: Floats
    """(H, cells + 1, 2) Acceleration of q at rest by each harmonic, as (real, imaginary) at the cell boundaries; it is
    the imaginary part."""
    static_acceleration: float
    """Static part of the acceleration of q at rest per unit of the gap, away from the stop."""
    viscous_term: float
    """h^T M^-1 C a, with a the direction of the jump: the rate at which damping alone slows q after an impulse."""
    profile: Floats
    """(N,) Displacements at the equilibrium with q held, per unit of q."""
    phase_factors: Floats
    """(H, cells + 1, 2) exp(i order phase) at the cell boundaries."""
    steady: Floats
    """(H, N, 2) Amplitudes of the displacements of the steady motion with q held at 0. The displacement is the
    imaginary part of amplitude times exp(i order phase)."""
    free_steady: Floats
    """(H, 2 N, 2) Amplitudes of the steady motion with q free, without resonant modes: those of the displacements, then
    those of the velocities divided by i order omega."""
    to_blocks: Floats
    """(2 n, 2 N) From displacements and velocities, of which a motion of q is taken away in the direction of the jump,
    to the blocks of the constrained structure."""
    from_blocks: Floats
    """(2 N, 2 n) The reverse of `to_blocks`."""
    to_free: Floats
    """(2 N, 2 N) From displacements and velocities to the blocks of the free structure."""
    from_free: Floats
    """(2 N, 2 N) The reverse of `to_free`."""
    exists: bool
    """False if the constrained structure has no accurate closed form: an undamped resonance with the forcing, or two
    blocks that are nearly defective together."""
    omega: float
    """Forcing frequency."""


class Forced(NamedTuple):
    """One oscillator at one forcing frequency and phase: all that trajectories share, whatever their stops."""

    free: CellProblem
    """With the contact free."""
    held: HeldProblem
    """With the contact at rest on a stop."""


@kernel
def rotated_entry(table: Floats, cell: int, angle: float) -> tuple[float, float]:
    """Return an entry of a table of complex numbers, rotated by an angle, as (real, imaginary)."""
    c, s = math.cos(angle), math.sin(angle)
    re, im = table[cell, 0], table[cell, 1]
    return re * c - im * s, im * c + re * s


@kernel
def advance_cell(problem: CellProblem, u: Floats, end: int) -> tuple[float, float]:
    """Carry a state over one whole cell, in place, and return q and q' at cell boundary `end`."""
    x = problem.steady_table[end, 1]
    v = problem.omega * problem.steady_table[end, 0]
    for j in range(u.shape[0]):
        first, second = u[j, 0], u[j, 1]
        a = problem.cell_flow[j, 0] * first + problem.cell_flow[j, 1] * second
        b = problem.cell_flow[j, 2] * first + problem.cell_flow[j, 3] * second
        u[j, 0] = a
        u[j, 1] = b
        x += problem.output_row[j, 0] * a + problem.output_row[j, 1] * b
        v += problem.output_row[j, 2] * a + problem.output_row[j, 3] * b
    return x, v


@kernel
def carry(problem: CellProblem, start: Floats, cells: int, u: Floats) -> None:
    """Write the state `cells` cells after `start` into u (N, 2); both may be the same array.

    The flow is applied once, so that rounding errors of single cells do not accumulate.

    Parameters
    ----------
    cells : int
        Less than the length of the flow table.
    """
    for j in range(u.shape[0]):
        first, second = start[j, 0], start[j, 1]
        for i in range(2):
            a = problem.flow_table[cells, j, 2 * i] * first
            b = problem.flow_table[cells, j, 2 * i + 1] * second
            low = problem.flow_table[cells, j, 2 * i + 4] * first + problem.flow_table[cells, j, 2 * i + 5] * second
            total, lost = two_sum(a, b)
            u[j, i] = total + (lost + low)  # rounded once


@kernel
def contact_motion(problem: CellProblem, u: Floats, steady_real: float, steady_imag: float) -> tuple[float, float]:
    """Return q and q' of a state; `steady_real` and `steady_imag` are velocity/omega and q of the reference motion."""
    x = steady_imag
    v = problem.omega * steady_real
    for j in range(u.shape[0]):
        x += problem.output_row[j, 0] * u[j, 0] + problem.output_row[j, 1] * u[j, 1]
        v += problem.output_row[j, 2] * u[j, 0] + problem.output_row[j, 3] * u[j, 1]
    return x, v


@kernel
def reference_at_half(problem: CellProblem, half: int) -> tuple[float, float]:
    """Return the reference motion of q at the start of a half period, as (velocity/omega, displacement)."""
    return problem.half_start[half % 2, 0], problem.half_start[half % 2, 1]


@kernel
def reference_at(problem: CellProblem, cell: int, offset: float) -> tuple[float, float, float]:
    """Return velocity/omega, displacement and acceleration of the reference motion of q.

    The time is `offset` after the start of a cell, and in the same half period.
    """
    if problem.reference_series.shape[0] == 0:
        real, imag = rotated_entry(problem.steady_table, cell, problem.omega * offset)
        return real, imag, -problem.omega * problem.omega * imag
    later = min(int(offset / problem.step), problem.cells // 2 - 1 - cell % (problem.cells // 2))
    series, t = problem.reference_series[cell + later], offset / problem.step - later
    value, slope, half_bend = 0.0, 0.0, 0.0
    for k in range(TAYLOR_DEGREE, -1, -1):
        half_bend = half_bend * t + slope
        slope = slope * t + value
        value = value * t + series[k]
    return (
        slope / (problem.step * problem.omega),
        value,
        2.0 * half_bend / (problem.step * problem.step),
    )


@kernel
def forced_part(problem: CellProblem, u: Floats, half: int, time: float, sign: float) -> None:
    """Add `sign` times the response of the resonant modes to a state, in place.

    Parameters
    ----------
    half : int
        The half period in which the response begins.
    time : float
        Since its start; it may be later than its end.
    """
    for h in range(problem.orders.shape[0]):
        order = problem.orders[h]
        turned = -sign if half % 2 == 1 and order % 2.0 == 1.0 else sign
        for j in range(problem.resonant_forcing.shape[1]):
            first, second = problem.resonant_forcing[h, j, 0], problem.resonant_forcing[h, j, 1]
            if first == 0.0 and second == 0.0:
                continue
            displacement, velocity = forced_block(
                problem.decay[j],
                problem.discriminant[j],
                problem.frequency_squared[j],
                first,
                second,
                order * problem.omega,
                time,
            )
            u[j, 0] += turned * displacement.imag
            u[j, 1] += turned * velocity.imag


@kernel
def begin_half_period(problem: CellProblem, u: Floats, half: int) -> None:
    """Convert a state at the end of the half period before `half` to the reference motion of `half`, in place."""
    ended = (half + 1) % 2
    for j in range(problem.half_jump.shape[1]):
        u[j, 0] += problem.half_jump[ended, j, 0]
        u[j, 1] += problem.half_jump[ended, j, 1]


@kernel
def contact_acceleration_of(problem: CellProblem, u: Floats, reference: float) -> float:
    """Return the acceleration of q in a state; `reference` is that of the reference motion."""
    a = reference
    for j in range(u.shape[0]):
        second = -problem.frequency_squared[j] * u[j, 0] - 2.0 * problem.decay[j] * u[j, 1]
        a += problem.output_row[j, 2] * u[j, 1] + problem.output_row[j, 3] * second
    return a


@kernel
def bounds(problem: CellProblem, u: Floats) -> tuple[float, float]:
    """Return bounds of |q| and |q''''| for all later times until the next impact.

    With resonant modes, until the end of the half period.
    """
    reach = problem.steady_bound
    fourth = problem.steady_fourth
    for j in range(u.shape[0]):
        envelope = problem.frequency[j] * abs(u[j, 0]) + abs(u[j, 1])
        reach += problem.reach[j] * envelope
        fourth += problem.fourth[j] * envelope
    return reach, fourth


@kernel
def free_reach(problem: CellProblem, stops: Stops) -> float:
    """Return the bound of |q| below which a motion that decays to the steady motion never touches a stop."""
    right: float = CLEARED * stops.right + problem.unreached[0]
    left: float = CLEARED * stops.left + problem.unreached[1]
    return min(right, left)


@kernel
def reach_from(problem: CellProblem, stops: Stops, u: Floats, half: int) -> float:
    """Return a bound of |q| until the end of the half period without impacts, from the state at its start.

    A bound below `free_reach` holds for all time to come, as no impact follows. It is computed from the state minus the
    steady motion of all modes.
    """
    reach, _ = bounds(problem, u)
    if problem.half_jump.shape[1] == 0:
        return reach
    lasting, steady = problem.lasting_bound, problem.resonant_steady[half % 2]
    for j in range(steady.shape[0]):
        first, second = u[j, 0] - steady[j, 0], u[j, 1] - steady[j, 1]
        lasting += problem.reach[j] * (problem.frequency[j] * abs(first) + abs(second))
    free = free_reach(problem, stops)
    return lasting if lasting < free else max(reach, free)


@kernel
def add_reference_series(
    problem: CellProblem, cell: int, offset: float, length: float, taylor: Floats, series: Floats
) -> tuple[float, float]:
    """Add the series of the reference motion over the next `length`, from its table, to that of `expand`, in place.

    The time is `offset` after the start of the cell; series (TAYLOR_DEGREE + 1,) is scratch. Returns the sum of the
    moduli of all terms, and of those of degree two and higher.
    """
    t = offset / problem.step
    for k in range(TAYLOR_DEGREE + 1):
        series[k] = problem.reference_series[cell, k]
    if t > 0.0:
        for lowest in range(TAYLOR_DEGREE):
            for k in range(TAYLOR_DEGREE - 1, lowest - 1, -1):
                series[k] += t * series[k + 1]
    power, size, tail = 1.0, 0.0, 0.0
    for k in range(TAYLOR_DEGREE + 1):
        term = power * series[k]
        taylor[k] += term
        size += abs(term)
        tail += abs(term) if k > 1 else 0.0
        power *= length / problem.step
    return size, tail


@kernel
def expand(
    problem: CellProblem | HeldProblem,
    u: Floats,
    omega: float,
    steady: tuple[float, float],
    length: float,
    taylor: Floats,
    terms: Floats,
) -> tuple[float, float, float]:
    """Write the series of q over the next `length`, scaled to t in [0, 1], into taylor (TAYLOR_DEGREE + 1,).

    With the problem and state of a contact at rest it is the series of its acceleration.

    Every block's contribution obeys y'' = -square y - 2 decay y', which gives each term from the two previous ones. The
    steady motion is one more block, without decay.

    Parameters
    ----------
    steady : (float, float)
        Real and imaginary part of the steady motion at the start, of the forcing frequency `omega`.
    terms : (N + 1, 4)
        Scratch: the last two terms and the two coefficients of the recurrence of every block.

    Returns
    -------
    size : float
        Sum of the moduli of all terms, to which round-off is relative.
    tail : float
        Sum of the moduli of the terms of degree two and higher.
    rest : float
        Bound of the remainder of the series on [0, 1].
    """
    blocks = u.shape[0]
    for j in range(blocks):
        terms[j, 0] = problem.output_row[j, 0] * u[j, 0] + problem.output_row[j, 1] * u[j, 1]
        terms[j, 1] = (problem.output_row[j, 2] * u[j, 0] + problem.output_row[j, 3] * u[j, 1]) * length
        terms[j, 2] = 2.0 * problem.decay[j] * length
        terms[j, 3] = problem.frequency_squared[j] * length * length
    terms[blocks, 0] = steady[1]
    terms[blocks, 1] = omega * steady[0] * length
    terms[blocks, 2] = 0.0
    terms[blocks, 3] = (omega * length) ** 2
    size = 0.0
    tail = 0.0
    taylor[0] = 0.0
    taylor[1] = 0.0
    for j in range(blocks + 1):
        taylor[0] += terms[j, 0]
        taylor[1] += terms[j, 1]
        size += abs(terms[j, 0]) + abs(terms[j, 1])
    for m in range(TAYLOR_DEGREE - 1):
        total = 0.0
        for j in range(blocks + 1):
            c = -(terms[j, 2] * (m + 1) * terms[j, 1] + terms[j, 3] * terms[j, 0]) * STEP_OF_SERIES[m]
            terms[j, 0] = terms[j, 1]
            terms[j, 1] = c
            total += c
            tail += abs(c)
        taylor[m + 2] = total
    # the next derivative obeys the same equation, so its energy does not increase: two more terms bound the remainder
    rest = 0.0
    for j in range(blocks + 1):
        a, b, p, q = terms[j, 0], terms[j, 1], terms[j, 2], terms[j, 3]
        c = -(p * TAYLOR_DEGREE * b + q * a) * STEP_OF_SERIES[TAYLOR_DEGREE - 1]
        d = -(p * (TAYLOR_DEGREE + 1) * c + q * b) * STEP_OF_SERIES[TAYLOR_DEGREE]
        rest += abs(c)
        if q > 0.0:
            rest += abs(d) * (TAYLOR_DEGREE + 2) / math.sqrt(q)
    return size + tail, tail, rest


@kernel
def add_harmonic(steady: tuple[float, float], frequency: float, length: float, taylor: Floats) -> tuple[float, float]:
    """Add the series of one more harmonic over the next `length`, scaled to t in [0, 1], to that of `expand`, in place.

    `steady` has the real and the imaginary part of the harmonic at the start. Returns the sum of the moduli of its
    terms, and a bound of the remainder on [0, 1].
    """
    angle = frequency * length
    before, term, size = steady[1], angle * steady[0], abs(steady[1])
    taylor[0] += before
    for m in range(1, TAYLOR_DEGREE + 1):
        taylor[m] += term
        size += abs(term)
        before, term = term, -angle * angle * before * STEP_OF_SERIES[m - 1]
    # the next derivatives have the modulus of this one
    return size, math.hypot(term, angle * before / (TAYLOR_DEGREE + 1))
