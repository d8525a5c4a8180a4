"""Orbits with one impact in n forcing periods, or one on each stop, between any stops and under any harmonics.

The speeds of the impacts follow from their phases, so one impact leaves one unknown, and two leave two: all solutions
are found without a guess. With one impact at the phase t0 on the right stop,

    v = q_f'(t0)/D,    gap = q_f(t0) - c v,    D = 1 + (1 + R) H'(1), c = (1 + R) H(1)

where q_f is the steady motion and H the periodic sums of `grazing.one_impact_family`. On the left stop q is -q. Every
condition on the phase is a trigonometric polynomial, of the degree of the highest harmonic (theory, "Any linear
structure").
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.kernels.stops import Stops, gap_of
from grazemap_core.grazing.one_impact_family import Pattern, PeriodicSums, before_impulse, periodic_sums
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.equations import rebound_of
from grazemap_core.orbits.tolerances import LAG_ACCURACY, LAG_STEPS, ON_UNIT_CIRCLE, PHASE_POLISHING_STEPS, SAME_ZERO
from grazemap_core.records import dataclass
from grazemap_core.tolerances import EPSILON


@dataclass(frozen=True, eq=False)
class Harmonics:
    """A trigonometric polynomial of the phase: a constant and the sum of Im(amplitude exp(i order phase))."""

    orders: Floats
    """(H,) Whole numbers > 0, increasing."""
    amplitudes: Complexes
    """(H,) Amplitudes by order."""
    constant: float = 0.0
    """The constant."""

    def derivative(self) -> Harmonics:
        """Return the derivative."""
        return Harmonics(self.orders, 1j * self.orders * self.amplitudes)

    def turned(self, angle: float) -> Harmonics:
        """Return the polynomial of a phase that is larger by an angle."""
        return Harmonics(self.orders, self.amplitudes * np.exp(1j * self.orders * angle), self.constant)

    def plus(self, factor: float, other: Harmonics) -> Harmonics:
        """Return this one plus a factor times another one of the same orders."""
        return Harmonics(
            self.orders, self.amplitudes + factor * other.amplitudes, self.constant + factor * other.constant
        )

    def times(self, factor: float) -> Harmonics:
        """Return this one times a factor."""
        return Harmonics(self.orders, factor * self.amplitudes, factor * self.constant)

    def at(self, phase: float) -> float:
        """Return the value at a phase."""
        return self.constant + float(np.sum((self.amplitudes * np.exp(1j * self.orders * phase)).imag))

    def zeros(self) -> list[float]:
        """Return all zeros in [0, 2 pi), increasing; those closer than SAME_ZERO are one.

        A double zero may be missed, or found as two that are farther apart.
        """
        degree = int(self.orders[-1])
        coefficients = np.zeros(2 * degree + 1, dtype=np.complex128)
        coefficients[degree] = self.constant
        for order, amplitude in zip(self.orders.astype(np.int64).tolist(), self.amplitudes.tolist(), strict=True):
            coefficients[degree + order] += amplitude / 2j
            coefficients[degree - order] -= amplitude.conjugate() / 2j
        if not np.any(coefficients):
            return []
        roots = np.roots(coefficients[::-1])
        slope, phases = self.derivative(), []
        for root in roots[np.abs(np.abs(roots) - 1.0) <= ON_UNIT_CIRCLE].tolist():
            phase = math.atan2(root.imag, root.real)
            for _ in range(PHASE_POLISHING_STEPS):
                rate = slope.at(phase)
                phase -= self.at(phase) / rate if rate != 0.0 else 0.0
            if abs(self.at(phase)) <= ON_UNIT_CIRCLE * (abs(self.constant) + float(np.sum(np.abs(self.amplitudes)))):
                phases.append(within_turn(phase))
        return apart_on_circle(phases)


def within_turn(phase: float) -> float:
    """Return a phase in [0, 2 pi); the remainder of a tiny negative one is rounded to 2 pi."""
    turned = phase % (2.0 * math.pi)
    return turned if turned < 2.0 * math.pi else 0.0


def apart_on_circle(phases: list[float]) -> list[float]:
    """Return phases in [0, 2 pi), increasing, without those that follow another one within SAME_ZERO."""
    ordered = sorted(phases)
    if not ordered:
        return []
    before = [ordered[-1] - 2.0 * math.pi, *ordered]
    kept = [phase for last, phase in zip(before, ordered, strict=False) if phase - last > SAME_ZERO]
    return kept or ordered[:1]


@dataclass(frozen=True, eq=False)
class OneImpactOrbits:
    """All orbits with one impact in n forcing periods on one stop, at one frequency, for all gaps of that stop.

    Symmetric ones have an impact on the other stop, too, half of n periods later.
    """

    omega: float
    """Forcing frequency."""
    pattern: Pattern
    """The pattern of impacts."""
    stop: int
    """+1 or -1."""
    toward: Harmonics
    """The steady motion toward the stop."""
    rebound: float
    """1 + R of the stop."""
    sums: PeriodicSums
    """Response to unit impulses at all earlier impacts."""

    @classmethod
    def of(
        cls, family: OrbitFamily, omega: float, stop: int, rebound: float, steady: Complexes | None = None
    ) -> OneImpactOrbits:
        """Return the orbits of a family; `steady` are the amplitudes of `OrbitFamily.steady`, if they are known."""
        return cls(
            omega=omega,
            pattern=family.pattern,
            stop=stop,
            toward=_steady(family, omega, steady).times(float(stop)),
            rebound=rebound,
            sums=periodic_sums(family.response, family.pattern, omega),
        )

    @cached_property
    def speeds(self) -> Harmonics:
        """The impact speed, over omega, as a function of the phase of the impact."""
        return self.toward.derivative().times(1.0 / (1.0 + self.rebound * self.sums.velocity))

    @cached_property
    def gaps(self) -> Harmonics:
        """The gap as a function of the phase of the impact."""
        return self.toward.plus(-self.rebound * self.sums.displacement * self.omega, self.speeds)

    def speed(self, phase: float) -> float:
        """Return the speed of the impact at a phase; the impact is virtual where it is negative."""
        return self.omega * self.speeds.at(phase)

    def gap(self, phase: float) -> float:
        """Return the gap of the stop, with which there is an impact at a phase."""
        return self.gaps.at(phase)

    def phases(self, gap: float) -> list[float]:
        """Return the phases of impacts that are not virtual, for a gap of the stop."""
        level = Harmonics(self.toward.orders, self.gaps.amplitudes, -gap)
        return [phase for phase in level.zeros() if self.speeds.at(phase) > 0.0]

    def saddle_nodes(self) -> list[float]:
        """Return the phases at which the gap has an extremum over the phase, and the impact is not virtual."""
        return [phase for phase in self.gaps.derivative().zeros() if self.speeds.at(phase) > 0.0]

    def period_doublings(self) -> list[float]:
        """Return the phases at which a multiplier is -1, and the impact is not virtual; a half one of symmetric orbits.

        ``[D(-1)^2 + e^2 H(-1) (H''(1) - H''(-1))] q_f'/D(1) - e H(-1) q_f'' = 0`` with e = 1 + R, D = 1 + e H'.
        """
        sums, e = self.sums, self.rebound
        straight = 1.0 + e * sums.doubled_velocity
        change = e * e * sums.doubled_displacement * (sums.acceleration - sums.doubled_acceleration)
        acceleration = self.toward.derivative().derivative()
        test = self.speeds.times(straight * straight + change).plus(
            -e * sums.doubled_displacement * self.omega, acceleration
        )
        return [phase for phase in test.zeros() if self.speeds.at(phase) > 0.0]

    def impacts(self, phase: float) -> ImpactSequence:
        """Return the impacts of the orbit with an impact at a phase."""
        pattern, velocity = self.pattern, self.stop * self.speed(phase)
        return ImpactSequence.create(pattern.multiple, [self.stop], [phase], [velocity], pattern.symmetric)


def one_impact_sequences(family: OrbitFamily, stops: Stops, omega: float, stop: int) -> list[ImpactSequence]:
    """Return the impacts of all orbits with one impact on a stop in the family's period, by decreasing speed."""
    orbits = OneImpactOrbits.of(family, omega, stop, rebound_of(stops, stop))
    phases = orbits.phases(gap_of(stops, stop))
    return [orbits.impacts(phase) for phase in sorted(phases, key=orbits.speed, reverse=True)]


def two_impact_sequences(family: OrbitFamily, stops: Stops, omega: float, first: int) -> list[ImpactSequence]:
    """Return the impacts of orbits with one impact on each stop in the family's period, the one on `first` first.

    At a given lag of the second impact the speeds are linear in the steady motion, so the gap of the first stop is a
    trigonometric polynomial of the phase. The gap of the second stop decides over the lag, which is searched on a grid:
    two orbits whose lags differ by less than its step may be missed, and one where the phase ends within a step.
    """
    lags = _Lags(family, stops, omega, first)
    turn = 2.0 * math.pi * family.pattern.multiple
    grid = np.linspace(0.0, turn, LAG_STEPS * family.pattern.multiple + 1)[1:-1].tolist()
    sequences: list[ImpactSequence] = []
    before: list[tuple[float, float]] = []
    for place, lag in enumerate(grid):
        here = [(phase, lags.mismatch(lag, phase)) for phase in lags.phases(lag)]
        for phase, mismatch in here:
            near = min(before, key=lambda other: abs(math.remainder(other[0] - phase, 2.0 * math.pi)), default=None)
            if near is not None and near[1] * mismatch <= 0.0 and mismatch != 0.0:
                sequences += lags.between(grid[place - 1], lag, near[0])
        before = here
    return sequences


class _Lags:
    """Orbits with two impacts, as functions of the lag of the second one and the phase of the first one."""

    def __init__(self, family: OrbitFamily, stops: Stops, omega: float, first: int) -> None:
        self.omega, self.sides = omega, (first, -first)
        self.gaps = [gap_of(stops, stop) for stop in self.sides]
        self.rebounds = [rebound_of(stops, stop) for stop in self.sides]
        self.multiple, self.span = family.pattern.multiple, family.pattern.spacing(omega)
        self.steady = _steady(family, omega)
        response = family.response
        unit = np.stack([response.value, response.slope], axis=1)
        self.blocks = list(zip(response.decay, response.discriminant, response.frequency_squared, strict=True))
        self.before = before_impulse(family.pattern.kinds[0], response, unit, self.span)
        self.after = self.before + unit

    def _response(self, time: float) -> tuple[float, float]:
        """Return displacement and velocity a time after one of the periodic unit impulses; 0: just before one."""
        if time == 0.0:
            total = np.sum(self.before, axis=0)
            return float(total[0]), float(total[1])
        place, rate = 0.0, 0.0
        for (decay, discriminant, square), (first, second) in zip(self.blocks, self.after.tolist(), strict=True):
            e11, e12, e21, e22 = block_flow(decay, discriminant, square, time)
            place += e11 * first + e12 * second
            rate += e21 * first + e22 * second
        return place, rate

    def _matrices(self, lag: float) -> tuple[Floats, Floats]:
        """Return what speeds have to be multiplied by to give the changes of displacement and velocity, (2, 2) each."""
        time = lag / self.omega
        times = ((0.0, self.span - time), (time, 0.0))
        both = (
            np.array([[self._response(times[i][j]) for j in range(2)] for i in range(2)])
            * np.array(self.rebounds)[None, :, None]
        )
        return both[:, :, 0], both[:, :, 1]

    def _polynomials(self, lag: float) -> tuple[list[Harmonics], list[Harmonics]]:
        """Return the speeds over omega, and the displacements minus the stops', as functions of the first phase."""
        place, rate = self._matrices(lag)
        inverse = np.linalg.inv(np.eye(2) + rate)
        steady = [self.steady, self.steady.turned(lag)]
        rates = [motion.derivative() for motion in steady]
        speeds = [rates[0].times(inverse[i, 0]).plus(inverse[i, 1], rates[1]) for i in range(2)]
        places = []
        for i in range(2):
            moved = steady[i].plus(-place[i, 0] * self.omega, speeds[0]).plus(-place[i, 1] * self.omega, speeds[1])
            places.append(Harmonics(moved.orders, moved.amplitudes, -self.sides[i] * self.gaps[i]))
        return speeds, places

    def phases(self, lag: float) -> list[float]:
        """Return the phases of the first impact at which it is on its stop."""
        return self._polynomials(lag)[1][0].zeros()

    def mismatch(self, lag: float, phase: float) -> float:
        """Return the displacement beyond the second stop at the second impact."""
        return self._polynomials(lag)[1][1].at(phase)

    def between(self, low: float, high: float, phase: float) -> Iterator[ImpactSequence]:
        """Yield the orbit between two lags, with a phase near the given one, if neither impact is virtual."""

        def nearest(lag: float) -> float:
            phases = self.phases(lag)
            if not phases:
                raise _PhaseEnds
            return min(phases, key=lambda other: abs(math.remainder(other - phase, 2.0 * math.pi)))

        def test(lag: float) -> float:
            return self.mismatch(lag, nearest(lag))

        try:
            lag = _zero(test, low, high)
            if lag is None:
                return
            first = nearest(lag)
        except _PhaseEnds:
            return
        speeds = [self.omega * polynomial.at(first) for polynomial in self._polynomials(lag)[0]]
        if all(stop * speed > 0.0 for stop, speed in zip(self.sides, speeds, strict=True)):
            yield ImpactSequence.create(self.multiple, self.sides, [first, first + lag], speeds)


class _PhaseEnds(Exception):
    """There is no phase any more that could be followed."""


def _zero(test: Callable[[float], float], low: float, high: float) -> float | None:
    """Return where a function changes its sign; None where it has one sign at both ends. NaN is a ValueError."""
    ends = test(low), test(high)
    if min(ends) > 0.0 or max(ends) < 0.0:
        return None
    return float(brentq(test, low, high, xtol=LAG_ACCURACY, rtol=4.0 * EPSILON))


def _steady(family: OrbitFamily, omega: float, steady: Complexes | None = None) -> Harmonics:
    orders = np.array([float(harmonic.order) for harmonic in family.oscillator.forces])
    return Harmonics(orders, (family.steady(omega) if steady is None else steady)[:, -1])
