"""Chatter, sticking and release in multi-precision arithmetic, sharing nothing with the core.

On top of the event simulator in the arithmetic of a C library (`swift_oracle`, Taylor series of the matrices
themselves): bounces are followed one by one down to speeds of 1e-25, where what is still to come of a complete chatter
is the tail of a geometric series; masses 2 .. N behind a resting mass 1 go on by the Taylor series of their own
equations; and the force that would move mass 1 is watched until it falls through zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from flint import arb, arb_poly
from oracles import digits
from swift_oracle import SwiftOracle

SLOWEST = 1e-25
"""Speed, relative to omega * clearance, at which bounces are no longer followed one by one."""


@dataclass
class StickingOracle(SwiftOracle):
    """The event simulator, with mass 1 coming to rest on a stop and leaving it.

    `rests` are the times at which it comes to rest (bounces accumulate there), `releases` those at which it leaves,
    `held_on` the stops.
    """

    digits: int = 50
    rests: list[arb] = field(default_factory=list)
    releases: list[arb] = field(default_factory=list)
    held_on: list[int] = field(default_factory=list)

    def run_to_releases(self, count: int, until: float = np.inf) -> None:
        """Go on until mass 1 has been released so many times in all, or the time is past `until`."""
        with digits(self.digits):
            resting = 0
            if abs(self._x[0]) == arb(self.clearance) and self._v[0] == 0:
                resting = 1 if self._x[0] > 0 else -1
                self._left = resting
                if self._pressing(resting)[0] > 0:
                    self.rests.append(self._t)
                    self.held_on.append(resting)
                    self._rest_until_released(resting, until)
            while len(self.releases) < count and self._t < until:
                series = self._series()
                stop, at = self._first_contact(series[0])
                longest = self._longest_step()
                if at is None or at > longest:
                    stop, at = 0, longest
                self._advance(series, at)
                self._left = stop
                if stop:
                    self._strike(stop)
                    self._maybe_rest(stop, until)

    def _longest_step(self) -> arb:
        """How far to go at once, at most."""
        return self._step

    def state(self) -> tuple[list[arb], list[arb], arb]:
        """Displacements, velocities and time where the run stands."""
        return self._x, self._v, self._t

    def _advance(self, series: list[list[arb]], h: arb) -> None:
        polynomials = [arb_poly(c) for c in series]
        self._x = [p(h).mid() for p in polynomials]
        self._v = [p.derivative()(h).mid() for p in polynomials]
        self._t = (self._t + h).mid()

    def _first_contact(self, x: list[arb]) -> tuple[int, Any]:
        # a bounce far shorter than the step: the near root of the gap with its zeros at 0 divided out
        stop = self._left
        if stop:
            gap = [-stop * c for c in x]
            rate, bend = gap[1], gap[2]
            if rate > 0 and bend < 0 and -rate / bend < self._longest_step() / 200:
                rest = arb_poly(gap[1:])
                slope = rest.derivative()
                t = (-rate / bend).mid()
                for _ in range(60):
                    t, before = (t - rest(t) / slope(t)).mid(), t
                    if abs(t - before) <= arb(10) ** (-self.digits) * t:
                        return stop, t
                raise AssertionError("the oracle's bounce did not converge")
            leading = next(k for k in range(1, len(gap)) if abs(gap[k]) > arb(10) ** (8 - self.digits))
            if leading > 1:
                # left from rest: x and v of the stop exactly, and after a release its acceleration too
                return self._behind_rest(x, gap[leading:], stop)
        return super()._first_contact(x)

    def _behind_rest(self, x: list[arb], gap: list[arb], stop: int) -> tuple[int, Any]:
        here = self._first_root(gap)
        other = [stop * c for c in x]
        other[0] = other[0] + arb(self.clearance)
        there = self._first_root(other)
        found = [(at, which) for at, which in ((here, stop), (there, -stop)) if at is not None]
        return (min(found)[1], min(found)[0]) if found else (0, None)

    def _maybe_rest(self, stop: int, until: float) -> None:
        leaving = abs(self._v[0])
        if leaving > SLOWEST * arb(self.omega) * arb(self.clearance):
            return
        pressing = self._pressing(stop)[0]
        if pressing <= 0:
            return
        # bounces to come: 2 leaving/a, then R times as much, and so on; what is left out is of the order of 1e-50
        tail = 2 * leaving / (pressing * (1 - arb(self.restitution)))
        self._v[0] = arb(0)
        self.rests.append((self._t + tail).mid())
        self.held_on.append(stop)
        self._rest_until_released(stop, until)

    def _held_series(self, stop: int) -> list[list[arb]]:
        """Taylor coefficients of every displacement while mass 1 stays where it is."""
        n, w = len(self.masses), arb(self.omega)
        place = stop * arb(self.clearance)
        x = [[place, arb(0)]] + [[self._x[i], self._v[i]] for i in range(1, n)]
        angle = w * self._t + arb(self.phase)
        cycle = [angle.sin().mid(), angle.cos().mid(), -angle.sin().mid(), -angle.cos().mid()]
        power = arb(1)
        for k in range(39):
            drive = cycle[k % 4] * power
            x[0].append(arb(0))
            added = []
            for i in range(1, n):
                force = arb(self.forcing[i]) * drive
                for link, j in ((i - 1, i - 1), (i, i + 1)):
                    stretch = x[i][k] - (x[j][k] if j < n else 0)
                    rate = x[i][k + 1] - (x[j][k + 1] if j < n else 0)
                    force -= arb(self.stiffnesses[link]) * stretch + arb(self.links[link]) * (k + 1) * rate
                added.append((force / (arb(self.masses[i]) * ((k + 1) * (k + 2)))).mid())
            for i in range(1, n):
                x[i].append(added[i - 1])
            power = power * w / (k + 1)
        return x

    def _pressing(self, stop: int) -> list[arb]:
        """Taylor coefficients of the force on the resting mass 1, toward the stop."""
        x = self._held_series(stop)
        n, w = len(self.masses), arb(self.omega)
        angle = w * self._t + arb(self.phase)
        cycle = [angle.sin().mid(), angle.cos().mid(), -angle.sin().mid(), -angle.cos().mid()]
        power = arb(1)
        coefficients = []
        for k in range(39):
            stretch = x[0][k] - (x[1][k] if n > 1 else 0)
            rate = (x[0][k + 1] - (x[1][k + 1] if n > 1 else 0)) * (k + 1)
            force = arb(self.forcing[0]) * cycle[k % 4] * power
            force -= arb(self.stiffnesses[0]) * stretch + arb(self.links[0]) * rate
            coefficients.append((stop * force / arb(self.masses[0])).mid())
            power = power * w / (k + 1)
        return coefficients

    def _rest_until_released(self, stop: int, until: float) -> None:
        while self._t < until:
            series, pressing = self._held_series(stop), self._pressing(stop)
            at, longest = self._first_root(pressing), self._longest_step()
            released = at is not None and at <= longest
            self._advance(series, at if released else longest)
            if released:
                self.releases.append(self._t)
                self._left = stop
                return
