"""Numbers and matrices of balls. A comparison of balls is true only if it holds for all numbers in them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, fmpq

NUMBER = re.compile(r"-?\d+(\.\d+)?([eE][-+]?\d{1,4}|/\d+)?")


class Refused(Exception):
    """The certificate is no proof; says which inequality fails or is undecided."""


def require(condition: bool, reason: str) -> None:
    """Raise Refused unless the condition is shown."""
    if not condition:
        raise Refused(reason)


def rational(text: str) -> Fraction:
    """Return the number that a decimal or a quotient stands for."""
    if not NUMBER.fullmatch(text):
        raise ValueError(f"not a decimal or rational number: {text[:40]}")
    return Fraction(text)


def exact(text: str) -> arb:
    """Return a ball around a rational number."""
    value = rational(text)
    return arb(fmpq(value.numerator, value.denominator))


def ball(centre: arb, radius: arb) -> arb:
    """Return the ball of all numbers within a radius of the centre."""
    return centre + radius * arb(0, 1)


def identity(size: int) -> arb_mat:
    """Return the identity matrix."""
    return arb_mat(size, size, [int(i == j) for i in range(size) for j in range(size)])


def diagonal(values: arb_mat) -> arb_mat:
    """Return the diagonal matrix of a column."""
    size = values.nrows()
    return arb_mat(size, size, [values[i, 0] if i == j else 0 for i in range(size) for j in range(size)])


def stacked(blocks: Iterable[Sequence[arb_mat]]) -> arb_mat:
    """Return the matrix of rows of blocks."""
    return arb_mat([[*left, *right] for row in blocks for left, right in zip(*(b.tolist() for b in row), strict=True)])


def column(values: Sequence[Any]) -> arb_mat:
    """Return a matrix of one column."""
    return arb_mat(len(values), 1, list(values))


def largest(matrix: arb_mat) -> arb:
    """Return an upper bound of the entries' moduli, exact."""
    return max((abs(x).abs_upper() for x in matrix.entries()), default=arb(0))


def eigenvalues(matrix: arb_mat) -> list[acb]:
    """Return enclosures of the eigenvalues, with repetition."""
    try:
        return list(acb_mat(matrix).eig(multiple=True))
    except ValueError:
        raise Refused("the eigenvalues are not enclosed at this precision") from None


def definite(matrix: arb_mat) -> bool:
    """Return whether a symmetric matrix is shown to be positive definite: every pivot is positive."""
    rows = matrix.tolist()
    for i, row in enumerate(rows):
        if not row[i] > 0:
            return False
        for below in rows[i + 1 :]:
            factor = below[i] / row[i]
            below[i:] = [x - factor * y for x, y in zip(below[i:], row[i:], strict=True)]
    return True
