"""scipy's solve_ivp among the contestants: DOP853, both stops as terminal events, restarted after every impact."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.work import Floats, Integers, Start, Work
from grazemap_core.model.oscillator import Oscillator


class Scipy:
    """solve_ivp at one relative tolerance; the absolute one is a thousandth of it."""

    def __init__(self, rtol: float = 1e-9) -> None:
        self.rtol = rtol

    @property
    def name(self) -> str:
        """Return the tool with its method and tolerance."""
        return f"scipy solve_ivp DOP853, rtol {self.rtol:g}"

    def prepare(self, work: Work) -> Callable[[], object]:
        """Return what is to be timed."""
        return lambda: self.impacts(work)

    def impacts(self, work: Work) -> Integers:
        """Return the impacts of every lane."""
        return np.array([len(self._lane(work, float(clearance), None)) for clearance in work.clearances])

    def impact_times(self, work: Work, count: int) -> Floats:
        """Return the first impact times of lane 0."""
        return np.array(self._lane(work, float(work.clearances[0]), count))

    def first_contacts(self, oscillator: Oscillator, start: Start, clearances: Floats) -> Floats:
        """Return the time of the first contact within one forcing period, NaN for none."""
        rates = _rates(oscillator, start.omega, start.phase)
        state = np.concatenate([start.displacement, start.velocity])
        times = np.full(len(clearances), np.nan)
        for i, clearance in enumerate(clearances):
            solution = self._solve(rates, 0.0, 2.0 * math.pi / start.omega, state, _stops(float(clearance)))
            if solution.status == 1:
                times[i] = solution.t[-1]
        return times

    def _lane(self, work: Work, clearance: float, count: int | None) -> list[float]:
        """Return the impact times of one trajectory from rest, until its end or a number of impacts."""
        size = work.oscillator.size
        rates = _rates(work.oscillator, work.omega, 0.0)
        stops = _stops(clearance)
        time, end = 0.0, work.periods * 2.0 * math.pi / work.omega
        state = np.zeros(2 * size)
        times: list[float] = []
        while count is None or len(times) < count:
            solution = self._solve(rates, time, end, state, stops)
            if solution.status != 1:
                break
            time = float(solution.t[-1])
            state = solution.y[:, -1]
            state[0] = math.copysign(clearance, state[0])
            state[size] *= -work.oscillator.restitution
            times.append(time)
        return times

    def _solve(self, rates: Any, time: float, end: float, state: Floats, stops: list[Any]) -> Any:
        """Integrate to the next contact or to the end."""
        return solve_ivp(
            rates, (time, end), state, method="DOP853", events=stops, rtol=self.rtol, atol=1e-3 * self.rtol
        )


def _rates(oscillator: Oscillator, omega: float, phase: float) -> Callable[[float, Floats], Floats]:
    """Return the right-hand side of the equations of motion in first-order form."""
    size = oscillator.size
    matrix = np.zeros((2 * size, 2 * size))
    matrix[:size, size:] = np.eye(size)
    matrix[size:, :size] = -oscillator.stiffness_matrix / oscillator.masses[:, None]
    matrix[size:, size:] = -oscillator.damping_matrix / oscillator.masses[:, None]
    force = np.concatenate([np.zeros(size), oscillator.forcing / oscillator.masses])
    return lambda time, state: matrix @ state + force * math.sin(omega * time + phase)


def _stops(clearance: float) -> list[Any]:
    """Return the two contacts as terminal events: the distance to a stop falls through zero."""

    def stop_a(_time: float, state: Floats) -> float:
        return float(clearance - state[0])

    def stop_c(_time: float, state: Floats) -> float:
        return float(clearance + state[0])

    for stop in (stop_a, stop_c):
        stop.terminal = True  # type: ignore[attr-defined]
        stop.direction = -1.0  # type: ignore[attr-defined]
    return [stop_a, stop_c]
