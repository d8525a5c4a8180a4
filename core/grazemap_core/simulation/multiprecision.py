"""Trajectories in multi-precision arithmetic, in closed form between impacts.

Between two impacts the contact coordinate, from the equilibrium, is a sum of exponentials, one for every mode and every
harmonic of the forces. The next contact is located in double precision: a bound on the acceleration shows that none is
missed. Its time is solved for at full precision. Where double precision does not show whether a stop is touched, full
precision decides. While the contact rests on a stop, the same search finds where the force on it falls through zero.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from flint import acb, acb_mat, arb, ctx
from scipy.optimize import brentq

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.stops import Clearance, both_clearances, unit_of_stops
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.multiprecision_modes import ModalMotion, MotionEquations, RunError
from grazemap_core.simulation.tolerances import (
    BOUNCE_ANGLE,
    CHATTER_BITS,
    COARSE_BITS,
    CONTACT_BRACKET,
    CONTACT_HALVINGS,
    CONTACT_NEWTON_STEPS,
    FINEST_ANGLE,
    IMPACT_BITS,
    LAST_IMPACTS,
    LONGEST_ANGLE,
    MODES_PER_IMPACT,
    MOST_RESTS,
    MOST_SUM_ROUNDING,
    SAME_BITS,
    SAMPLE_ANGLE,
    SAMPLE_PARTS,
    SAMPLES_AT_ONCE,
    SHORTEST_FLIGHT,
    SOLVED_BITS_LESS,
    SUM_ROUNDING,
)

TOO_CLOSE_TO_GRAZE = "an impact is too close to a graze"


class PreciseImpact(NamedTuple):
    """An impact, or the end of a chatter or of a rest."""

    stop: int
    """Stop of the event."""
    time: arb
    """Time of the event since the start of the run."""


class _PreciseContact(NamedTuple):
    """A contact."""

    stop: int
    """Stop of the contact."""
    time: arb
    """Time of the contact since the origin."""
    exponentials: acb_mat
    """The exponentials at the contact."""


class _Flight(NamedTuple):
    """What is observed since the origin, in double precision.

    It is q while q is free. While q is held on a stop, it is minus the acceleration that q would have if released.
    """

    terms: list[Complexes]
    """The terms of `ModalMotion`."""
    bend: float
    """Bound of the second derivative of what is observed."""
    rounding: float
    """Rounding of what is observed."""
    left: int
    """The stop that the contact has just left, or 0."""
    start: float
    """Time before which there is no contact with the stop `left`."""


class MultiprecisionRun:
    """A trajectory of an oscillator from a given state.

    All numbers are taken as they are stored, as in `MotionEquations`.

    Attributes
    ----------
    bits : int
        Precision of the arithmetic at the start.
    work : int
        Measure of the time taken so far: bits + IMPACT_BITS for every impact, and N^3/MODES_PER_IMPACT times as much
        for the modes.
    period : float
        The forcing period.
    impacts : list of PreciseImpact
        All impacts so far but those that follow another on the same stop within SHORTEST_FLIGHT; also the ends of
        chatters and of rests.
    states : list of (2, N)
        Displacements and velocities at the starts of the forcing periods so far.
    ended : str
        Why the run cannot be continued; empty if it can.
    """

    def __init__(
        self, oscillator: Oscillator, omega: float, clearance: Clearance, state: Floats | None, phase: float, bits: int
    ) -> None:
        """Start from displacements and velocities (2, N), or from rest in equilibrium, at a phase of the forcing.

        Raises RunError.
        """
        self.bits, self.period, self.ended = bits, 2.0 * math.pi / omega, ""
        self._bits, self.work = bits, oscillator.size**3 // MODES_PER_IMPACT * (bits + IMPACT_BITS)
        self.impacts, self._rests = list[PreciseImpact](), 0
        with ctx.workprec(bits):
            self._equations = equations = MotionEquations(oscillator)
            self._restitution = {stop: arb(oscillator.restitution_of(stop)) for stop in (1, -1)}
            self._omega, self._phase, self._length = arb(omega), arb(phase), (2 * arb.pi() / arb(omega)).mid()
            clearances = zip((1, -1), both_clearances(clearance), strict=True)
            self._gaps = {
                stop: (c - stop * equations.contact_equilibrium).mid() for stop, c in clearances if math.isfinite(c)
            }
            self._modes = self._free_modes = equations.free(self._omega)
            self._held_modes = dict[int, ModalMotion]()
            self._set_regime(0)
            start = equations.from_equilibrium(state)
            size = oscillator.size
            self._require_between(*(equations.contact_of(part) for part in (start[:size], start[size:])))
            amplitudes = self._free_modes.amplitudes(start, self._phase)
        self._equilibrium = np.array([[float(x) for x in equations.equilibrium], [0.0] * size])
        self.states = [self._equilibrium if state is None else state]
        self._begin(arb(0), amplitudes, 0, 0.0)

    def _require_between(self, place: arb, velocity: arb) -> None:
        """Raise RunError unless the contact starts between the stops, or moves away from one."""
        for stop, gap in self._gaps.items():
            if not stop * place < gap and not (stop * place == gap and stop * velocity < 0):
                raise RunError("the contact starts on a stop or beyond it")

    def _set_regime(self, held: int) -> None:
        """Go on with the contact free, or held on a stop."""
        self._held_stop = held
        if held and held not in self._held_modes:
            self._held_modes[held] = self._equations.held(self._omega, held * self._gaps[held])
        self._modes = self._held_modes[held] if held else self._free_modes
        self._levels = {held: arb(0)} if held else self._gaps
        self._distances = {stop: float(gap) for stop, gap in self._levels.items()}
        self._grid = SAMPLE_ANGLE / self._modes.fastest * np.arange(SAMPLES_AT_ONCE + 1)
        self._longest = LONGEST_ANGLE / self._modes.fastest + 2.0 * float(self._grid[-1])
        self._table = np.exp(np.outer(self._grid, self._modes.rates))

    def reduce(self, bits: int) -> None:
        """Continue with so many bits if these are fewer, as where an error has reached the other ones."""
        self._bits = min(bits, self._bits)
        with ctx.workprec(self._bits):
            for modes in (self._free_modes, *self._held_modes.values()):
                modes.reduce()

    def run(self, periods: int) -> None:
        """Continue until so many forcing periods after the start, if possible."""
        with ctx.workprec(self._bits):
            while len(self.states) <= periods and not self.ended:
                try:
                    self._advance()
                except RunError as error:
                    self.ended = str(error)

    def _advance(self) -> None:
        """Continue to the next impact or release or to the end of the forcing period, whichever is first."""
        end = self._length * len(self.states) - self._time
        while self._contact is None and self._searched <= float(end):
            self._search()
            end = self._length * len(self.states) - self._time
        if self._contact is not None and self._contact.time < end:
            (self._release if self._held_stop else self._impact)(self._contact)
            return
        with ctx.workprec(COARSE_BITS):
            state = self._modes.state(self._exponentials(end))
            self.states.append(self._equilibrium + np.array([float(x) for x in state]).reshape(2, -1))

    def _begin(self, time: arb, amplitudes: list[acb], left: int, away: float, order: int = 1) -> None:
        """Move the origin of the exponentials; the contact may just have left a stop.

        The derivative of q of this order, the first that is not 0, then has the modulus `away`.
        """
        self._time, self._amplitudes, self._searched = time, amplitudes, 0.0
        self._contact: _PreciseContact | None = None
        modes = self._modes
        terms = modes.terms(amplitudes, self._longest)
        bounds = modes.bounds(terms, self._longest)
        place, bend = bounds[0], bounds[2]
        right, other = (self._distances.get(stop, math.inf) for stop in (1, -1))
        if SUM_ROUNDING * place > MOST_SUM_ROUNDING * float(unit_of_stops(right, other, place)):
            raise RunError("double precision does not locate the contacts, as near an undamped resonance")
        self._flight = _Flight(terms, bend, SUM_ROUNDING * place, left, away / bounds[order + 1])
        if left and order == 1:
            self._contact = self._bounce(left, float(bounds[3]))

    def _bounce(self, stop: int, change: float) -> _PreciseContact | None:
        """Return the next contact with the stop that was just left, if velocity and acceleration decide it.

        `change` bounds the third derivative of q.
        """
        _, speed, bend = self._motion(arb(0))
        toward = stop * bend
        if not toward > 0:
            return None
        near = (-2 * stop * speed / toward).mid()
        space = sum(self._distances.values()) if len(self._distances) == 2 else math.inf
        if float(near) * self._modes.fastest > BOUNCE_ANGLE or 4.0 * float(near) * change > float(toward):
            return None
        return self._refine(near, near, stop) if 2.0 * float(speed * speed / toward) < space else None

    def _exponentials(self, time: arb) -> acb_mat:
        """Return the values of the exponentials a time after the origin."""
        return self._modes.after(time, self._amplitudes)

    def _motion(self, time: arb) -> list[arb]:
        """Return what is observed, and its first two derivatives, a time after the origin."""
        return [x.real.mid() for x in (self._modes.outputs * self._exponentials(time)).entries()]

    def _impact(self, contact: _PreciseContact) -> None:
        """Go to the state after an impact."""
        stop, time, before = contact
        now, restitution = (self._time + time).mid(), self._restitution[stop]
        speed = (self._free_modes.outputs * before)[1, 0].real
        jump = (1 + restitution) * speed
        after = [(a - kick * jump).mid() for a, kick in zip(before.entries(), self._free_modes.kicks, strict=True)]
        chatters = stop == self._flight.left and float(time) < SHORTEST_FLIGHT * self.period
        if not chatters:
            self.impacts.append(PreciseImpact(stop, now))
        self.work += self._bits + IMPACT_BITS
        if restitution == 0 or (chatters and time < self.period * arb(2) ** -int(CHATTER_BITS * self._bits)):
            self._rest(stop, now, after)
        else:
            self._begin(now, after, stop, abs(float(restitution * speed)))

    def _rest(self, stop: int, time: arb, amplitudes: list[acb]) -> None:
        """Come to rest on a stop at the end of a chatter, or after an impact without rebound, if pressed against it."""
        restitution, equations = self._restitution[stop], self._equations
        values = acb_mat([amplitudes]).transpose()
        speed, state = (self._free_modes.outputs * values)[1, 0].real, self._free_modes.state(values)
        size, off = len(equations.contact), equations.contact_of
        for part, value in ((0, stop * self._gaps[stop]), (size, arb(0))):
            moved = value - off(state[part : part + size])
            for i, a in enumerate(equations.jump):
                state[part + i] = (state[part + i] + a * moved).mid()
        angle = (self._omega * time + self._phase).mid()
        self._set_regime(stop)
        held = self._modes.amplitudes(state, angle)
        pressing = -stop * (self._modes.outputs * acb_mat([held]).transpose())[0, 0].real
        if pressing > 0 and restitution < 1:
            rest = time + 2 * abs(speed) / (pressing * (1 - restitution))
            self.impacts.append(PreciseImpact(stop, rest.mid()))
            self._rests += 1
            if self._rests > MOST_RESTS:
                raise RunError("the contact comes to rest on a stop again and again")
            self._begin(time, held, 0, 0.0)
            return
        if restitution > 0 or not pressing < 0:
            raise RunError("a chatter is incomplete")
        self._set_regime(0)
        self._begin(time, self._free_modes.amplitudes(state, angle), stop, -float(pressing), 2)

    def _release(self, contact: _PreciseContact) -> None:
        """Leave a stop on which the contact rested."""
        stop, time, values = contact
        now = (self._time + time).mid()
        slope = stop * (self._modes.outputs * values)[1, 0].real
        state = self._modes.state(values)
        if not slope > 0:
            raise RunError("a rest ends with a force that hardly changes")
        self.impacts.append(PreciseImpact(stop, now))
        self._set_regime(0)
        angle = (self._omega * now + self._phase).mid()
        self._begin(now, self._free_modes.amplitudes(state, angle), stop, float(slope), 3)

    def _search(self) -> None:
        """Find the first contact among the next samples, or go past them."""
        times = np.asarray(self._searched + self._grid, dtype=np.float64)
        turned = np.exp(self._modes.rates * self._searched)
        parts = [(self._table @ (terms[:2] * turned).T).real for terms in self._flight.terms]
        motion = _polynomial(times[:, None], parts)
        near = self._first_among(times, motion)
        self._searched = float(times[-1])
        if near is not None:
            self._contact = self._solve(*near)
        elif self._searched * self._modes.fastest > LONGEST_ANGLE:
            moved = arb(self._searched)
            self._begin((self._time + moved).mid(), self._exponentials(moved).entries(), 0, 0.0)

    def _first_among(self, times: Floats, motion: Floats) -> tuple[arb, int] | None:
        """Return the approximate time and the stop of the first contact among samples of displacement and velocity."""
        gaps = np.min([gap - stop * motion[:, 0] for stop, gap in self._distances.items()], axis=0)
        near = gaps <= self._margin(times[1] - times[0])
        for i in np.flatnonzero(near[:-1] | near[1:]):
            times_of_stops = [
                (self._contact_between(stop, times[i : i + 2], motion[i : i + 2]), stop) for stop in self._levels
            ]
            contacts = [(time, stop) for time, stop in times_of_stops if time is not None]
            if contacts:
                return min(contacts, key=lambda contact: float(contact[0]))
        return None

    def _margin(self, width: float) -> float:
        """Return by how much the gap may be smaller between two samples than at them."""
        return self._flight.bend * width * width / 8.0 + self._flight.rounding

    def _contact_between(self, stop: int, times: Floats, motion: Floats) -> arb | None:
        """Return the approximate time of the first contact with a stop between two samples; None if there is none."""
        flight, width = self._flight, times[1] - times[0]
        low, high = max(times[0], flight.start) if stop == flight.left else times[0], times[1]
        gaps, slopes = self._distances[stop] - stop * motion[:, 0], -stop * motion[:, 1]
        if high <= low or gaps.min() > self._margin(width):
            return None
        if gaps[0] > flight.rounding and gaps[1] < -flight.rounding and slopes.max() + 0.5 * flight.bend * width < 0.0:
            return arb(brentq(self._gap, low, high, (stop,), xtol=CONTACT_BRACKET * high, rtol=CONTACT_BRACKET))
        if width * self._modes.fastest < FINEST_ANGLE:
            return self._decide(stop, low, high)
        parts = np.linspace(low, high, SAMPLE_PARTS + 1)
        table = np.exp(np.outer(parts, self._modes.rates))
        motion = _polynomial(parts[:, None], [(table @ terms[:2].T).real for terms in flight.terms])
        contact = self._first_among(parts, motion)
        return contact[0] if contact is not None and contact[1] == stop else None

    def _gap(self, time: float, stop: int) -> float:
        turned, total = np.exp(self._modes.rates * time), 0.0
        for terms in reversed(self._flight.terms):
            total = total * time + float((turned @ terms[0]).real)
        return self._distances[stop] - stop * total

    def _decide(self, stop: int, low: float, high: float) -> arb | None:
        """Return the approximate time of a contact in a very short interval, by full precision; None if there is none.

        The interval is widened by twice its length on both sides. Raises RunError.
        """
        width, left = 2.0 * (high - low), self._flight.start if stop == self._flight.left else 0.0
        begin, end, gap = arb(max(low - width, left)), arb(high + width), self._levels[stop]
        slowest = self._extremum((begin + end) / 2, 2.0 * width)
        if slowest is not None and begin < slowest and slowest < end:
            place, _, bend = self._motion(slowest)
            if stop * bend > 0:
                raise RunError(TOO_CLOSE_TO_GRAZE)
            over = stop * place - gap
            return slowest - (2 * over / abs(bend)).sqrt().mid() if over > 0 else None
        beyond = [bool(stop * self._motion(time)[0] >= gap) for time in (begin, end)]
        if beyond != [False, True]:
            return None
        for _ in range(CONTACT_HALVINGS):
            middle = ((begin + end) / 2).mid()
            begin, end = (begin, middle) if stop * self._motion(middle)[0] >= gap else (middle, end)
        return end

    def _extremum(self, near: arb, width: float) -> arb | None:
        """Return the time at which the velocity vanishes, by Newton's method; None if it does not within `width`.

        Raises RunError where the method does not converge.
        """
        time = near.mid()
        if not abs(self._motion(time)[1]) <= 2.0 * width * self._flight.bend:
            return None
        for _ in range(CONTACT_NEWTON_STEPS):
            _, speed, bend = self._motion(time)
            step = (speed / bend).mid()
            time = (time - step).mid()
            if not abs(step) < 1.0 / self._modes.fastest:
                break
            if abs(step) < self._accuracy:
                return time
        raise RunError(TOO_CLOSE_TO_GRAZE)

    @property
    def _accuracy(self) -> arb:
        return arb(2) ** (SOLVED_BITS_LESS - self._bits) / self._modes.fastest

    def _solve(self, near: arb, stop: int) -> _PreciseContact:
        """Return the contact near a time, by Newton's method with more and more bits."""
        time, place = near, stop * self._levels[stop]
        for halved in range((self._bits // COARSE_BITS).bit_length() - 1, 0, -1):
            with ctx.workprec(self._bits >> halved):
                here, speed, _ = self._motion(time)
                time = (time - (here - place) / speed).mid()
        return self._refine(time, near, stop)

    def _refine(self, time: arb, near: arb, stop: int) -> _PreciseContact:
        """Return the contact near a time, by Newton's method at full precision."""
        values, place = self._exponentials(time), stop * self._levels[stop]
        for _ in range(CONTACT_NEWTON_STEPS):
            here, speed, bend = (x.real for x in (self._modes.outputs * values).entries())
            step = ((place - here) / speed).mid()
            time = (time + step).mid()
            values = self._modes.after(step, values.entries())
            if not abs(time - near) < FINEST_ANGLE / self._modes.fastest:
                break
            if abs(step * step * bend / speed) < self._accuracy:
                return _PreciseContact(stop, time, values)
        raise RunError(TOO_CLOSE_TO_GRAZE)


def _polynomial(time: Any, parts: list[Any]) -> Any:
    """Return the sum of parts times powers of time, from the power 0."""
    total = parts[-1]
    for part in parts[-2::-1]:
        total = total * time + part
    return total


def same_impacts(run: MultiprecisionRun, other: MultiprecisionRun) -> bool:
    """Return whether two runs have the same impacts, and can or cannot be continued for the same reason."""
    if len(run.impacts) != len(other.impacts) or run.ended != other.ended:
        return False
    apart, pairs = 2.0**-SAME_BITS * run.period, zip(run.impacts, other.impacts, strict=True)
    return all(a.stop == b.stop and bool(abs(a.time - b.time) < apart) for a, b in pairs)


def known_bits(run: MultiprecisionRun, other: MultiprecisionRun) -> float:
    """Return to how many bits of a forcing period the last of the same impacts of two runs agree."""
    pairs = zip(run.impacts[-LAST_IMPACTS:], other.impacts[-LAST_IMPACTS:], strict=True)
    with ctx.workprec(COARSE_BITS):
        apart = [abs(a.time - b.time) / run.period for a, b in pairs]
        return min((-float(x.log()) / math.log(2.0) for x in apart if x != 0), default=math.inf)
