"""Multipliers of orbits as eigenvalues of pencils."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg

from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.errors import ConditioningError
from grazemap_core.orbits import states
from tests.support.general_systems import with_orbit


def pencil() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(5)
    return random.normal(size=(7, 7)), np.diag([1.0] * 5 + [0.0] * 2)


def test_an_iteration_that_fails_is_done_on_the_transpose(monkeypatch: pytest.MonkeyPatch) -> None:
    left, right = pencil()
    tried = []

    def failing(matrix: np.ndarray, other: np.ndarray, **options: Any) -> Any:
        result = scipy.linalg.lapack.dggev(matrix, other, **options)
        if options["lwork"] == -1:
            return result
        tried.append(np.array_equal(matrix, left.T))
        return result if tried[-1] else (*result[:-1], len(matrix))

    monkeypatch.setattr(states, "dggev", failing)
    above, below = states._eigenvalues(left, right)
    assert tried == [False, True]
    finite = np.abs(below) > 1e-9 * np.abs(above)
    expected = scipy.linalg.eigvals(left, right)
    expected = expected[np.isfinite(expected)]
    assert np.count_nonzero(finite) == len(expected) == 5
    np.testing.assert_allclose(np.sort_complex(above[finite] / below[finite]), np.sort_complex(expected), rtol=1e-9)


def test_what_cannot_be_computed_is_an_error_that_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    left, right = pencil()
    with pytest.raises(ConditioningError, match="overflow"):
        states._eigenvalues(np.full_like(left, np.inf), right)

    def failing(matrix: np.ndarray, other: np.ndarray, **options: Any) -> Any:
        result = scipy.linalg.lapack.dggev(matrix, other, **options)
        return result if options["lwork"] == -1 else (*result[:-1], 1)

    monkeypatch.setattr(states, "dggev", failing)
    with pytest.raises(ConditioningError, match="does not converge"):
        states._eigenvalues(left, right)


@pytest.mark.parametrize("seed", [7, 11, 55])
def test_the_order_of_multipliers_does_not_depend_on_round_off(seed: int) -> None:
    """Of a complex pair the one with the positive imaginary part is the first, and both have one modulus."""
    system, orbit = with_orbit(seed)
    branch = orbit_branch(system.oscillator, orbit, 0.95, 1.05, "forcing", max_points=8)
    pairs = 0
    for multipliers in branch.multipliers:
        assert np.all(np.diff(np.abs(multipliers)) <= 0.0)
        first = np.flatnonzero(multipliers.imag > 0.0)
        np.testing.assert_array_equal(multipliers[first + 1], np.conj(multipliers[first]))
        assert np.sum(multipliers.imag != 0.0) == 2 * len(first)
        pairs += len(first)
    assert pairs
