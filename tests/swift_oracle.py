"""The event simulator of `event_oracle` in the arithmetic of a C library: the same method, some twenty times as fast.

For long runs, and for many. Numbers are midpoints of balls of 48 digits, or more if asked for; a given number may
itself be a ball or a multi-precision number instead of a double, so that an input can be changed by less than its own
rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from event_oracle import EventOracle
from flint import arb, arb_mat, arb_poly
from oracles import digits

ROUGH = 80  # terms of a series that count in double precision
FEWEST = 16  # digits of the first steps of Newton's method


@dataclass
class SwiftOracle(EventOracle):
    """Mass 1 of a chain between two stops."""

    @classmethod
    def of(cls, oscillator: Any, omega: float, clearance: float, **start: Any) -> Self:
        """Take over the numbers; with proportional damping C = 2 gamma K without the rounding of these products."""
        run = super().of(oscillator, omega, clearance, **start)
        if oscillator.gamma is not None:
            with digits(run.digits):
                run.links = [2 * arb(oscillator.gamma) * arb(k) for k in run.stiffnesses]
        return run

    def __post_init__(self) -> None:
        super().__post_init__()
        n = len(self.masses)
        with digits(self.digits):
            self._x = [arb(v) for v in (self.displacement or [0.0] * n)]
            self._v = [arb(v) for v in (self.velocity or [0.0] * n)]
            self._t = arb(0)
            self._responses: arb_mat | None = None  # the numbers may be changed until the first step
            self._step = arb(float(self._step))
        self._grid = np.linspace(0.0, float(self._step), self._samples + 1)
        self._powers = self._grid[:, None] ** np.arange(min(self._order + 1, ROUGH))

    def _parts(self) -> arb_mat:
        """The state, and sine and cosine of the forcing's angle, of which every series is a sum."""
        angle = arb(self.omega) * self._t + arb(self.phase)
        if self._responses is None:
            self._responses = self._unit_responses()
            rows, n = self._responses.tolist(), len(self.masses)
            each = [rows[i * (self._order + 1) : (i + 1) * (self._order + 1)] for i in range(n)]
            self._first_response = arb_mat(each[0])
            polynomials = [[arb_poly([row[part] for row in one]) for part in range(2 * n + 2)] for one in each]
            places = [[p(self._step).mid() for p in one] for one in polynomials]
            rates = [[p.derivative()(self._step).mid() for p in one] for one in polynomials]
            self._stride = arb_mat(places + rates)
        return arb_mat([[part] for part in (*self._x, *self._v, angle.sin().mid(), angle.cos().mid())])

    def _series(self) -> list[list[arb]]:
        parts = self._parts()
        every = (self._responses * parts).mid().entries()
        return [every[i * (self._order + 1) : (i + 1) * (self._order + 1)] for i in range(len(self.masses))]

    def _unit_responses(self) -> arb_mat:
        """The series of all displacements, one below the other, from every coordinate and part of the forcing alone.

        The equations are linear: every series is a sum of these columns.
        """
        n = len(self.masses)
        columns = []
        for place in range(2 * n + 2):
            unit = [arb(int(i == place)) for i in range(2 * n + 2)]
            series = self._terms(unit[:n], unit[n : 2 * n], *unit[2 * n :])
            columns.append([c for one in series for c in one])
        return arb_mat(columns).transpose()

    def _terms(self, start: list[arb], rates: list[arb], sine: arb, cosine: arb) -> list[list[arb]]:
        """Taylor coefficients from a state and a phase: the chain's equations term by term."""
        n, w = len(self.masses), arb(self.omega)
        x = [[start[i], rates[i]] for i in range(n)]
        cycle = [sine, cosine, -sine, -cosine]
        power = arb(1)
        k_links, c_links, masses, forcing = (
            [arb(v) for v in values] for values in (self.stiffnesses, self.links, self.masses, self.forcing)
        )
        for k in range(self._order - 1):
            drive = cycle[k % 4] * power
            force = [f * drive for f in forcing]
            for i in range(n):
                stretch, rate = x[i][k], x[i][k + 1]
                if i + 1 < n:
                    stretch, rate = stretch - x[i + 1][k], rate - x[i + 1][k + 1]
                pull = k_links[i] * stretch + c_links[i] * (rate * (k + 1))
                force[i] = force[i] - pull
                if i + 1 < n:
                    force[i + 1] = force[i + 1] + pull
            for i in range(n):
                x[i].append((force[i] / (masses[i] * ((k + 1) * (k + 2)))).mid())
            power = power * w / (k + 1)
        return x

    def run(self, impacts: int, until: float = np.inf) -> None:
        """Go on until so many impacts were seen in all, or the time is past `until`."""
        with digits(self.digits):
            n = len(self.masses)
            while len(self.times) < impacts and self._t < until:
                parts = self._parts()
                stop, at = self._first_contact((self._first_response * parts).mid().entries())
                h = self._step if at is None else at
                if at is None:
                    after = (self._stride * parts).mid().entries()
                    self._x, self._v = after[:n], after[n:]
                else:
                    polynomials = [arb_poly(c) for c in self._series()]
                    self._x = [p(h).mid() for p in polynomials]
                    self._v = [p.derivative()(h).mid() for p in polynomials]
                self._t = (self._t + h).mid()
                self._left = stop
                if stop:
                    self._strike(stop)

    def _strike(self, stop: int) -> None:
        """Record an impact on a stop, here and now, and turn the velocity of mass 1 back."""
        self.times.append(self._t)
        self.stops.append(stop)
        self.speeds.append(self._v[0])
        self._x[0] = stop * arb(self.clearance)
        self._v[0] = (-arb(self.restitution) * self._v[0]).mid()

    def state_at(self, time: float) -> tuple[list[arb], list[arb]]:
        """Displacement and velocity a short time ahead of where the run stands (no contact in between assumed)."""
        with digits(self.digits):
            h = arb(time) - self._t
            polynomials = [arb_poly(c) for c in self._series()]
            return [p(h) for p in polynomials], [p.derivative()(h) for p in polynomials]

    def _first_contact(self, x: list[arb]) -> tuple[int, Any]:
        best: tuple[int, Any] = (0, None)
        for stop in (1, -1):
            gap = [-stop * c for c in x]
            gap[0] = gap[0] + arb(self.clearance)
            root = self._first_root(gap[1:] if stop == self._left else gap)
            if root is not None and (best[1] is None or root < best[1]):
                best = (stop, root)
        return best

    def _first_root(self, gap: list[arb]) -> Any:
        terms = np.array([float(c) for c in gap[:ROUGH]])
        rough = self._powers[:, : len(terms)] @ terms
        near = 1e-3 * (np.abs(rough).max() + 1e-300)
        candidates = np.flatnonzero(~((rough[:-1] > near) & (rough[1:] > near)))
        if len(candidates) == 0:
            return None
        steepness = self._powers[:, : len(terms) - 1] @ (np.arange(1, len(terms)) * terms[1:])
        for i in candidates.tolist():
            low, high = arb(self._grid[i]), arb(self._grid[i + 1])
            if self._at(gap, high) < 0:
                return self._cross(gap, low, high)
            if steepness[i] <= 0.0 <= steepness[i + 1]:
                lowest = self._cross([-k * c for k, c in enumerate(gap)][1:], low, high)
                if self._at(gap, lowest) < 0:
                    return self._cross(gap, low, lowest)
        return None

    @staticmethod
    def _at(series: list[arb], t: arb) -> arb:
        return arb_poly(series)(t).mid()

    def _cross(self, series: list[arb], low: arb, high: arb) -> arb:
        polynomial = arb_poly(series)
        slope = polynomial.derivative()
        t, work = ((low + high) / 2).mid(), min(FEWEST, self.digits)
        for _ in range(400):
            with digits(work):
                value = polynomial(t).mid()
                low, high = (low, t) if value < 0 else (t, high)
                new = (t - value / slope(t)).mid()
                if not (low <= new and new <= high):
                    new = ((low + high) / 2).mid()
                settled = abs(new - t) < arb(10) ** (-work)
            if settled and work == self.digits:
                return new
            if settled:
                low, high = (low - arb(10) ** (1 - work)).mid(), (high + arb(10) ** (1 - work)).mid()
                work = min(2 * work, self.digits)
            t = new
        raise AssertionError("the oracle's root search did not converge")
