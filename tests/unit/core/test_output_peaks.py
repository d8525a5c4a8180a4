"""The largest value of an output in a panel, for any series, and for numbers that are none."""

from __future__ import annotations

import math

import numpy as np
import pytest

from grazemap_core.simulation.kernels.output_rows import _raise_peak
from grazemap_core.simulation.tolerances import PANEL_DEGREE, PEAK_ACCURACY, PEAK_DEPTH


def scratch():
    return np.full((PEAK_DEPTH, 6), np.nan)


def largest(series) -> float:
    """From the zeros of the derivative."""
    polynomial = np.polynomial.Polynomial(series)
    zeros = polynomial.deriv().roots()
    inside = zeros.real[(np.abs(zeros.imag) < 1e-3) & (zeros.real > 0.0) & (zeros.real < 1.0)]
    return float(np.max(polynomial(np.concatenate([[0.0, 1.0], inside]))))


@pytest.mark.parametrize("kind", ["normal", "highest degree", "cancelling", "flat", "parabola"])
def test_the_peak_of_a_series_is_its_largest_value(kind: str) -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        series = rng.normal(size=PANEL_DEGREE + 1)
        if kind == "highest degree":
            series[: PANEL_DEGREE - 1] *= 1e-3
        elif kind == "cancelling":  # sum of (t - a)^2k, flat about a: many intervals wait
            series = np.polynomial.polynomial.polypow([-rng.uniform(0.2, 0.8), 1.0], PANEL_DEGREE) * -1.0
        elif kind == "flat":
            series[1:] *= 1e-12
        elif kind == "parabola":  # halved most often about its top
            place = rng.uniform()
            series = np.pad([-place * place, 2.0 * place, -1.0], (0, PANEL_DEGREE - 2))
        for sign in (1.0, -1.0):
            waiting = scratch()
            peak = _raise_peak(series, sign, -math.inf, waiting)
            assert np.isnan(waiting[28:]).all()  # as is proved there
            assert peak == pytest.approx(largest(sign * series), abs=4.0 * PEAK_ACCURACY * np.sum(np.abs(series)))
    assert _raise_peak(series, 1.0, 1e9, scratch()) == 1e9


@pytest.mark.timeout(60)
@pytest.mark.parametrize("number", [math.nan, math.inf, 1e306])
def test_the_peak_of_a_series_that_is_not_finite_or_overflows_is_not_a_number(number: float) -> None:
    series = np.zeros(PANEL_DEGREE + 1)
    series[5:] = number
    assert math.isnan(_raise_peak(series, 1.0, 0.0, scratch()))
    assert math.isnan(_raise_peak(np.zeros(PANEL_DEGREE + 1), 1.0, math.nan, scratch()))
