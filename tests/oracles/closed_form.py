"""Branches of motions with one impact, or one on each stop, under one harmonic, in closed form and in 50 digits.

The ellipse, its special points and where a further contact begins are those of the theory page, "One impact a period".
The sums are from M, C, K, h alone. Further contacts are looked for at many times between the impacts, and the largest
are made exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from flint import arb, arb_mat

from tests.oracles.fifty_digits import digits
from tests.oracles.impact_orbit_oracle import OneImpact, identity

SAMPLES = 600
"""Times between two impacts, for each half forcing period, at which contacts are looked for."""


@dataclass(frozen=True)
class BranchPoint:
    """A special point of a branch, SN, PD, SB or GR."""

    type: str
    angle: float
    clearance: float
    impact_velocity: float
    admissible: bool
    stop: int | None = None
    """GR only: +1 when the further contact is with the stop that is struck (first), -1 when with the other one."""
    time: float | None = None
    """GR only: time of the contact after the impact; 0 where the impact itself is the graze."""
    sensitivity: float = 1.0
    """Change of the angle by a relative change of the terms of which the condition is the sum."""


@dataclass(frozen=True)
class Pattern:
    """One impact on one stop in n periods, or one on each stop."""

    multiple: int
    symmetric: bool

    @property
    def half_periods(self) -> int:
        """Half forcing periods between two impacts."""
        return self.multiple if self.symmetric else 2 * self.multiple

    def spacing(self, omega: float) -> float:
        return self.half_periods * math.pi / omega


class OneImpactBranch:
    """All motions of one pattern at one frequency: ``v = A cos(angle)/d, b = A sin(angle) - c v``, by the angle."""

    def __init__(
        self,
        oscillator: Any,
        omega: float,
        multiple: int = 1,
        symmetric: bool = False,
        stop: int = 1,
        alone: bool = False,
    ) -> None:
        self.oscillator, self.omega, self.pattern = oscillator, omega, Pattern(multiple, symmetric)
        self.stop, self.alone = stop, alone
        with digits():
            sign = -1 if symmetric else 1
            self.motions = OneImpact(oscillator, arb(omega), self.pattern.half_periods, sign, stop)
            linear = self.motions.linear
            ((_, _, steady),) = linear.amplitudes(self.motions.omega)
            contact = sum((h * x for h, x in zip(linear.row, steady, strict=True)), 0 * steady[0])
            self._amplitude, self.exact_phase = abs(contact), contact.arg()
            self.steady = np.array([complex(x) for x in steady])
            self._rebound, self._impulse = self.motions.rebound, linear.impulse(arb(1))
            self._before = self._sums(1)
            (h, slope, _), w = self._read(self._before), self.motions.omega
            self._c, self._d = self._rebound * h, (1 + self._rebound * slope) / w
        self.amplitude, self.phase = float(self._amplitude), float(self.exact_phase)
        self.position_coefficient, self.velocity_coefficient = float(self._c), float(self._d)
        self.lowest = math.atan2(self.position_coefficient, self.velocity_coefficient)

    def _sums(self, multiplier: int) -> arb_mat:
        """The state just before an impulse, of all earlier ones, each the multiplier times the next one."""
        flow = self.motions.flow
        unit = identity(flow.nrows()) * multiplier
        return (unit - flow).solve(flow * self._impulse)

    def _read(self, state: arb_mat) -> tuple[arb, arb, arb]:
        """Displacement, velocity and acceleration of the contact in free motion."""
        linear = self.motions.linear
        rates = linear.generator * state
        return linear.along(state), linear.along(rates), linear.along(rates, linear.size)

    def clearance(self, angle: float) -> float:
        """b at an angle."""
        ratio = self.position_coefficient / self.velocity_coefficient
        return self.amplitude * (math.sin(angle) - ratio * math.cos(angle))

    def impact_velocity(self, angle: float) -> float:
        """v at an angle."""
        return self.amplitude * math.cos(angle) / self.velocity_coefficient

    def angles(self, clearance: float) -> list[float]:
        """The angles of the orbits with this clearance > 0: none, one, or two (above the graze), decreasing."""
        height = clearance * math.cos(self.lowest) / self.amplitude  # b = A sin(angle - lowest)/cos(lowest)
        if height > 1.0:
            return []
        rise = math.asin(height)
        both = [self.lowest + math.pi - rise, self.lowest + rise]
        return [angle for angle in dict.fromkeys(both) if -0.5 * math.pi < angle < 0.5 * math.pi]

    @cached_property
    def special_points(self) -> list[BranchPoint]:
        """By decreasing angle; the first one is the graze of the steady motion."""
        start = self._first_contact
        points = [BranchPoint("GR", 0.5 * math.pi, self.amplitude, 0.0, start is not None, 1, 0.0)]
        with digits():
            c, d = self._c, self._d
            places: list[tuple[str, arb, arb, float, tuple[int, float] | None]] = [("SN", d, -c, 1.0, None)]
            (h, slope, second), (_, _, own) = self._read(self._sums(-1)), self._read(self._before)
            e = self._rebound
            square, change = (1 + e * slope) ** 2, e * e * h * (own - second)
            drive = -e * h * self.motions.omega**2 * d
            terms = square + abs(e * e * h) * (abs(own) + abs(second)) + abs(drive)
            side = -1 if drive < 0 else 1
            sine, cosine = (square + change) * side, drive * side
            kind = "SB" if self.pattern.symmetric else "PD"
            places.append((kind, sine, cosine, float(terms / _length(sine, cosine)), None))
            if start is not None and start[2] is not None:
                sine, cosine, contact = start
                places.append(("GR", sine, cosine, self._sensitivity(sine, cosine, contact[1]), contact))
            for kind, opposite, adjacent, sensitivity, contact in places:
                length = _length(opposite, adjacent)
                sine, cosine = opposite / length, adjacent / length
                clearance = self._amplitude * (sine - c / d * cosine)
                if not (cosine > 0 and clearance > 0):
                    continue
                above = start is not None and bool(sine / cosine > start[0] / start[1])
                points.append(
                    BranchPoint(
                        kind,
                        math.atan2(float(sine), float(cosine)),
                        float(clearance),
                        float(self._amplitude * cosine / d),
                        above or kind == "GR",
                        *(contact or (None, None)),
                        sensitivity,
                    )
                )
        return sorted(points, key=lambda point: -point.angle)

    def _sensitivity(self, sine: arb, cosine: arb, time: float) -> float:
        place, rate, _ = self._read((self.motions.linear.generator * arb(time)).exp() * (self._before + self._impulse))
        level, _, _ = self._read(self._before)
        w = self.motions.omega
        free = self._rebound / self._d * (abs(level) + abs(place) + abs(rate) / w)
        return float((1 + w * time) * (1 + free) / _length(sine, cosine))

    @property
    def admissible_above(self) -> float:
        """Orbits with an angle above this have no further contact; pi/2: all have one."""
        start = self._first_contact
        return 0.5 * math.pi if start is None else math.atan2(float(start[0]), float(start[1]))

    @cached_property
    def _first_contact(self) -> tuple[arb, arb, tuple[int, float] | None] | None:
        """Sine and cosine of the lowest angle of admissible orbits, and stop and time of the contact there.

        None where no orbit is admissible; no stop where the clearance is 0 there.
        """
        with digits():
            # the contact is where the acceleration just after an impact without rebound vanishes, or later
            best: tuple[arb, arb, tuple[int, float] | None] = (self._c, self._d, None)
            if self._rebound == 1:
                _, _, after = self._read(self._before + self._impulse)
                w = self.motions.omega
                released = (-self._rebound / self._d * after, w * w, (1, 0.0))
                best = max(best, released, key=lambda each: float(each[0] / each[1]))
            for stop in (1,) if self.alone else (1, -1):
                starts = []
                for k in range(1, self.pattern.half_periods):
                    if (k % 2 == 0) == (stop > 0):
                        back = arb.pi() * k / self.motions.omega
                        (n, rate, _), _ = self._parts(stop, back)
                        if n > 0:
                            return None
                        starts.append(back - 2 * n / rate)  # N/D has a maximum next to the time where D is 0
                for start in [*starts, *self._sampled(stop)]:
                    time = self._turn(stop, start)
                    if time is None or not 0 < time < self.motions.span:
                        continue
                    (n, _, _), (d, _, _) = self._parts(stop, time)
                    if n / d > best[0] / best[1]:
                        best = (n, d, (stop, float(time)))
        return best

    def _turn(self, stop: int, near: arb) -> arb | None:
        """The time near a given one at which N/D has an extremum, by Newton's method; None where it leads away."""
        time = near.mid()
        for _ in range(60):
            (n, n_rate, n_second), (d, d_rate, d_second) = self._parts(stop, time)
            step = ((n_rate * d - n * d_rate) / (n_second * d - n * d_second)).mid()
            time = (time - step).mid()
            if abs(step) < 1e-22 * self.motions.span:
                return time
        return None

    def _parts(self, stop: int, time: arb) -> tuple[tuple[arb, arb, arb], tuple[arb, arb, arb]]:
        """N and D with their first two derivatives: the distance from a stop is D sin - N cos."""
        w, factor = self.motions.omega, self._rebound / self._d
        level, _, _ = self._read(self._before)
        place, rate, second = self._read((self.motions.linear.generator * time).exp() * (self._before + self._impulse))
        sine, cosine = (w * time).sin(), (w * time).cos()
        return (
            stop * sine + factor * (level - stop * place),
            stop * (w * cosine - factor * rate),
            -stop * (w * w * sine + factor * second),
        ), (1 - stop * cosine, stop * w * sine, stop * w * w * cosine)

    def _sampled(self, stop: int) -> list[arb]:
        """The times, of many between the impacts, at which N/D is largest among its neighbours: the highest three."""
        count = SAMPLES * self.pattern.half_periods
        linear, span = self.motions.linear, self.motions.span
        step = _floats((linear.generator * (span / count)).exp())
        state, row = _floats(self._before + self._impulse)[:, 0], np.array([float(h) for h in linear.row])
        places = np.empty(count + 1)
        for k in range(count + 1):
            places[k] = row @ state[: linear.size]
            state = step @ state
        times = np.arange(1, count) * (float(span) / count)
        level, _, _ = self._read(self._before)
        factor, w = float(self._rebound / self._d), self.omega
        n = stop * np.sin(w * times) + factor * (float(level) - stop * places[1:-1])
        half = np.sin(0.5 * w * times) if stop > 0 else np.cos(0.5 * w * times)
        ratios = n / np.maximum(2.0 * half * half, 1e-300)
        inner = ratios[1:-1]
        tops = 1 + np.flatnonzero((inner > ratios[:-2]) & (inner >= ratios[2:]))
        return [arb(float(times[k])) for k in sorted(tops.tolist(), key=lambda k: -ratios[k])[:3]]


def _length(sine: arb, cosine: arb) -> arb:
    return (sine * sine + cosine * cosine).sqrt()


def _floats(matrix: arb_mat) -> Any:
    return np.array([[float(matrix[i, j]) for j in range(matrix.ncols())] for i in range(matrix.nrows())])


def one_impact_branch(
    oscillator: Any, omega: float, multiple: int = 1, symmetric: bool = False, stop: int = 1, alone: bool = False
) -> OneImpactBranch:
    """The branch of motions with one impact in n forcing periods on a stop, or one on each stop.

    The other stop is absent (`alone`) or has the same gap from the equilibrium.
    """
    return OneImpactBranch(oscillator, omega, multiple, symmetric, stop, alone)
