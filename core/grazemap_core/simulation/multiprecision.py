"""Trajectories in multi-precision arithmetic, in closed form between impacts.

Between two impacts the displacement of mass 1 is a sum of exponentials, one for every mode and one for the forcing.
The next contact is located in double precision: a bound on the acceleration shows that none is missed. Its time is
solved for in all bits. Where double precision does not show whether mass 1 touches a stop, all bits decide.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from flint import acb, acb_mat, arb, ctx
from scipy.optimize import brentq

from grazemap_core.arrays import Floats
from grazemap_core.model.oscillator import Oscillator

SAMPLES = 128
"""Samples of the motion that are taken at once."""
SAMPLE_ANGLE = 0.1
"""Time between two of them, times the largest modulus of an exponent."""
PARTS = 16
"""Number of parts into which an interval between samples is divided where a contact is possible."""
FINEST_ANGLE = 1e-6
"""The same time below which all bits decide: the gap then differs from a straight line by less than `ROUNDING`."""
ROUNDING = 1e-13
"""Error of a displacement in double precision, in units of the sum of the moduli of its terms."""
MOST_ROUNDING = 1e-3
"""Limit of this error, in units of the clearance, above which too many contacts would be possible."""
LONGEST_ANGLE = 100.0
"""Time since the origin of the exponentials, in the same units, after which the origin moves."""
HALVINGS = 20
"""Number of halvings of such a short interval around a slow impact, before Newton's method."""
NEWTON_STEPS = 60
"""Maximum number of steps of Newton's method; it needs many only beside a graze."""
SPARE_BITS = 24
"""Bits by which a solved time may be less accurate than the arithmetic."""
FIRST_BITS = 128
"""Precision of the first step of Newton's method, and of states that are rounded to double precision."""
SHORTEST_FLIGHT = 1e-6
"""Time between two impacts on one stop, in forcing periods, below which mass 1 is taken to come to rest on it."""
SAME_BITS = 60
"""Impacts whose times differ by less than 2^-SAME_BITS forcing periods are the same."""
LAST_IMPACTS = 8
"""Number of last impacts that show to how many bits a run is known."""
IMPACT_BITS = 1000
"""Bits that count in addition for every impact, for the work that does not depend on the precision."""
MODES_PER_IMPACT = 9
"""N^3 over this is the number of impacts that take as long as computing the modes of N masses."""

TOO_SLOW = "an impact is too close to a graze"


class RunError(Exception):
    """A run cannot be continued; says why."""


class Impact(NamedTuple):
    """The stop and the time of an impact."""

    stop: int
    time: arb


class _Contact(NamedTuple):
    """A contact: its stop, its time since the origin, and the exponentials there."""

    stop: int
    time: arb
    exponentials: acb_mat


class _Flight(NamedTuple):
    """The motion of mass 1 since the origin, in double precision.

    `terms` (3, m) are the terms of displacement, velocity and acceleration at the origin. A bound on the acceleration
    and the rounding of the displacement follow from them. Until `start` mass 1 moves away from the stop `left`.
    """

    terms: Floats
    bend: float
    rounding: float
    left: int
    start: float


class MultiprecisionRun:
    """A trajectory of an oscillator from a given state.

    All numbers are taken as they are stored, in binary; proportional damping is 2 gamma K without rounding.

    Attributes
    ----------
    bits : int
        Precision of the arithmetic at the start.
    work : int
        Impacts times bits so far, a measure of the time that they took.
    period : float
        The forcing period.
    impacts : list of Impact
        The impacts so far.
    states : list of (2, N)
        Displacements and velocities at the starts of the forcing periods so far.
    ended : str
        Why the run cannot be continued; empty if it can.
    """

    def __init__(
        self, oscillator: Oscillator, omega: float, clearance: float, state: Floats, phase: float, bits: int
    ) -> None:
        """Start from displacements and velocities (2, N) at a phase of the forcing. Raises RunError."""
        self.bits, self.period, self.ended = bits, 2.0 * math.pi / omega, ""
        self._bits, self.work = bits, oscillator.size**3 // MODES_PER_IMPACT * (bits + IMPACT_BITS)
        self.impacts, self.states = list[Impact](), [state]
        self._clearance = clearance
        if abs(state[0, 0]) >= clearance and state[0, 0] * state[1, 0] >= 0.0:
            raise RunError("mass 1 starts on a stop")
        with ctx.workprec(bits):
            self._restitution = arb(oscillator.restitution)
            self._length = (2 * arb.pi() / arb(omega)).mid()
            self._set_modes(oscillator, arb(omega), state, arb(phase))
        self._rates = np.array([complex(x) for x in self._exponents])
        self._fastest = float(np.abs(self._rates).max())
        self._rows = np.array([[complex(x) for x in row] for row in self._outputs.tolist()])
        self._grid = SAMPLE_ANGLE / self._fastest * np.arange(SAMPLES + 1)
        self._table = np.exp(np.outer(self._grid, self._rates))
        self._begin(arb(0), self._amplitudes, 0, 0.0)

    def _set_modes(self, oscillator: Oscillator, omega: arb, state: Floats, phase: arb) -> None:
        """Set the exponentials: exponents, amplitudes, changes by a unit velocity of mass 1, and vectors.

        Of two complex conjugate modes the one with the positive imaginary part counts twice, and real parts are taken.
        """
        n = oscillator.size
        exponents, vectors = _modes(oscillator)
        steady, turning = _steady_state(oscillator, omega), acb(0, phase).exp()
        free = [[arb(x) - (s * turning).real] for x, s in zip(state.ravel().tolist(), steady, strict=True)]
        inverse = vectors.inv()
        amplitudes = (inverse * acb_mat(free)).entries()
        real = [bool(abs(x.imag) < abs(x) * arb(2) ** (-self.bits // 2)) for x in exponents]
        chosen = [(j, 1 if real[j] else 2) for j, x in enumerate(exponents) if real[j] or x.imag > 0]
        self._exponents = [exponents[j].mid() for j, _ in chosen] + [acb(0, omega)]
        self._amplitudes = [(weight * amplitudes[j]).mid() for j, weight in chosen] + [turning.mid()]
        self._kicks = [(weight * inverse[j, n]).mid() for j, weight in chosen] + [acb(0)]
        columns = [[vectors[i, j] for i in range(2 * n)] for j, _ in chosen] + [steady]
        self._vectors = acb_mat(columns).transpose().mid()
        pairs = list(zip(columns, self._exponents, strict=True))
        self._outputs = acb_mat([[c[0] * x**order for c, x in pairs] for order in range(3)]).mid()

    def reduce(self, bits: int) -> None:
        """Continue with so many bits if these are fewer: what an error has reached need not be computed on."""
        self._bits = min(bits, self._bits)
        with ctx.workprec(self._bits):
            self._exponents, self._kicks = ([(+x).mid() for x in row] for row in (self._exponents, self._kicks))
            self._vectors, self._outputs = (
                acb_mat([[(+x).mid() for x in row] for row in table.tolist()])
                for table in (self._vectors, self._outputs)
            )

    def run(self, periods: int) -> None:
        """Continue until so many forcing periods after the start, if possible."""
        with ctx.workprec(self._bits):
            while len(self.states) <= periods and not self.ended:
                try:
                    self._go_on()
                except RunError as error:
                    self.ended = str(error)

    def _go_on(self) -> None:
        """Continue to the next impact or to the end of the forcing period, whichever is first."""
        end = self._length * len(self.states) - self._time
        while self._contact is None and self._searched <= float(end):
            self._search()
            end = self._length * len(self.states) - self._time
        if self._contact is not None and self._contact.time < end:
            self._strike(self._contact)
            return
        with ctx.workprec(FIRST_BITS):
            state = self._vectors * self._exponentials(end)
            self.states.append(np.array([float(x.real) for x in state.entries()]).reshape(2, -1))

    def _begin(self, time: arb, amplitudes: list[acb], left: int, speed: float) -> None:
        """Move the origin of the exponentials; mass 1 may just have left a stop with a speed."""
        self._time, self._amplitudes, self._searched = time, amplitudes, 0.0
        self._contact: _Contact | None = None
        terms = self._rows * np.array([complex(a) for a in amplitudes])
        place, _, bend = np.abs(terms).sum(axis=1)  # the exponentials do not grow
        if ROUNDING * place > MOST_ROUNDING * self._clearance:
            raise RunError("double precision does not locate the contacts, as near an undamped resonance")
        self._flight = _Flight(terms, bend, ROUNDING * place, left, speed / bend)

    def _exponentials(self, time: arb) -> acb_mat:
        """Return the values of the exponentials a time after the origin."""
        pairs = zip(self._exponents, self._amplitudes, strict=True)
        return acb_mat([[((x * time).exp() * a).mid()] for x, a in pairs])

    def _motion(self, time: arb) -> list[arb]:
        """Return displacement, velocity and acceleration of mass 1 a time after the origin."""
        return [x.real.mid() for x in (self._outputs * self._exponentials(time)).entries()]

    def _strike(self, contact: _Contact) -> None:
        """Go to the state after an impact."""
        stop, time, before = contact
        if stop == self._flight.left and float(time) < SHORTEST_FLIGHT * self.period:
            raise RunError("mass 1 comes to rest on a stop")
        speed = (self._outputs * before)[1, 0].real
        jump = (1 + self._restitution) * speed
        after = [(a - kick * jump).mid() for a, kick in zip(before.entries(), self._kicks, strict=True)]
        self.impacts.append(Impact(stop, (self._time + time).mid()))
        self.work += self._bits + IMPACT_BITS
        self._begin(self.impacts[-1].time, after, stop, abs(float(self._restitution * speed)))

    def _search(self) -> None:
        """Find the first contact among the next samples, or go past them."""
        times = np.asarray(self._searched + self._grid, dtype=np.float64)
        motion = (self._table @ (self._flight.terms[:2] * np.exp(self._rates * self._searched)).T).real
        near = self._among(times, motion)
        self._searched = float(times[-1])
        if near is not None:
            self._contact = self._solved(*near)
        elif self._searched * self._fastest > LONGEST_ANGLE:
            moved = arb(self._searched)
            self._begin((self._time + moved).mid(), self._exponentials(moved).entries(), 0, 0.0)

    def _among(self, times: Floats, motion: Floats) -> tuple[arb, int] | None:
        """Return about the time, and the stop, of the first contact among samples of displacement and velocity."""
        gaps = self._clearance - np.abs(motion[:, 0])
        near = gaps <= self._margin(times[1] - times[0])
        for i in np.flatnonzero(near[:-1] | near[1:]):
            found = [self._of_stop(stop, times[i : i + 2], motion[i : i + 2]) for stop in (1, -1)]
            contacts = [(time, stop) for time, stop in zip(found, (1, -1), strict=True) if time is not None]
            if contacts:
                return min(contacts, key=lambda contact: float(contact[0]))
        return None

    def _margin(self, width: float) -> float:
        """Return by how much the gap may be smaller between two samples than at them."""
        return self._flight.bend * width * width / 8.0 + self._flight.rounding

    def _of_stop(self, stop: int, times: Floats, motion: Floats) -> arb | None:
        """Return about the time of the first contact with a stop between two samples."""
        flight, width = self._flight, times[1] - times[0]
        low, high = max(times[0], flight.start) if stop == flight.left else times[0], times[1]
        gaps, slopes = self._clearance - stop * motion[:, 0], -stop * motion[:, 1]
        if high <= low or gaps.min() > self._margin(width):
            return None
        if gaps[0] > flight.rounding and gaps[1] < -flight.rounding and slopes.max() + 0.5 * flight.bend * width < 0.0:
            return arb(brentq(self._gap, low, high, (stop,), xtol=1e-15 * high, rtol=1e-15))
        if width * self._fastest < FINEST_ANGLE:
            return self._decided(stop, low, high)
        parts = np.linspace(low, high, PARTS + 1)
        contact = self._among(parts, (np.exp(np.outer(parts, self._rates)) @ flight.terms[:2].T).real)
        return contact[0] if contact is not None and contact[1] == stop else None

    def _gap(self, time: float, stop: int) -> float:
        return self._clearance - stop * float((np.exp(self._rates * time) @ self._flight.terms[0]).real)

    def _decided(self, stop: int, low: float, high: float) -> arb | None:
        """Return about the time of a contact in a very short interval, found in all bits; or None."""
        width, left = 2.0 * (high - low), self._flight.start if stop == self._flight.left else 0.0
        begin, end = arb(max(low - width, left)), arb(high + width)
        slowest = self._extremum((begin + end) / 2, 2.0 * width)
        if slowest is not None and begin < slowest and slowest < end:
            place, _, bend = self._motion(slowest)
            if stop * bend > 0:
                raise RunError(TOO_SLOW)
            over = stop * place - self._clearance
            return slowest - (2 * over / abs(bend)).sqrt().mid() if over > 0 else None
        beyond = [bool(stop * self._motion(time)[0] >= self._clearance) for time in (begin, end)]
        if beyond != [False, True]:
            return None
        for _ in range(HALVINGS):
            middle = ((begin + end) / 2).mid()
            begin, end = (begin, middle) if stop * self._motion(middle)[0] >= self._clearance else (middle, end)
        return end

    def _extremum(self, near: arb, width: float) -> arb | None:
        """Return the time at which the velocity vanishes, by Newton's method; None if it does not within `width`."""
        time = near.mid()
        if not abs(self._motion(time)[1]) <= 2.0 * width * self._flight.bend:
            return None
        for _ in range(NEWTON_STEPS):
            _, speed, bend = self._motion(time)
            step = (speed / bend).mid()
            time = (time - step).mid()
            if not abs(step) < 1.0 / self._fastest:
                break
            if abs(step) < self._accuracy:
                return time
        raise RunError(TOO_SLOW)

    @property
    def _accuracy(self) -> arb:
        return arb(2) ** (SPARE_BITS - self._bits) / self._fastest

    def _solved(self, near: arb, stop: int) -> _Contact:
        """Return the contact at about a time, by Newton's method with more and more bits."""
        time, place = near, stop * arb(self._clearance)
        for halved in range((self._bits // FIRST_BITS).bit_length() - 1, 0, -1):
            with ctx.workprec(self._bits >> halved):
                here, speed, _ = self._motion(time)
                time = (time - (here - place) / speed).mid()
        values = self._exponentials(time)
        for _ in range(NEWTON_STEPS):
            here, speed, bend = (x.real for x in (self._outputs * values).entries())
            step = ((place - here) / speed).mid()
            time = (time + step).mid()
            pairs = zip(values.entries(), self._exponents, strict=True)
            values = acb_mat([[(value * (x * step).exp()).mid()] for value, x in pairs])
            if not abs(time - near) < FINEST_ANGLE / self._fastest:
                break
            if abs(step * step * bend / speed) < self._accuracy:
                return _Contact(stop, time, values)
        raise RunError(TOO_SLOW)


def same_impacts(one: MultiprecisionRun, other: MultiprecisionRun) -> bool:
    """Return whether two runs have the same impacts, and can or cannot be continued for the same reason."""
    if len(one.impacts) != len(other.impacts) or one.ended != other.ended:
        return False
    apart, pairs = 2.0**-SAME_BITS * one.period, zip(one.impacts, other.impacts, strict=True)
    return all(a.stop == b.stop and bool(abs(a.time - b.time) < apart) for a, b in pairs)


def known_bits(one: MultiprecisionRun, other: MultiprecisionRun) -> float:
    """Return to how many bits of a forcing period the last of the same impacts of two runs agree."""
    pairs = zip(one.impacts[-LAST_IMPACTS:], other.impacts[-LAST_IMPACTS:], strict=True)
    with ctx.workprec(FIRST_BITS):
        apart = [abs(a.time - b.time) / one.period for a, b in pairs]
        return min((-float(x.log()) / math.log(2.0) for x in apart if x != 0), default=math.inf)


def _chain_matrix(links: Sequence[arb]) -> acb_mat:
    """Return the tridiagonal matrix of a chain whose last link goes to ground."""
    size = len(links)
    matrix = acb_mat(size, size)
    for i, link in enumerate(links):
        matrix[i, i] = matrix[i, i] + link
        if i + 1 < size:
            matrix[i + 1, i + 1] = link
            matrix[i, i + 1] = matrix[i + 1, i] = -link
    return matrix


def _matrices(oscillator: Oscillator) -> tuple[list[arb], acb_mat, acb_mat]:
    """Return the masses, the damping matrix and the stiffness matrix."""
    stiffness = [arb(k) for k in oscillator.stiffnesses.tolist()]
    links = [arb(c) for c in oscillator.link_damping.tolist()]
    if oscillator.gamma is not None:
        links = [2 * arb(oscillator.gamma) * k for k in stiffness]
    return [arb(m) for m in oscillator.masses.tolist()], _chain_matrix(links), _chain_matrix(stiffness)


def _modes(oscillator: Oscillator) -> tuple[list[acb], acb_mat]:
    """Return the exponents of the free motion, and the displacements and velocities of the modes in columns."""
    masses, damping, stiffness = _matrices(oscillator)
    n = oscillator.size
    whole = acb_mat(2 * n, 2 * n)
    for i, mass in enumerate(masses):
        whole[i, n + i] = 1
        for j in range(n):
            whole[n + i, j], whole[n + i, n + j] = -stiffness[i, j] / mass, -damping[i, j] / mass
    try:
        exponents, vectors = whole.eig(right=True)
    except ValueError:
        raise RunError("two modes have the same exponent") from None
    return list(exponents), vectors


def _steady_state(oscillator: Oscillator, omega: arb) -> list[acb]:
    """Return displacements and velocities of the steady motion, of which the imaginary part counts, times -i."""
    masses, damping, stiffness = _matrices(oscillator)
    dynamic = stiffness + damping * acb(0, omega)
    for i, mass in enumerate(masses):
        dynamic[i, i] = dynamic[i, i] - omega * omega * mass
    try:
        amplitudes = dynamic.solve(acb_mat([[acb(f)] for f in oscillator.forcing.tolist()])).entries()
    except ZeroDivisionError:
        raise RunError("there is no steady motion") from None
    return [x * acb(0, -1) for x in amplitudes] + [x * omega for x in amplitudes]
