"""Fifty-digit answers to compare with, made from M, C and K alone.

Everything here starts from the matrices of equation (3), written down below once more, and goes through ball arithmetic
(python-flint): what comes out carries its own error bound. Nothing is imported from the core.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from flint import acb, acb_mat, arb, arb_mat, ctx

DIGITS = 50


@contextmanager
def digits(count: int = DIGITS) -> Iterator[None]:
    """Work with this many digits, plus guard digits, inside the block."""
    before = ctx.dps
    ctx.dps = count + 10
    try:
        yield
    finally:
        ctx.dps = before


@dataclass(frozen=True)
class Chain:
    """The chain's numbers as given: exact doubles."""

    masses: Sequence[float]
    stiffnesses: Sequence[float]
    link_damping: Sequence[float | arb]
    forcing: Sequence[float]

    @classmethod
    def proportional(
        cls, masses: Sequence[float], stiffnesses: Sequence[float], gamma: float, forcing: Sequence[float]
    ) -> Chain:
        """C = 2 gamma K, with the products of doubles exact."""
        with digits():
            links = [2 * arb(gamma) * arb(k) for k in stiffnesses]
        return cls(masses, stiffnesses, links, forcing)

    @property
    def size(self) -> int:
        return len(self.masses)


def tridiagonal(links: Sequence[float | arb]) -> list[list[arb]]:
    """K, or C, of a chain whose link i joins mass i and i + 1, the last one to ground."""
    count = len(links)
    matrix = [[arb(0)] * count for _ in range(count)]
    for i, link in enumerate(links):
        matrix[i][i] = matrix[i][i] + arb(link)
        if i + 1 < count:
            matrix[i + 1][i + 1] = matrix[i + 1][i + 1] + arb(link)
            matrix[i][i + 1] = matrix[i + 1][i] = -arb(link)
    return matrix


def steady_amplitude(chain: Chain, omega: float) -> acb:
    """First entry of ``(K - omega^2 M + i omega C)^{-1} f``."""
    with digits():
        stiffness, damping = tridiagonal(chain.stiffnesses), tridiagonal(chain.link_damping)
        w = arb(omega)
        count = chain.size
        matrix = acb_mat(
            [
                [
                    acb(stiffness[i][j] - (w * w * arb(chain.masses[i]) if i == j else 0), w * damping[i][j])
                    for j in range(count)
                ]
                for i in range(count)
            ]
        )
        return matrix.solve(acb_mat([[acb(f)] for f in chain.forcing]))[0, 0]


def first_order_matrix(chain: Chain) -> arb_mat:
    """A of ``(x, v)' = A (x, v)``, shape (2N, 2N)."""
    stiffness, damping = (
        arb_mat([[x / arb(m) for x in row] for m, row in zip(chain.masses, tridiagonal(links), strict=True)])
        for links in (chain.stiffnesses, chain.link_damping)
    )
    return first_order_of(stiffness, damping)


def first_order_of(stiffness: arb_mat, damping: arb_mat) -> arb_mat:
    """A of ``(x, v)' = A (x, v)``, of the matrices over the mass."""
    count = stiffness.nrows()
    rows = [[arb(int(j == count + i)) for j in range(2 * count)] for i in range(count)]
    rows += [[-part[i, j] for part in (stiffness, damping) for j in range(count)] for i in range(count)]
    return arb_mat(rows)


def flow(chain: Chain, time: float | arb, precision: int = DIGITS) -> arb_mat:
    """``exp(A time)``; more digits for chains whose rates lie far apart."""
    with digits(precision):
        return (first_order_matrix(chain) * arb(time)).exp()


def impulse(chain: Chain, time: float | arb) -> arb:
    """g(time), the displacement of mass 1 after a unit velocity of mass 1."""
    return flow(chain, time)[0, chain.size]


@dataclass(frozen=True)
class Residues:
    """``g(s) = sum_j residue_j exp(exponent_j s)``; exponents must be distinct."""

    exponents: list[acb]
    residues: list[acb]

    @classmethod
    def of(cls, chain: Chain) -> Residues:
        with digits():
            matrix = acb_mat(first_order_matrix(chain))
            exponents, right = matrix.eig(right=True)
            left = right.inv()
            count = chain.size
            return cls(list(exponents), [right[0, j] * left[j, count] for j in range(2 * count)])

    def value(self, kind: str, tau: arb, derivative: int = 0) -> arb:
        """g, h or h_s ("impulse", "same", "alternating") or a derivative of it, on a ball tau."""
        total = acb(0)
        for exponent, residue in zip(self.exponents, self.residues, strict=True):
            z = (exponent * tau).exp()
            if kind == "impulse":
                term = z
            else:
                sign = 1 if kind == "same" else -1
                base = 1 - sign * z
                # sums of k^derivative (sign z)^k
                term = [z / base, z / (base * base), z * (1 + sign * z) / (base * base * base)][derivative] * sign
            total += residue * exponent**derivative * term
        return total.real


def isolate(function: Callable[[arb, int], arb], start: arb, stop: arb, accuracy: float = 1e-40) -> list[arb]:
    """All zeros on [start, stop], by bisection in ball arithmetic: certain, or an error.

    An interval without a zero is recognised by the ball of its mean-value form, one with a single zero by a derivative
    ball without zero and opposite signs at the ends.
    """
    zeros: list[arb] = []
    stack = [(start, stop)]
    while stack:
        left, right = stack.pop()
        middle = ((left + right) / 2).mid()
        whole = left.union(right)
        offset = whole - middle
        slope = function(whole, 1)
        if not slope.contains(0):
            left_value, right_value = function(left, 0), function(right, 0)
            if left_value.contains(0) or right_value.contains(0):
                raise ArithmeticError("a zero at an end of a cell: shift the interval")
            if (left_value > 0) != (right_value > 0):
                zeros.append(_refine(function, left, right, left_value > 0, accuracy))
            continue
        if not function(middle, 0).__add__(slope * offset).contains(0):
            continue
        if (right - left) < 1e-20:
            raise ArithmeticError("a double zero, or too few digits")
        stack += [(middle, right), (left, middle)]
    return zeros


def _refine(function: Callable[[arb, int], arb], left: arb, right: arb, rising_from: bool, accuracy: float) -> arb:
    """Newton's method inside the bracket, then a certificate: signs differ `accuracy` to either side."""
    low, high = left, right
    point = ((low + high) / 2).mid()
    for _ in range(200):
        value, slope = function(point, 0), function(point, 1)
        if (value > 0) == rising_from and not value.contains(0):
            low = point
        elif not value.contains(0):
            high = point
        following = (point - value / slope).mid()
        if not (following > low and following < high):
            following = ((low + high) / 2).mid()
        if abs(following - point) < accuracy / 100:
            point = following
            break
        point = following
    before, after = function(point - accuracy, 0), function(point + accuracy, 0)
    if before.contains(0) or after.contains(0) or (before > 0) == (after > 0):
        raise ArithmeticError("a zero could not be certified")
    return arb(point, accuracy)


def zeros_of(chain: Chain, kind: str, start: float, stop: float) -> list[arb]:
    """All zeros of g, h or h_s on [start, stop], increasing, in cells short against every oscillation to start with."""
    with digits():
        residues = Residues.of(chain)
        cells = max(1, int((stop - start) / 2.0))
        places = [arb(start) + (arb(stop) - arb(start)) * i / cells for i in range(cells + 1)]
        zeros: list[arb] = []
        for left, right in itertools.pairwise(places):
            zeros += isolate(lambda tau, order: residues.value(kind, tau, order), left.mid(), right.mid())
        return sorted(zeros, key=lambda zero: float(zero.mid()))


def secant(function: Callable[[arb], arb], start: float) -> arb:
    """A zero near a start, to 40 digits."""
    before, here = arb(start), arb(start) + arb(1e-7)
    at_before, at_here = function(before), function(here)
    for _ in range(60):
        following = (here - at_here * (here - before) / (at_here - at_before)).mid()
        before, at_before = here, at_here
        here, at_here = following, function(following)
        if abs(here - before) < 1e-36:
            return here
    raise ArithmeticError("the secant method does not converge")


def polynomial(places: list[arb], values: list[arb]) -> list[arb]:
    """Coefficients, constant first, of the polynomial through the points."""
    size = len(places)
    rows = arb_mat([[place**power for power in range(size)] for place in places])
    solved = rows.solve(arb_mat([[value] for value in values]))
    return [solved[i, 0] for i in range(size)]
