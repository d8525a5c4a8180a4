"""One block's flow against 40-digit arithmetic, in every regime of damping."""

from __future__ import annotations

import math
from typing import NamedTuple

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grazemap_core.model.kernels.block_flow import advance_columns, advance_state, block_flow

RATIOS = [0.0, 1e-9, 1e-3, 0.5, 1 - 1e-3, 1 - 1e-9, 1 - 1e-15, 1.0, 1 + 1e-15, 1 + 1e-9, 1 + 1e-3, 2.0, 30.0, 1e4]


def exact_flow(decay, frequency_squared, time):
    with mpmath.workdps(60):
        eta, square, t = mpmath.mpf(decay), mpmath.mpf(frequency_squared), mpmath.mpf(time)
        root = mpmath.sqrt(mpmath.mpc(square - eta**2))
        envelope = mpmath.exp(-eta * t)
        cosine = envelope * mpmath.cos(root * t)
        sine = envelope * (mpmath.sin(root * t) / root if root != 0 else t)
        return [
            [mpmath.re(cosine + eta * sine), mpmath.re(sine)],
            [mpmath.re(-square * sine), mpmath.re(cosine - eta * sine)],
        ]


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("frequency", [1.0, 3e-5, 7e4])
def test_entries_are_right_to_a_few_units_in_the_last_place(ratio, frequency):
    decay, square = ratio * frequency, frequency * frequency
    with mpmath.workdps(60):
        discriminant = float(mpmath.mpf(square) - mpmath.mpf(decay) ** 2)
    worst = 0.0
    for time in np.geomspace(1e-6, 40.0, 37) / frequency:
        ours = np.reshape(block_flow(decay, discriminant, square, time), (2, 2))
        exact = exact_flow(decay, square, time)
        # the exponent's own rounding, eta t or slow t, and the phase's, wd t, are inherent
        root = math.sqrt(abs(discriminant))
        rate = square / (decay + root) if discriminant < 0 else decay + root
        inherent = 1.0 + rate * time
        scale = max(abs(float(exact[0][0])), abs(float(exact[0][1])) * frequency, abs(float(exact[1][1])))
        for i, j, unit in ((0, 0, 1.0), (0, 1, frequency), (1, 0, 1 / frequency), (1, 1, 1.0)):
            with mpmath.workdps(60):
                error = abs(float(exact[i][j] - mpmath.mpf(ours[i, j]))) * unit
            worst = max(worst, error / (scale * inherent))
    assert worst < 4 * 2.3e-16


def test_a_strongly_overdamped_block_keeps_its_small_entries():
    decay, square, time = 1e6, 1.0, 3e5
    with mpmath.workdps(60):
        discriminant = float(mpmath.mpf(square) - mpmath.mpf(decay) ** 2)
    ours = np.reshape(block_flow(decay, discriminant, square, time), (2, 2))
    exact = exact_flow(decay, square, time)
    for i in range(2):
        for j in range(2):
            assert ours[i, j] == pytest.approx(float(exact[i][j]), rel=1e-15)


@given(ratio=st.floats(0.0, 5.0), first=st.floats(0.0, 20.0), second=st.floats(0.0, 20.0))
def test_the_flow_is_a_semigroup_and_never_gains_energy(ratio, first, second):
    def flow(time):
        return np.reshape(block_flow(ratio, (1 - ratio) * (1 + ratio), 1.0, time), (2, 2))

    assert np.allclose(flow(first) @ flow(second), flow(first + second), rtol=0, atol=2e-14)
    assert np.linalg.norm(flow(first), 2) <= 1 + 1e-14


class Three(NamedTuple):
    """An underdamped block, a critical one and an overdamped one."""

    decay: np.ndarray
    discriminant: np.ndarray
    frequency_squared: np.ndarray


def test_states_and_columns_are_advanced_by_the_flow_of_their_blocks():
    decay, square, time = np.array([0.1, 1.0, 3.0]), np.array([4.0, 1.0, 2.0]), 0.7
    blocks = Three(decay, square - decay**2, square)
    flow = np.zeros((6, 6))
    for j in range(3):
        flow[2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = np.array(exact_flow(decay[j], square[j], time), dtype=np.float64)
    columns, state = np.eye(6), np.array([[1.0, 2.0], [-3.0, 0.5], [0.25, -1.0]])
    moved = flow @ state.ravel()
    advance_columns(blocks, columns, time)
    advance_state(blocks, state, time)
    assert columns == pytest.approx(flow, rel=1e-14, abs=1e-16)
    assert state.ravel() == pytest.approx(moved, rel=1e-14)
