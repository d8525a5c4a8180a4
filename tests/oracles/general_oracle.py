"""An impact simulator in multi-precision for any linear structure with one contact coordinate.

``M x'' + C x' + K x = F(t) + s`` while ``-c_L <= h^T x <= c_R``, with an impact law, sticking and release at either
stop. Nothing is shared with the core: the motion between events is the Taylor series of the matrices themselves, and a
contact near grazing is decided by the sign of a number of many digits (`linear_flow`, `series_roots`). Bounces of a
complete chatter are followed one by one until all bounces to come take less than ``10^(-digits/2)`` of the shortest
time of the structure; they are then the tail of a geometric series.

Arithmetic with the numbers of a run belongs inside ``oracles.digits``, even a change of sign: elsewhere it rounds to
double precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Self

import numpy as np
from flint import acb, arb, arb_mat, ctx

from tests.oracles.contact_system import ContactSystem, Matrix, Number, Row, complex_of, matrix_of, real
from tests.oracles.fifty_digits import digits, tridiagonal
from tests.oracles.linear_flow import EXTRA_BITS, Floats, Target
from tests.oracles.series_roots import power_of_ten


class State(NamedTuple):
    """Displacements, velocities and time."""

    displacement: list[arb]
    velocity: list[arb]
    time: arb

    def floats(self) -> tuple[Floats, Floats]:
        """Return displacements and velocities in double precision."""
        return np.array([float(v) for v in self.displacement]), np.array([float(v) for v in self.velocity])


class Growth(NamedTuple):
    """How much a small error of the initial displacement is multiplied in the times of events and in the end."""

    times: list[float]
    rests: list[float]
    releases: list[float]
    state: float


@dataclass
class GeneralOracle:
    """A linear structure between two stops, from given numbers.

    The numbers may be changed until the first run.

    Attributes
    ----------
    mass, damping, stiffness : N rows of N numbers
    contact : N numbers
        h of the contact coordinate ``q = h^T x``.
    harmonics : pairs of an order k and N complex amplitudes f
        Forces ``Im(f e^{i k (omega t + phase)})``.
    restitution : two numbers
        Of the right stop, and of the left one.
    gaps : two numbers; None or infinity for an absent stop
        ``c_R`` and ``c_L``, measured from q = 0.
    bias : N numbers, optional
        Static forces s.
    displacement, velocity : N numbers each, optional
        Of the initial state. Without, it is the static equilibrium ``K^-1 s`` at rest, held by a stop if it lies
        beyond it.
    phase : number
        Of the forcing at time 0.
    digits : int
        Wanted digits; the arithmetic has ten more.
    times, stops, speeds : lists
        Of the impacts: time, stop (1 right, -1 left) and contact velocity before.
    rests, releases, held_on : lists
        The times at which q comes to rest on a stop (the accumulation of a chatter) and leaves it, and the stops.
    """

    mass: Matrix
    damping: Matrix
    stiffness: Matrix
    contact: Row
    harmonics: Sequence[tuple[int, Row]]
    restitution: tuple[Number, Number]
    gaps: tuple[Number | None, Number | None]
    omega: Number
    bias: Row | None = None
    displacement: Row | None = None
    velocity: Row | None = None
    phase: Number = 0.0
    digits: int = 50
    times: list[arb] = field(default_factory=list, init=False)
    stops: list[int] = field(default_factory=list, init=False)
    speeds: list[arb] = field(default_factory=list, init=False)
    rests: list[arb] = field(default_factory=list, init=False)
    releases: list[arb] = field(default_factory=list, init=False)
    held_on: list[int] = field(default_factory=list, init=False)

    @classmethod
    def of(cls, oscillator: Any, omega: Number, right: Number | None, left: Number | None, **start: Any) -> Self:
        """Take over the numbers, and nothing else, of the core's oscillator.

        The matrices of a chain are sums without roundings; with proportional damping ``C = 2 gamma K`` is a product
        without roundings. Amplitudes of forces that depend on omega are evaluated in multi-precision.
        """
        structure = oscillator.structure
        with digits(start.get("digits", cls.digits)):
            ctx.prec += EXTRA_BITS
            mass, damping, stiffness = (
                matrix.tolist()
                for matrix in (structure.mass_matrix, structure.damping_matrix, structure.stiffness_matrix)
            )
            if hasattr(structure, "link_damping"):
                links, dampers = ([real(v) for v in part] for part in (structure.stiffnesses, structure.link_damping))
                if structure.gamma is not None:
                    dampers = [2 * real(structure.gamma) * k for k in links]
                damping, stiffness = tridiagonal(dampers), tridiagonal(links)
            harmonics = []
            for harmonic in oscillator.drive:
                s = acb(harmonic.order * real(omega))
                parts = (
                    [complex_of(v) for v in part] for part in (harmonic.constant, harmonic.rate, harmonic.quadratic)
                )
                harmonics.append(
                    (harmonic.order, [a + acb(0, 1) * s * b + s * s * c for a, b, c in zip(*parts, strict=True)])
                )
        return cls(
            mass,
            damping,
            stiffness,
            oscillator.contact.tolist(),
            harmonics,
            (oscillator.restitution_of(1), oscillator.restitution_of(-1)),
            (right, left),
            omega,
            oscillator.bias.tolist(),
            **start,
        )

    @classmethod
    def between(cls, oscillator: Any, omega: Number, clearance: Number, **start: Any) -> Self:
        """The same between two stops of one clearance."""
        return cls.of(oscillator, omega, clearance, clearance, **start)

    def __post_init__(self) -> None:
        self._system: Any = None  # made by the first run
        self._held = 0  # the stop on which q rests
        self._on = 0  # the stop on which q is, moving
        self._zeros = 0  # order of the zero, here and now, of what is watched

    def run(self, impacts: float = np.inf, until: Number = np.inf, *, releases: float = np.inf) -> None:
        """Go on until so many impacts or releases were seen in all, or exactly to the time `until`."""
        with digits(self.digits):
            self._begin()
            end = None if isinstance(until, float) and np.isinf(until) else real(until)
            while len(self.times) < impacts and len(self.releases) < releases and (end is None or self._t < end):
                self._go_on(end)

    def at(self, time: Number) -> State:
        """Return the state at a time, not before the one where the run stands."""
        self.run(until=time)
        return self.state()

    def state(self) -> State:
        """Return the state where the run stands, after the last impact if it stands at one."""
        with digits(self.digits):
            self._begin()
            return State(self._system.displacements(self._y), self._system.displacements(self._v), self._t)

    def growth(self, direction: Row | None = None) -> Growth:
        """Return what an error of the initial displacement along a direction is multiplied by, after a run.

        A second run starts at a distance of ``10^(-2/5 digits)`` times the direction, by default (1, ..., 1). The
        growth of the end state is that of the largest change of a displacement at the time where this run stands.
        """
        with digits(self.digits):
            end, step = self.state(), arb(10) ** (-2 * self.digits // 5)
            start = self._initial()
            moved = [(x + step * real(d)).mid() for x, d in zip(start, direction or [1] * len(start), strict=True)]
            other = replace(self, displacement=moved)
            other.run(until=end.time)
            pairs = [(end.displacement, other.state().displacement)]
            # an event at the very end of this run may be later in the other one
            other.run(len(self.times), self._t + self._system.free.step)
            pairs += [(getattr(self, name), getattr(other, name)) for name in ("times", "rests", "releases")]
            changes = [[abs(float((b - a) / step)) for a, b in zip(*pair, strict=False)] for pair in pairs]
            assert [len(part) for part in changes[1:]] == [len(pair[0]) for pair in pairs[1:]], "the events differ"
            return Growth(*changes[1:], max(changes[0]))

    def _begin(self) -> None:
        """Make the equations, and place the initial state, unless it was done."""
        if self._system is not None:
            return
        self._levels = {stop: level for stop in (1, -1) if (level := self._level(stop)) is not None}
        self._restitutions = dict(zip((1, -1), map(real, self.restitution), strict=True))
        self._system = system = ContactSystem(self)
        start = self._initial()
        self._t = arb(0)
        self._y = system.coordinates(start)
        self._v = system.coordinates([real(v) for v in self.velocity or [0] * len(start)])
        for stop, level in self._levels.items():
            left, rate = (level - stop * self._y[system.place]).mid(), stop * self._v[system.place]
            if abs(left) <= arb(10) ** -self.digits * sum((abs(x) for x in self._y), abs(level)):
                left, self._y[system.place] = arb(0), stop * level
            if left < 0:
                raise ValueError(f"the initial state lies beyond the stop {stop}")
            if left == 0 and rate > 0:
                self._strike(stop)
            elif left == 0 and rate < 0:
                self._on, self._zeros = stop, 1
            elif left == 0:
                self._lie(stop)

    def _level(self, stop: int) -> arb | None:
        gap = self.gaps[0 if stop > 0 else 1]
        return None if gap is None or (isinstance(gap, float) and np.isinf(gap)) else real(gap)

    def _initial(self) -> list[arb]:
        """Return the initial displacements."""
        if self.displacement is not None:
            return [real(x) for x in self.displacement]
        bias, stiffness = [real(s) for s in self.bias or [0] * len(self.contact)], matrix_of(self.stiffness)
        here = [arb(0)] * len(bias)
        if any(s != 0 for s in bias):
            try:
                here = stiffness.solve(arb_mat([[s] for s in bias])).mid().entries()
            except ZeroDivisionError:
                raise ValueError("a free structure under a bias has no equilibrium to start from") from None
        contact = [real(h) for h in self.contact]
        q = sum((h * x for h, x in zip(contact, here, strict=True)), arb(0))
        for stop, level in self._levels.items():
            if stop * q > level:
                # q on the stop, and a force along h
                rows = [[*row, h] for row, h in zip(stiffness.tolist(), contact, strict=True)]
                rows.append([*contact, arb(0)])
                here = arb_mat(rows).solve(arb_mat([[s] for s in (*bias, stop * level)])).mid().entries()[:-1]
        return list(here)

    def _motion(self) -> arb_mat:
        return self._system.motion(self._y, self._v, real(self.omega) * self._t + real(self.phase))

    def _go_on(self, end: arb | None) -> None:
        """Go on to the next event, or by a step, but not beyond the end."""
        system, motion = self._system, self._motion()
        if self._held:
            flow, targets = system.held, [Target(-self._held, arb(0), self._zeros)]
        else:
            flow = system.free
            targets = [Target(s, level, self._zeros if s == self._on else 0) for s, level in self._levels.items()]
        event = flow.first_event(motion, targets)
        left = None if end is None else (end - self._t).mid()
        if event is not None and (left is None or flow.time_of(event) <= left):
            self._move(flow.within(motion, event.cell, event.after), self._t + flow.time_of(event))
            if self._held:
                self.releases.append(self._t)
                self._on, self._zeros, self._held = self._held, 3, 0
            else:
                stop = targets[event.target].sign
                self._y[system.place] = stop * self._levels[stop]
                self._strike(stop)
        elif left is not None and left <= flow.step:
            self._move(flow.after(motion, left), end)
        else:
            self._move(flow.whole_step(motion), self._t + flow.step)

    def _move(self, numbers: list[arb], time: arb) -> None:
        count = len(self._y)
        self._y, self._v, self._t = numbers[:count], numbers[count:], time.mid()
        self._on = self._zeros = 0

    def _strike(self, stop: int) -> None:
        """Record an impact on a stop, here and now, and change the velocities."""
        speed, restitution = self._v[self._system.place], self._restitutions[stop]
        self.times.append(self._t)
        self.stops.append(stop)
        self.speeds.append(speed)
        self._set_rate(-restitution * speed)
        if restitution == 0:
            self._lie(stop)
        elif restitution == 1 or not self._ends_chatter(stop, restitution):
            self._on, self._zeros = stop, 1

    def _set_rate(self, rate: arb) -> None:
        """Change the contact velocity, by an impulse along the stop."""
        change = rate - self._v[self._system.place]
        self._v = [(v + a * change).mid() for v, a in zip(self._v, self._system.jump, strict=True)]
        self._v[self._system.place] = rate.mid()

    def _ends_chatter(self, stop: int, restitution: arb) -> bool:
        """Come to rest if the bounces to come take next to no time; return whether it is so."""
        system, small = self._system, power_of_ten(-(self.digits // 2))
        speed = abs(self._v[system.place])
        if speed > small * system.free.unit * system.largest_acceleration(self._motion()):
            return False
        moving = self._v
        self._set_rate(arb(0))
        pressing, change = (stop * c for c in system.held.observed_terms(self._motion())[:2])
        if pressing > 0:
            # bounces take 2 speed / pressing, then R times as much, and so on; what is left out is its square
            tail = (2 * speed / (pressing * (1 - restitution))).mid()
            if tail < small * system.free.unit and tail / system.held.cell * abs(change) < small * pressing:
                self._rest(stop, self._t + tail, 0)
                return True
        self._v = moving
        return False

    def _lie(self, stop: int) -> None:
        """Start at rest on a stop: stay there, or leave."""
        held, motion = self._system.held, self._motion()
        terms, noise = held.observed_terms(motion), held.noise(motion)
        zeros = next((k for k, c in enumerate(terms) if abs(c) > noise), 0)
        if stop * terms[zeros] >= 0:
            self._rest(stop, self._t, zeros)
        else:
            self._on, self._zeros = stop, 2 + zeros

    def _rest(self, stop: int, time: arb, zeros: int) -> None:
        self.rests.append(time.mid())
        self.held_on.append(stop)
        self._held, self._on, self._zeros = stop, 0, zeros
