"""Arithmetic with sums of two doubles against exact fractions, in kernels and on arrays."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from flint import arb

from grazemap_core.arrays import Floats
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.kernels.double_double import TWO_PI, Pair, add, divide, exact, multiply, scale, transformed
from tests.oracles.fifty_digits import digits

ACCURACY = Fraction(1, 2**102)
COUNT = 2000


@kernel
def compute(a: Floats, b: Floats, out: Floats) -> None:
    for i in range(a.shape[0]):
        first, second = Pair(a[i, 0], a[i, 1]), Pair(b[i, 0], b[i, 1])
        out[i, 0], out[i, 1] = add(first, second)
        out[i, 2], out[i, 3] = scale(first, second.high)
        out[i, 4], out[i, 5] = multiply(first, second)
        out[i, 6], out[i, 7] = divide(first, second)


def pairs() -> tuple[Pair[Floats], Pair[Floats]]:
    """Return random pairs; in a quarter of the cases their sums cancel to any degree."""
    random = np.random.default_rng(1)
    high = random.normal(size=(2, COUNT)) * 10.0 ** random.integers(-20, 20, (2, COUNT))
    high[1, ::4] = -high[0, ::4] * (1.0 + random.choice([0.0, 1e-16, 1e-12, 1e-4], COUNT // 4))
    low = high * random.uniform(-0.5, 0.5, (2, COUNT)) * 2.0**-53
    return Pair(high[0], low[0]), Pair(high[1], low[1])


def fractions(pair: Pair[Floats]) -> list[Fraction]:
    return [Fraction(high) + Fraction(low) for high, low in zip(pair.high.tolist(), pair.low.tolist(), strict=True)]


def test_sums_products_and_quotients_have_thirty_digits() -> None:
    a, b = pairs()
    x, y = fractions(a), fractions(b)
    for ours, theirs, sizes in (
        (
            add(a, b),
            [p + q for p, q in zip(x, y, strict=True)],
            [max(abs(p), abs(q)) for p, q in zip(x, y, strict=True)],
        ),
        (scale(a, b.high), [p * Fraction(q) for p, q in zip(x, b.high.tolist(), strict=True)], None),
        (multiply(a, b), [p * q for p, q in zip(x, y, strict=True)], None),
        (divide(a, b), [p / q for p, q in zip(x, y, strict=True)], None),
    ):
        for value, right, size in zip(fractions(ours), theirs, sizes or theirs, strict=True):
            assert abs(value - right) <= ACCURACY * abs(size)
        assert np.array_equal(ours.high, ours.high + ours.low)


def test_kernels_and_arrays_give_the_same_bytes() -> None:
    a, b = pairs()
    out = np.empty((COUNT, 8))
    compute(np.column_stack(a), np.column_stack(b), out)
    results = (add(a, b), scale(a, b.high), multiply(a, b), divide(a, b))
    assert out.tobytes() == np.column_stack([part for pair in results for part in pair]).tobytes()


def test_a_matrix_times_vectors_is_rounded_once() -> None:
    random = np.random.default_rng(2)
    matrix, vectors = random.normal(size=(3, 5)), random.normal(size=(5, 2))
    matrix[:, 4] = -(matrix[:, :4] @ vectors[:4, 0]) / vectors[4, 0]  # the first column cancels
    ours = transformed(matrix, exact(vectors)).rounded
    for i, j in np.ndindex(ours.shape):
        right = sum(Fraction(p) * Fraction(q) for p, q in zip(matrix[i].tolist(), vectors[:, j].tolist(), strict=True))
        assert ours[i, j] == pytest.approx(float(right), rel=2.0**-53, abs=1e-30)


def test_two_pi_is_right_to_its_last_digit() -> None:
    with digits():
        assert abs(2 * arb.pi() - arb(TWO_PI.high) - arb(TWO_PI.low)) < arb(2) ** -105
