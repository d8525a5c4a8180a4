"""Numbers and matrices of balls. A comparison of balls is true only if it holds for all numbers in them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, fmpq


class Refused(Exception):
    """The certificate is no proof. The text says which inequality fails or is undecided."""


def require(condition: bool, reason: str) -> None:
    """Raise Refused unless the condition is shown."""
    if not condition:
        raise Refused(reason)


def exact(number: Fraction | str) -> arb:
    """Return a ball that contains a rational number; the number may also be a decimal or a quotient as text."""
    return arb(fmpq(*Fraction(number).as_integer_ratio()))


def exponent(number: arb) -> int:
    """Return the least e for which a finite ball lies below 2^e in modulus; 0 for the ball of 0 alone."""
    mantissa, power = number.abs_upper().man_exp()
    return int(mantissa).bit_length() + int(power)


def ball(radius: arb) -> arb:
    """Return the ball of all numbers up to a radius."""
    return radius * arb(0, 1)


def column(values: Sequence[Any]) -> Any:
    """Return a matrix of one column, complex if a value is."""
    kind = acb_mat if any(isinstance(x, acb) for x in values) else arb_mat
    return kind([[x] for x in values])


def identity(size: int) -> arb_mat:
    """Return the identity matrix."""
    return arb_mat([[int(i == j) for j in range(size)] for i in range(size)])


def definite(matrix: arb_mat) -> bool:
    """Return whether a symmetric matrix is shown to be positive definite: every leading minor is positive."""
    rows = matrix.tolist()
    return all(arb_mat([row[:k] for row in rows[:k]]).det() > 0 for k in range(1, len(rows) + 1))


def quotients(function: Callable[[list[Any]], list[Any]], centre: list[arb], step: arb) -> tuple[list[arb], arb_mat]:
    """Return the values of a function at a centre, and its difference quotients over a step of every unknown."""
    values = function(centre)
    moved = [function([x + step * (i == j) for i, x in enumerate(centre)]) for j in range(len(centre))]
    return values, arb_mat([[(b[i] - a) / step for b in moved] for i, a in enumerate(values)])


Function = Callable[[list[Any]], list[Any]]
"""A function of several unknowns, with as many values."""


def analytic_jacobian(function: Function, centre: list[arb], radius: arb) -> arb_mat:
    """Return an enclosure of the derivative of an analytic function over the box of a radius around a centre.

    Difference quotients differ from it by second derivatives, which Cauchy's estimate bounds by the change of the
    values on complex discs.
    """
    middle, rows = quotients(function, centre, radius)
    reach = radius.sqrt().mid()
    require(2 * radius < reach, "the radius is too large")
    values = function([acb(x + ball(reach), ball(reach)) for x in centre])
    bends = [4 * len(centre) * radius * abs(b - a) / (reach - radius) ** 2 for a, b in zip(middle, values, strict=True)]
    return arb_mat([[x + ball(bend) for x in row] for row, bend in zip(rows.tolist(), bends, strict=True)])


def newton(function: Function, centre: list[arb], radius: arb, jacobian: arb_mat | None = None) -> list[arb]:
    """Return an enclosure of the only zero of a function in the box of a radius around a centre.

    Newton's operator is shown to map the box into itself. `jacobian` encloses the derivative over the box. Without it
    the function must be analytic.
    """
    if jacobian is None:
        jacobian = analytic_jacobian(function, centre, radius)
    step = jacobian.solve(column(function(centre))).entries()
    inside = all(abs(dx) < radius for dx in step)
    require(inside, "Newton's operator does not map the box into itself: no solution is shown to exist in it")
    return [x - dx for x, dx in zip(centre, step, strict=True)]
