"""Chatter, sticking and release in multi-precision arithmetic, sharing nothing with the core.

On top of the event simulator (Taylor series of the matrices themselves): bounces are followed one by one down to
speeds of 1e-25, where what is still to come of a complete chatter is the tail of a geometric series; masses 2 .. N
behind a resting mass 1 go on by the Taylor series of their own equations; and the force that would move mass 1 is
watched until it falls through zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import mpmath as mp
import numpy as np
from event_oracle import EventOracle

SLOWEST = mp.mpf(10) ** -25
"""Speed, relative to omega * clearance, at which bounces are no longer followed one by one."""


@dataclass
class StickingOracle(EventOracle):
    """The event simulator, with mass 1 coming to rest on a stop and leaving it.

    `rests` are the times at which it comes to rest (bounces accumulate there), `releases` those at which it leaves,
    `held_on` the stops.
    """

    digits: int = 50
    rests: list[mp.mpf] = field(default_factory=list)
    releases: list[mp.mpf] = field(default_factory=list)
    held_on: list[int] = field(default_factory=list)

    def run_to_releases(self, count: int, until: float = np.inf) -> None:
        """Go on until mass 1 has been released so many times in all, or the time is past `until`."""
        with mp.workdps(self.digits + 8):
            resting = 0
            if abs(self._x[0]) == mp.mpf(self.clearance) and self._v[0] == 0:
                resting = int(mp.sign(self._x[0]))
                self._left = resting
                if self._pressing(resting)[0] > 0:
                    self.rests.append(self._t)
                    self.held_on.append(resting)
                    self._rest_until_released(resting, until)
            while len(self.releases) < count and self._t < until:
                series = self._series()
                stop, at = self._first_contact(series[0])
                h = at if stop else self._step
                self._advance(series, h)
                self._left = stop
                if stop:
                    self.times.append(self._t)
                    self.stops.append(stop)
                    self.speeds.append(self._v[0])
                    self._x[0] = stop * mp.mpf(self.clearance)
                    self._v[0] = -mp.mpf(self.restitution) * self._v[0]
                    self._maybe_rest(stop, until)

    def state(self) -> tuple[list[mp.mpf], list[mp.mpf], mp.mpf]:
        """Displacements, velocities and time where the run stands."""
        return self._x, self._v, self._t

    def _advance(self, series: list[list[mp.mpf]], h: mp.mpf) -> None:
        self._x = [mp.polyval(c, h, asc=True) for c in series]
        self._v = [mp.polyval([k * c[k] for k in range(1, len(c))], h, asc=True) for c in series]
        self._t += h

    def _first_contact(self, x: list[mp.mpf]) -> tuple[int, mp.mpf | None]:
        # a bounce far shorter than the step: the near root of the gap with its zeros at 0 divided out
        stop = self._left
        if stop:
            gap = [-stop * c for c in x]
            rate, bend = gap[1], gap[2]
            if rate > 0 > bend and -rate / bend < self._step / 200:
                t = -rate / bend
                for _ in range(60):
                    value = self._at(gap[1:], t)
                    slope = self._at([k * gap[1 + k] for k in range(1, len(gap) - 1)], t)
                    t, before = t - value / slope, t
                    if abs(t - before) <= mp.mpf(10) ** (-self.digits) * t:
                        return stop, t
                raise AssertionError("the oracle's bounce did not converge")
            leading = next(k for k in range(1, len(gap)) if abs(gap[k]) > mp.mpf(10) ** (8 - self.digits))
            if leading > 1:
                # left from rest: x and v of the stop exactly, and after a release its acceleration too
                return self._behind_rest(x, gap[leading:], stop)
        return super()._first_contact(x)

    def _behind_rest(self, x: list[mp.mpf], gap: list[mp.mpf], stop: int) -> tuple[int, mp.mpf | None]:
        here = self._first_root(gap)
        other = [stop * c for c in x]
        other[0] += mp.mpf(self.clearance)
        there = self._first_root(other)
        found = [(at, which) for at, which in ((here, stop), (there, -stop)) if at is not None]
        return (min(found)[1], min(found)[0]) if found else (0, None)

    def _maybe_rest(self, stop: int, until: float) -> None:
        leaving = abs(self._v[0])
        if leaving > SLOWEST * mp.mpf(self.omega) * mp.mpf(self.clearance):
            return
        pressing = self._pressing(stop)[0]
        if pressing <= 0:
            return
        # bounces to come: 2 leaving/a, then R times as much, and so on; what is left out is of the order of 1e-50
        tail = 2 * leaving / (pressing * (1 - mp.mpf(self.restitution)))
        self._v[0] = mp.mpf(0)
        self.rests.append(self._t + tail)
        self.held_on.append(stop)
        self._rest_until_released(stop, until)

    def _held_series(self, stop: int) -> list[list[mp.mpf]]:
        """Taylor coefficients of every displacement while mass 1 stays where it is."""
        n, w = len(self.masses), mp.mpf(self.omega)
        place = stop * mp.mpf(self.clearance)
        x = [[place, mp.mpf(0)]] + [[self._x[i], self._v[i]] for i in range(1, n)]
        angle = w * self._t + mp.mpf(self.phase)
        cycle = [mp.sin(angle), mp.cos(angle), -mp.sin(angle), -mp.cos(angle)]
        power = mp.mpf(1)
        for k in range(39):
            drive = cycle[k % 4] * power
            x[0].append(mp.mpf(0))
            added = []
            for i in range(1, n):
                force = mp.mpf(self.forcing[i]) * drive
                for link, j in ((i - 1, i - 1), (i, i + 1)):
                    stretch = x[i][k] - (x[j][k] if j < n else 0)
                    rate = x[i][k + 1] - (x[j][k + 1] if j < n else 0)
                    force -= mp.mpf(self.stiffnesses[link]) * stretch + mp.mpf(self.links[link]) * (k + 1) * rate
                added.append(force / (mp.mpf(self.masses[i]) * ((k + 1) * (k + 2))))
            for i in range(1, n):
                x[i].append(added[i - 1])
            power = power * w / (k + 1)
        return x

    def _pressing(self, stop: int) -> list[mp.mpf]:
        """Taylor coefficients of the force on the resting mass 1, toward the stop."""
        x = self._held_series(stop)
        n, w = len(self.masses), mp.mpf(self.omega)
        angle = w * self._t + mp.mpf(self.phase)
        cycle = [mp.sin(angle), mp.cos(angle), -mp.sin(angle), -mp.cos(angle)]
        power = mp.mpf(1)
        coefficients = []
        for k in range(39):
            stretch = x[0][k] - (x[1][k] if n > 1 else 0)
            rate = (x[0][k + 1] - (x[1][k + 1] if n > 1 else 0)) * (k + 1)
            force = mp.mpf(self.forcing[0]) * cycle[k % 4] * power
            force -= mp.mpf(self.stiffnesses[0]) * stretch + mp.mpf(self.links[0]) * rate
            coefficients.append(stop * force / mp.mpf(self.masses[0]))
            power = power * w / (k + 1)
        return coefficients

    def _rest_until_released(self, stop: int, until: float) -> None:
        while self._t < until:
            series, pressing = self._held_series(stop), self._pressing(stop)
            at = self._first_root(pressing)
            self._advance(series, self._step if at is None else at)
            if at is not None:
                self.releases.append(self._t)
                self._left = stop
                return
