"""Trajectories with many digits: the impacts of the motion from an exact initial state.

Impacts are found on Taylor series in double precision and solved for in many digits. The checker shows that none is
missed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx
from numpy.polynomial.polynomial import polyval

from grazemap.checker.arithmetic import column
from grazemap.checker.system import System
from grazemap_core.arrays import Floats
from grazemap_core.proofs.certificates import Undecided
from grazemap_core.proofs.tolerances import (
    BISECTIONS,
    IMPACT_BITS,
    IMPACT_STEPS,
    SERIES_SAMPLES,
    SERIES_STEP,
    TAYLOR_TERMS,
)
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.tolerances import SHORTEST_FLIGHT

SAMPLE_TIMES = np.linspace(0.0, 1.0, SERIES_SAMPLES)
POWERS = np.vander(SAMPLE_TIMES, TAYLOR_TERMS, increasing=True)


class ProvenImpact(NamedTuple):
    """An impact."""

    stop: int
    """Stop of the impact."""
    time: arb
    """Time of the impact."""
    velocity: arb
    """Velocity before the impact."""
    after: arb_mat
    """State after the impact."""


class Simulation:
    """A trajectory that is followed from impact to impact, in the middles of balls."""

    def __init__(self, system: System, state: arb_mat, time: arb, bits: int):
        """Take the state at a time, both exact up to the precision."""
        self.system, self.bits = system, bits
        self.impacts: list[ProvenImpact] = []
        self.state, self.time, self.left = state, time, 0
        with ctx.workprec(bits):
            self.length = (SERIES_STEP / max(system.scale, system.omega.mid() * max(system.orders, default=1))).mid()
            self.stride = system.flow(self.length)

    def run(self, until: float) -> None:
        """Go on until a time."""
        with ctx.workprec(self.bits):
            while float(self.time) < until:
                derivatives = self._derivatives()
                contact = self._contact(derivatives)
                if contact is None:
                    self.state, self.time, self.left = (self.stride * self.state).mid(), self.time + self.length, 0
                    self.time = self.time.mid()
                else:
                    self._strike(*contact)

    def state_at(self, time: arb) -> Any:
        """Return displacements and velocities at a time that is past, after the first impact."""
        last = [impact for impact in self.impacts if impact.time < time][-1]
        state = self.system.flow(time - last.time) * last.after
        return column(state.entries()[: self.system.size])

    def _derivatives(self) -> Floats:
        """Return the Taylor coefficients of the contact coordinate in units of the step."""
        coefficients, state, factor = [], self.state, arb(1)
        for m in range(TAYLOR_TERMS):
            coefficients.append(float((self.system.rows * state)[0, 0] * factor))
            state, factor = (self.system.matrix * state).mid(), (factor * self.length / (m + 1)).mid()
        return np.array(coefficients)

    def _contact(self, coefficients: Floats) -> tuple[int, float] | None:
        """Return the stop and the time, in units of the step, of the first contact in the step."""
        first: tuple[int, float] | None = None
        for stop, gap in self.system.gaps.items():
            if gap is None:
                continue
            series = -stop * coefficients
            series[0] += float(gap)
            series = series[1:] if stop == self.left else series  # on the stop: the root at 0 is divided out
            bracket = _first_bracket(series)
            if bracket is not None:
                where = _root(series, *bracket)
                first = (stop, where) if first is None or where < first[1] else first
        return first

    def _strike(self, stop: int, where: float) -> None:
        """Solve for the time of a contact, and go to the state after it."""
        system, gap = self.system, stop * self.system.gap(stop)
        taken = (self.length * where).mid()
        for _ in range(IMPACT_STEPS):
            state = (system.flow(taken) * self.state).mid()
            speed = (system.rows * state)[1, 0]
            if speed == 0:
                raise Undecided("rests")
            step = (((system.rows * state)[0, 0] - gap) / speed).mid()
            taken = (taken - step).mid()
            if abs(step) < self.length * arb(2) ** (IMPACT_BITS - self.bits):
                break
        else:
            raise Undecided("an impact of the transient is too close to a graze")
        state = (system.flow(taken) * self.state).mid()
        speed = (system.rows * state)[1, 0].mid()
        after, _ = system.strike(state, stop)
        self.time = (self.time + taken).mid()
        if self.impacts and self.time - self.impacts[-1].time < SHORTEST_FLIGHT * system.turn:
            raise Undecided("rests")
        self.state, self.left = after.mid(), stop
        self.impacts.append(ProvenImpact(stop, self.time, speed, self.state))


def _first_bracket(series: Floats) -> tuple[float, float] | None:
    """Return two places in the step, the first at which a series is positive and then negative, minima included."""
    values, slope = POWERS[:, : len(series)] @ series, series[1:] * np.arange(1, len(series))
    slopes = POWERS[:, : len(slope)] @ slope
    beyond = np.flatnonzero(values < 0.0)
    last = int(beyond[0]) if len(beyond) else len(SAMPLE_TIMES)
    for k in np.flatnonzero((slopes[:-1] < 0.0) & (slopes[1:] >= 0.0))[:last]:
        low, high = float(SAMPLE_TIMES[k]), float(SAMPLE_TIMES[k + 1])
        lowest = _root(-slope, low, high)
        if k < last and polyval(lowest, series) < 0.0:
            return low, lowest
    return (float(SAMPLE_TIMES[max(last - 1, 0)]), float(SAMPLE_TIMES[last])) if len(beyond) else None


def _root(series: Floats, low: float, high: float) -> float:
    """Return where a series passes from positive to negative, by bisection."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if polyval(middle, series) < 0.0 else (middle, high)
    return high
