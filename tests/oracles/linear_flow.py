"""The motion ``u' = W u`` of a linear system in multi-precision, and the first time at which a row of it meets a level.

The motion is the exponential of the matrix itself (its Taylor series; no modes). A step is cut into cells. In double
precision the observed quantity at the ends of a cell and a bound of its curvature show which cells are free of events;
only in the others is its Taylor series looked at, in multi-precision. Times within a cell, and Taylor coefficients, are
in units of a cell. Nothing is imported from the core.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import count
from typing import NamedTuple

import numpy as np
from flint import arb, arb_mat, ctx
from numpy.typing import NDArray

from tests.oracles.fifty_digits import digits as working_with
from tests.oracles.series_roots import Precision, Undecided, first_fall, power_of_ten

Floats = NDArray[np.float64]

CELLS = 16
"""Cells over the inverse of the fastest exponent."""

REACH = 8
"""Length of a step over the inverse of the fastest exponent."""

EXTRA_BITS = 64
"""Guard bits with which the matrices of a step are made."""

SHORT = 12
"""Terms of a series that count at times below ``10^-(digits/10 + 1)``."""

HIGHEST = 8
"""Derivatives of the observed quantity that are bounded."""


class Target(NamedTuple):
    """The event ``level - sign * observed = 0``, fallen to from above.

    `zeros` is the order of the zero that this difference has where the step begins: it is divided out.
    """

    sign: int
    level: arb
    zeros: int


class Event(NamedTuple):
    """Which target is met, in which cell of the step and how long after the beginning of that cell, in [0, 1]."""

    target: int
    cell: int
    after: arb


class LinearFlow:
    """The motion of a system, and the row of it that is observed.

    Attributes
    ----------
    step : arb
        The longest time that is looked at at once.
    cell : float
        The length of a cell, a power of 2.
    unit : float
        About the inverse of the fastest exponent.
    """

    def __init__(self, matrix: arb_mat, observed: arb_mat, coordinates: int, fastest: float, digits: int) -> None:
        """Prepare steps of a system whose first `coordinates` numbers are displacements, the next ones their rates.

        Parameters
        ----------
        matrix, observed : (P, P) and (1, P)
        fastest : float
            At least the largest modulus of an eigenvalue of the matrix.
        """
        self._count, self._digits = coordinates, digits
        self.unit = 1.0 / fastest
        self.cell = 2.0 ** np.floor(np.log2(self.unit / CELLS))
        self._cells = CELLS * REACH
        self.step = arb(self._cells * self.cell)
        with working_with(digits):
            bits = ctx.prec
            ctx.prec += EXTRA_BITS
            squares = [(matrix * arb(self.cell)).exp().mid()]
            while len(squares) < self._cells.bit_length():
                squares.append((squares[-1] * squares[-1]).mid())
            self._sample(observed, squares)
            rows = self._expand(matrix, observed)
            ctx.prec = bits
            # the exponentials of so many cells, of which others are made when they are needed
            self._exponentials = {2**k: _rounded(square) for k, square in enumerate(squares)}
            self._observed = _rounded(arb_mat([row for part in rows for row in part[:1]]))
            self._displacements = _rounded(arb_mat([row for part in rows for row in part[1:]]))
            self._first_displacements = _rounded(arb_mat([row for part in rows[:SHORT] for row in part[1:]]))
        self._leading = _doubles(self._observed.tolist()[:HIGHEST])
        self._bound(_doubles(matrix.tolist()))

    def _sample(self, observed: arb_mat, squares: list[arb_mat]) -> None:
        """Make the rows whose products with a state are the observed quantity at the ends of the cells."""
        rows = observed
        for square in squares[:-1]:
            rows = arb_mat(rows.tolist() + (rows * square).mid().tolist())
        self._samples = _doubles([*rows.tolist(), *(observed * squares[-1]).tolist()])

    def _expand(self, matrix: arb_mat, observed: arb_mat) -> list[list[list[arb]]]:
        """Return the rows whose products with a state are Taylor coefficients: observed quantity and displacements."""
        size, per_cell = matrix.nrows(), matrix * arb(self.cell)
        rows = arb_mat([*observed.tolist(), *([int(i == j) for j in range(size)] for i in range(self._count))])
        largest, settled, terms = np.full((self._count + 1, size), -np.inf), 0, []
        below = (self._digits + 10) * np.log2(10.0)
        while settled < 2 or len(terms) <= SHORT + HIGHEST:
            terms.append(rows.tolist())
            sizes = _exponents(terms[-1])
            largest = np.maximum(largest, sizes)
            settled = settled + 1 if np.all(sizes <= largest - below) else 0
            rows = (rows * per_cell * (1 / arb(len(terms)))).mid()
            assert len(terms) < 4000
        return terms

    def _bound(self, matrix: Floats) -> None:
        """Bound the derivatives of the observed quantity over the whole step, for every number of a state."""
        half = np.abs(matrix) * (self.cell / 2.0)
        widened = term = np.eye(len(matrix))
        for k in count(1):
            term = term @ half / k
            widened = widened + term
            if np.all(term <= 1e-16 * widened):
                break
        derivatives, self._bounds = self._samples, []
        for _ in range(HIGHEST):
            self._bounds.append(np.abs(derivatives).max(axis=0) @ widened)
            derivatives = derivatives @ matrix * self.cell
        self._times = np.arange(self._cells + 1.0)
        self._roundings = 1e-15 * len(matrix)

    def observed_terms(self, state: arb_mat, cell: int = 0) -> list[arb]:
        """Return the Taylor coefficients of the observed quantity from the beginning of a cell on."""
        return (self._observed * self._at_cell(state, cell)).mid().entries()

    def noise(self, state: arb_mat) -> arb:
        """Return the size of rounding errors of the observed quantity, generously."""
        return self._noise(_numbers(state))

    def _noise(self, numbers: Floats) -> arb:
        return float(self._bounds[0] @ np.abs(numbers)) * power_of_ten(-self._digits)

    def first_event(self, state: arb_mat, targets: Sequence[Target]) -> Event | None:
        """Return the first event of a step from a state."""
        numbers = _numbers(state)
        sizes = np.abs(numbers)
        if any(target.zeros == 1 and self._soon(target, numbers) for target in targets):
            event = self._in_cell(state, 0, targets, numbers)
            if event is not None:
                return event
        values = self._samples @ numbers
        roundings = self._roundings * float(self._bounds[0] @ sizes)
        suspects = np.zeros(self._cells, dtype=np.bool_)
        for target in targets:
            level, zeros = float(target.level), target.zeros
            left = level - target.sign * values
            margin = roundings + self._roundings * abs(level)
            if zeros:
                left[1:] /= self._times[1:] ** zeros
                left[0] = -target.sign * (self._leading[zeros] @ numbers)
            curvature = float(self._bounds[zeros + 2] @ sizes) / _ratio(zeros)
            suspects |= np.minimum(left[:-1], left[1:]) <= curvature / 8.0 + margin
        for cell in np.flatnonzero(suspects).tolist():
            event = self._in_cell(state, cell, targets, numbers)
            if event is not None:
                return event
        return None

    def _soon(self, target: Target, numbers: Floats) -> bool:
        """Return whether the observed quantity probably comes back within half a cell."""
        rate, bend = (-target.sign * float(self._leading[k] @ numbers) for k in (1, 2))
        return rate > 0.0 > bend and rate < -bend / 2.0

    def _in_cell(self, state: arb_mat, cell: int, targets: Sequence[Target], numbers: Floats) -> Event | None:
        terms = self.observed_terms(state, cell)
        earliest: Event | None = None
        for place, target in enumerate(targets):
            left = [-target.sign * c for c in terms]
            left[0] = left[0] + target.level
            zeros = target.zeros if cell == 0 else 0
            after = self._fall(left[zeros:], numbers)
            if after is not None and (earliest is None or after < earliest.after):
                earliest = Event(place, cell, after)
        return earliest

    def _fall(self, left: list[arb], numbers: Floats) -> arb | None:
        noise = self._noise(numbers)
        if left[0] <= 0:  # a zero that is a rounding before the beginning of the cell
            assert abs(left[0]) <= noise, "the motion is beyond a stop"
            if left[1] >= 0:
                raise Undecided("the motion touches a stop between two cells")
            return arb(0)
        return first_fall(left, 1.0, Precision(self._digits, noise))

    def after(self, state: arb_mat, time: arb) -> list[arb]:
        """Return the displacements and rates after a time, at most a step."""
        cells = (time / arb(self.cell)).mid()
        cell = min(int(float(cells)), self._cells - 1)
        return self.within(state, cell, (cells - cell).mid())

    def time_of(self, event: Event) -> arb:
        """Return the time of an event after the beginning of the step."""
        return ((event.cell + event.after) * arb(self.cell)).mid()

    def within(self, state: arb_mat, cell: int, after: arb) -> list[arb]:
        """Return the displacements and rates at a time after the beginning of a cell."""
        rows = (
            self._first_displacements
            if abs(float(after)) < 10.0 ** -(self._digits / 10.0 + 1.0)
            else self._displacements
        )
        terms = rows.nrows() // self._count
        powers = [arb(1)]
        for _ in range(terms - 1):
            powers.append((powers[-1] * after).mid())
        rates = [arb(0), *(k * power for k, power in enumerate(powers[:-1], 1))]
        series = arb_mat(terms, self._count, (rows * self._at_cell(state, cell)).entries())
        entries = (arb_mat(2, terms, powers + rates) * series).mid().entries()
        return [*entries[: self._count], *(rate / arb(self.cell) for rate in entries[self._count :])]

    def whole_step(self, state: arb_mat) -> list[arb]:
        """Return the displacements and rates after a step."""
        return [v.mid() for v in self._at_cell(state, self._cells).entries()[: 2 * self._count]]

    def _at_cell(self, state: arb_mat, cell: int) -> arb_mat:
        return (self._exponential(cell) * state).mid() if cell else state

    def _exponential(self, cells: int) -> arb_mat:
        if cells not in self._exponentials:
            last = cells & -cells
            self._exponentials[cells] = (self._exponential(cells - last) * self._exponential(last)).mid()
        return self._exponentials[cells]


def _numbers(state: arb_mat) -> Floats:
    return np.array([float(v) for v in state.entries()])


def _doubles(rows: Sequence[Sequence[arb]]) -> Floats:
    return np.array([[float(v) for v in row] for row in rows])


def _exponents(rows: Sequence[Sequence[arb]]) -> Floats:
    """Return the binary exponents of numbers, of any size; -inf of 0."""
    parts = [[v.mid().man_exp() for v in row] for row in rows]
    return np.array([[int(e) + int(m).bit_length() if m else -np.inf for m, e in row] for row in parts])


def _rounded(matrix: arb_mat) -> arb_mat:
    return (matrix * arb(1)).mid()


def _ratio(zeros: int) -> float:
    """Return the bound of the derivative of order zeros + 2 over that of the second one of the quotient by t^zeros."""
    return math.factorial(zeros + 2) / 2.0
