"""An impact simulator in multi-precision arithmetic that shares nothing with the core.

The equations of motion are integrated by Taylor series of the matrices themselves (no modes, no closed forms), with a
fixed step and 40 digits, or more if asked for; events are found on the series by sampling every extremum, so a
near-grazing contact is told by the sign of a 40-digit number.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import count
from typing import Any, Self

import mpmath as mp
import numpy as np

ORDER = 40  # of the series, for up to 48 digits
SAMPLES = 64  # of a series over the inverse of the fastest exponent


@dataclass
class EventOracle:
    """Mass 1 of a chain between two stops, from given numbers taken exactly as binary64."""

    masses: list[float]
    stiffnesses: list[float]
    links: list[float]  # damping coefficient of each link, doubled zeta already in it
    forcing: list[float]
    restitution: float
    omega: float
    clearance: float
    displacement: list[float] | None = None
    velocity: list[float] | None = None
    phase: float = 0.0
    digits: int = 40
    times: list[mp.mpf] = field(default_factory=list)
    stops: list[int] = field(default_factory=list)
    speeds: list[mp.mpf] = field(default_factory=list)

    @classmethod
    def of(cls, oscillator: Any, omega: float, clearance: float, **start: Any) -> Self:
        """Take over the numbers, and nothing else, of the core's oscillator."""
        numbers = (oscillator.masses, oscillator.stiffnesses, oscillator.link_damping, oscillator.forcing)
        return cls(*(values.tolist() for values in numbers), oscillator.restitution, omega, clearance, **start)

    def __post_init__(self) -> None:
        n = len(self.masses)
        # a step, times the fastest exponent; many digits need fewer terms for a longer step
        reach = 1 if self.digits <= 48 else 4
        small = (self.digits - 1) * math.log(10.0)
        self._order = next(k for k in count(ORDER) if math.lgamma(k + 1) - k * math.log(reach) > small)
        self._samples = SAMPLES * reach
        with mp.workdps(self.digits + 8):
            self._x = [mp.mpf(v) for v in (self.displacement or [0.0] * n)]
            self._v = [mp.mpf(v) for v in (self.velocity or [0.0] * n)]
            self._t = mp.mpf(0)
            self._left = 0
            # rows of M^-1 K and of M^-1 C bound the exponents (Gershgorin); the series goes as far as they allow
            stiffness = np.array(self.stiffnesses) + np.array([0.0, *self.stiffnesses[:-1]])
            damping = np.array(self.links) + np.array([0.0, *self.links[:-1]])
            slope = float(np.max(2 * damping / self.masses))
            fastest = slope + float(np.sqrt(np.max(2 * stiffness / self.masses)))
            self._step = reach / mp.mpf(max(fastest, self.omega))

    def _series(self) -> list[list[mp.mpf]]:
        """Taylor coefficients in time, from here, of every displacement: the chain's equations term by term."""
        n, w = len(self.masses), mp.mpf(self.omega)
        x = [[self._x[i], self._v[i]] for i in range(n)]
        angle = w * self._t + mp.mpf(self.phase)
        sine = [mp.sin(angle), mp.cos(angle)]
        cycle = [sine[0], sine[1], -sine[0], -sine[1]]
        power = mp.mpf(1)
        k_links, c_links, masses, forcing = (
            [mp.mpf(v) for v in values] for values in (self.stiffnesses, self.links, self.masses, self.forcing)
        )
        for k in range(self._order - 1):
            drive = cycle[k % 4] * power
            force = [f * drive for f in forcing]
            for i in range(n):
                if i + 1 < n:
                    stretch, rate = x[i][k] - x[i + 1][k], x[i][k + 1] - x[i + 1][k + 1]
                else:
                    stretch, rate = x[i][k], x[i][k + 1]
                pull = k_links[i] * stretch + c_links[i] * (k + 1) * rate
                force[i] -= pull
                if i + 1 < n:
                    force[i + 1] += pull
            for i in range(n):
                x[i].append(force[i] / (masses[i] * ((k + 1) * (k + 2))))
            power = power * w / (k + 1)
        return x

    def run(self, impacts: int, until: float = np.inf) -> None:
        """Go on until so many impacts were seen in all, or the time is past `until`."""
        with mp.workdps(self.digits + 8):
            while len(self.times) < impacts and self._t < until:
                series = self._series()
                stop, at = self._first_contact(series[0])
                h = at if stop else self._step
                self._x = [mp.polyval(c, h, asc=True) for c in series]
                self._v = [mp.polyval([k * c[k] for k in range(1, len(c))], h, asc=True) for c in series]
                self._t += h
                self._left = stop
                if stop:
                    self.times.append(self._t)
                    self.stops.append(stop)
                    self.speeds.append(self._v[0])
                    self._x[0] = stop * mp.mpf(self.clearance)
                    self._v[0] = -mp.mpf(self.restitution) * self._v[0]

    def state_at(self, time: float) -> tuple[list[mp.mpf], list[mp.mpf]]:
        """Displacement and velocity a short time ahead of where the run stands (no contact in between assumed)."""
        with mp.workdps(self.digits + 8):
            series = self._series()
            h = mp.mpf(time) - self._t
            return (
                [mp.polyval(c, h, asc=True) for c in series],
                [mp.polyval([k * c[k] for k in range(1, len(c))], h, asc=True) for c in series],
            )

    def _first_contact(self, x: list[mp.mpf]) -> tuple[int, mp.mpf | None]:
        best: tuple[int, mp.mpf | None] = (0, None)
        for stop in (1, -1):
            gap = [-stop * c for c in x]
            gap[0] += mp.mpf(self.clearance)
            if stop == self._left:
                gap = gap[1:]  # on the stop by definition: divide the root at 0 out
            root = self._first_root(gap)
            if root is not None and (best[1] is None or root < best[1]):
                best = (stop, root)
        return best

    def _first_root(self, gap: list[mp.mpf]) -> mp.mpf | None:
        """First zero crossing of a series on [0, step], every local minimum of it looked at in full precision."""
        h = float(self._step)
        grid = np.linspace(0.0, h, self._samples + 1)
        rough = np.polynomial.polynomial.polyval(grid, [float(c) for c in gap])
        slope = [k * gap[k] for k in range(1, len(gap))]
        steepness = np.polynomial.polynomial.polyval(grid, [float(c) for c in slope])
        near = 1e-3 * (np.abs(rough).max() + 1e-300)
        for i in range(self._samples):
            low, high = mp.mpf(grid[i]), mp.mpf(grid[i + 1])
            if rough[i] > near and rough[i + 1] > near:
                continue
            if self._at(gap, high) < 0:
                return self._cross(gap, low, high)
            if steepness[i] <= 0.0 <= steepness[i + 1]:
                lowest = self._cross([-c for c in slope], low, high)
                if self._at(gap, lowest) < 0:
                    return self._cross(gap, low, lowest)
        return None

    @staticmethod
    def _at(series: list[mp.mpf], t: mp.mpf) -> mp.mpf:
        return mp.polyval(series, t, asc=True)

    def _cross(self, series: list[mp.mpf], low: mp.mpf, high: mp.mpf) -> mp.mpf:
        """The zero in [low, high] of a series that falls from positive to negative there."""
        slope = [k * series[k] for k in range(1, len(series))]
        t = (low + high) / 2
        for _ in range(400):
            value = self._at(series, t)
            if value < 0:
                high = t
            else:
                low = t
            step = value / self._at(slope, t)
            new = t - step
            if not low <= new <= high:
                new = (low + high) / 2
            if abs(new - t) < mp.mpf(10) ** (-self.digits):
                return new
            t = new
        raise AssertionError("the oracle's root search did not converge")
