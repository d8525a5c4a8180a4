"""Samples of a trajectory in closed form, each from the last event before it: no sample inherits another's error."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from grazemap_core.kernels.cells import CellProblem, flow_state
from grazemap_core.kernels.held import HeldProblem, flow_held, held_motion, turned
from grazemap_core.kernels.workspace import EVENT_COLUMNS, GRAZE, HALF, IMPACT, KIND, RELEASE, STOP, TIME

FloatArray = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def sample_motion(
    problem: CellProblem,
    held_problem: HeldProblem,
    shape: FloatArray,
    steady: NDArray[np.complex128],
    rows: FloatArray,
    clearance: float,
    index: NDArray[np.int64],
    samples_per_period: int,
    first_half: int,
) -> tuple[FloatArray, FloatArray]:
    """Return displacement and velocity of all masses, each (N, n), at given sample numbers.

    Parameters
    ----------
    shape : (N, N, 2)
        Of the modal model.
    steady : complex (N,)
        Steady response of every mass, the initial phase included.
    rows : (events, EVENT_COLUMNS + 2 N)
        Where the record begins, then every event, with the states behind them; increasing in time. Behind an event of
        a kind other than IMPACT, GRAZE and RELEASE mass 1 is at rest, or on its last bounces, which count as rest.
    clearance : float
    index : (n,)
        Sample numbers, increasing; sample i is i / samples_per_period forcing periods after the record begins.
    samples_per_period, first_half : int
        The half period in which the record begins is `first_half`.
    """
    count = shape.shape[0]
    half_time = math.pi / problem.omega
    x = np.empty((count, index.shape[0]))
    v = np.empty((count, index.shape[0]))
    u = np.empty((count, 2))
    held = np.empty((count - 1, 2))
    physical = np.empty(2 * count)
    row = 0
    for n in range(index.shape[0]):
        within = index[n] % samples_per_period  # of its forcing period
        half = first_half + 2 * (index[n] // samples_per_period)
        time = 2.0 * half_time * within / samples_per_period
        while row + 1 < rows.shape[0] and (rows[row + 1, HALF] - half) * half_time + rows[row + 1, TIME] <= time:
            row += 1
        passed = (half - rows[row, HALF]) * half_time + (time - rows[row, TIME])
        angle = 2.0 * math.pi * within / samples_per_period
        c, s = math.cos(angle), math.sin(angle)
        if rows[row, KIND] != IMPACT and rows[row, KIND] != RELEASE and rows[row, KIND] != GRAZE:
            for j in range(count - 1):
                held[j, 0] = rows[row, EVENT_COLUMNS + 2 * j]
                held[j, 1] = rows[row, EVENT_COLUMNS + 2 * j + 1]
            flow_held(held_problem, held, passed)
            cosine, sine = turned(held_problem.turn, 0, angle)
            held_motion(held_problem, held, rows[row, STOP] * clearance, problem.omega, cosine, sine, physical)
            for i in range(count):
                x[i, n] = physical[i]
                v[i, n] = physical[count + i]
            continue
        for j in range(count):
            u[j, 0] = rows[row, EVENT_COLUMNS + 2 * j]
            u[j, 1] = rows[row, EVENT_COLUMNS + 2 * j + 1]
        flow_state(problem, u, passed)
        for i in range(count):
            x[i, n] = steady[i].imag * c + steady[i].real * s
            v[i, n] = problem.omega * (steady[i].real * c - steady[i].imag * s)
            for j in range(count):
                a, b = shape[i, j, 0], shape[i, j, 1]
                second = -problem.frequency_squared[j] * u[j, 0] - 2.0 * problem.decay[j] * u[j, 1]
                x[i, n] += a * u[j, 0] + b * u[j, 1]
                v[i, n] += a * u[j, 1] + b * second
    return x, v
