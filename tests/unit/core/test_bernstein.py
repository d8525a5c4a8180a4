"""The root isolation against polynomials whose roots were planted."""

import numpy as np
import pytest
from scipy.special import comb

from grazemap_core.numerics.kernels.bernstein import (
    BECOMES_NEGATIVE,
    GRAZE_UNDECIDED,
    STACK_SHAPE,
    STAYS_POSITIVE,
    first_negative,
    to_bernstein,
)


def isolate(taylor: np.ndarray, error: float = 1e-13, short: int | None = None) -> tuple[int, float]:
    return first_negative(
        taylor,
        len(taylor) - 1,
        short or len(taylor) - 1,
        error,
        np.zeros(STACK_SHAPE),
        np.zeros(STACK_SHAPE[0]),
        np.zeros(STACK_SHAPE[0]),
    )


def planted(roots: list[complex], sign: float = 1.0) -> np.ndarray:
    taylor = np.real(np.polynomial.polynomial.polyfromroots(roots))
    return np.ascontiguousarray(taylor * (sign / np.abs(taylor).sum() * np.sign(taylor[0])))


def test_change_of_basis() -> None:
    rng = np.random.default_rng(0)
    taylor = rng.normal(size=STACK_SHAPE[1])
    n = len(taylor) - 1
    out = np.zeros(n + 1)
    to_bernstein(taylor, n, out)
    for t in (0.0, 0.3, 1.0):
        basis = [comb(n, i) * t**i * (1 - t) ** (n - i) for i in range(n + 1)]
        assert np.dot(basis, out) == pytest.approx(np.polynomial.polynomial.polyval(t, taylor), abs=1e-12)


@pytest.mark.parametrize("seed", range(200))
def test_first_of_several_planted_roots_is_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    inside = np.sort(rng.uniform(0.01, 0.99, rng.integers(1, 4)))
    outside = [*rng.uniform(1.5, 4.0, 2).tolist(), 0.5 + 1.0j, 0.5 - 1.0j]
    if np.min(np.diff(inside), initial=1.0) < 1e-3:
        pytest.skip("roots too close for the planted coefficients themselves")
    taylor = planted([*inside.tolist(), *outside])
    status, t = isolate(taylor)
    assert status == BECOMES_NEGATIVE
    assert t == pytest.approx(inside[0], abs=1e-9)


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12])
def test_two_roots_close_together_are_both_found(depth: float) -> None:
    rng = np.random.default_rng(3)
    for middle in rng.uniform(0.05, 0.95, 100):
        dips = np.array([middle**2 - depth, -2 * middle, 1.0])  # (t - middle)^2 - depth
        status, t = isolate(dips, error=1e-15)
        assert status == BECOMES_NEGATIVE
        assert t == pytest.approx(middle - np.sqrt(depth), abs=1e-8)
        stays = np.array([middle**2 + depth, -2 * middle, 1.0])
        assert isolate(stays, error=1e-15)[0] == STAYS_POSITIVE


def test_a_root_at_the_start_that_is_left_is_no_contact() -> None:
    assert isolate(np.array([1e-17, 0.5, 0.1]))[0] == STAYS_POSITIVE


def test_a_start_on_the_stop_moving_outward_is_an_immediate_contact() -> None:
    status, t = isolate(np.array([1e-17, -0.5, 0.1]))
    assert status == BECOMES_NEGATIVE
    assert t < 1e-12


@pytest.mark.parametrize("seed", range(100))
def test_search_on_the_first_terms_finds_the_same_root_or_reports_that_it_cannot(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = STACK_SHAPE[1]
    taylor = rng.normal(size=size) / np.cumprod(np.maximum(1.0, np.arange(size)))
    taylor[0] = rng.uniform(0.01, 0.5)
    left_out = 1e-13 + np.abs(taylor[10:]).sum()
    status, t = isolate(taylor)
    short_status, short_t = isolate(taylor, error=left_out, short=9)
    if short_status != GRAZE_UNDECIDED:
        assert (short_status, short_t) == (status, pytest.approx(t, abs=1e-12))


def test_search_on_the_first_terms_does_not_clear_a_slow_start() -> None:
    # leaves slowly, dips below zero by less than what the first terms leave out, and comes back
    taylor = np.array([1e-9, -1e-6, 1e-4, 0.0, 0.0])
    assert isolate(taylor, error=1e-15)[0] == BECOMES_NEGATIVE
    assert isolate(taylor, error=1e-7, short=3)[0] == GRAZE_UNDECIDED


def test_first_terms_alone_decide_nothing_where_several_coefficients_are_unsure() -> None:
    # what the first ten terms leave out adds two zeros before the one that they show
    error = 1e-7
    coefficients = np.array([1.01, -0.9, -0.9, -0.9, 0.0, 0.0, 0.9, 0.9, 0.9, -1.01]) * error
    taylor = np.zeros(STACK_SHAPE[1])
    for i, c in enumerate(coefficients):
        for j in range(10 - i):
            taylor[i + j] += c * comb(9, i) * comb(9 - i, j) * (-1) ** j
    taylor[10], taylor[11] = 0.01 * error, 0.98 * error
    roots = np.roots(taylor[::-1])
    first = np.min(roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real)
    assert isolate(taylor, error=np.abs(taylor[10:]).sum(), short=9)[0] == GRAZE_UNDECIDED
    status, t = isolate(taylor, error=1e-16)
    assert (status, t) == (BECOMES_NEGATIVE, pytest.approx(first, abs=1e-9))
