"""One mass between two stops in 30-digit arithmetic, in closed form between impacts, for runs of thousands of periods.

It shares nothing with the core: damped sines of the one mass, contacts looked for on a grid and at the extrema between
grid points, and refined by Newton's method in python-flint's 110 bits. An exponent comes from two trajectories that
start 1e-15 apart and are brought back to that distance every period; no derivative is formed.
"""

from __future__ import annotations

import numpy as np
from flint import arb, ctx

BITS = 110


class ChaosOracle:
    """m x'' + c x' + k x = f sin(omega t), |x| < b, v -> -R v; all numbers taken exactly as given."""

    def __init__(self, oscillator, omega: float, clearance: float) -> None:  # type: ignore[no-untyped-def]
        ctx.prec = BITS
        m, k, c, f = (
            arb(float(a[0]))
            for a in (oscillator.masses, oscillator.stiffnesses, oscillator.link_damping, oscillator.forcing)
        )
        self.restitution, self.omega, self.clearance = arb(oscillator.restitution), arb(omega), arb(clearance)
        self.eta = c / (2 * m)
        self.wd = (k / m - self.eta**2).sqrt()
        real, imaginary = k - self.omega**2 * m, self.omega * c
        size = real**2 + imaginary**2
        self.sine, self.cosine = f * real / size, -f * imaginary / size  # of omega t
        self.period = 2 * arb.pi() / self.omega
        self.impacts = 0
        self._grid = np.linspace(0.0, 1.0, 129)

    def _forced(self, t: arb) -> tuple[arb, arb]:
        s, c = (self.omega * t).sin(), (self.omega * t).cos()
        return self.sine * s + self.cosine * c, self.omega * (self.sine * c - self.cosine * s)

    def _flow(self, x: arb, v: arb, begin: arb, time: arb) -> tuple[arb, arb]:
        """Position and velocity a time after `begin`; midpoints only, as in any other arithmetic."""
        forced, rate = self._forced(begin)
        a, p = x - forced, v - rate
        b = (p + self.eta * a) / self.wd
        e, c, s = (-self.eta * time).exp(), (self.wd * time).cos(), (self.wd * time).sin()
        forced, rate = self._forced(begin + time)
        free = e * (a * c + b * s)
        return (free + forced).mid(), (e * self.wd * (b * c - a * s) - self.eta * free + rate).mid()

    def _curves(self, x: arb, v: arb, begin: arb, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same in double precision on a grid, to know where to look."""
        eta, wd, w, t0 = float(self.eta), float(self.wd), float(self.omega), float(begin)
        forced, rate = (float(q) for q in self._forced(begin))
        a = float(x) - forced
        b = (float(v) - rate + eta * a) / wd
        e, c, s = np.exp(-eta * times), np.cos(wd * times), np.sin(wd * times)
        sw, cw = np.sin(w * (t0 + times)), np.cos(w * (t0 + times))
        p, q = float(self.sine), float(self.cosine)
        free = e * (a * c + b * s)
        return free + p * sw + q * cw, e * wd * (b * c - a * s) - eta * free + w * (p * cw - q * sw)

    def _contact(self, x: arb, v: arb, begin: arb, length: arb, left: int) -> tuple[int, arb] | None:
        """The first contact within `length`; `left` is the stop that the mass stands on."""
        times = self._grid * float(length)
        xs, vs = self._curves(x, v, begin, times)
        limit = float(self.clearance)
        for i in range(len(times) - 1):
            guess = None
            if abs(xs[i + 1]) > limit:
                guess = times[i + 1]
            elif vs[i] * vs[i + 1] < 0.0 and xs[i] * vs[i] > 0.0 and max(abs(xs[i]), abs(xs[i + 1])) > 0.9 * limit:
                fine = np.linspace(times[i], times[i + 1], 65)
                over = np.flatnonzero(np.abs(self._curves(x, v, begin, fine)[0]) > limit)
                guess = fine[over[0]] if len(over) else None
            if guess is None:
                continue
            stop = 1 if self._curves(x, v, begin, np.array([guess]))[0][0] > 0 else -1
            low, high = (arb(times[i]), arb(guess))
            if stop == left and i == 0 and low == 0:
                low = arb(guess) / 1024  # it stands on this stop at 0: the other contact is meant
            return stop, self._refine(x, v, begin, low, high, stop)
        return None

    def _refine(self, x: arb, v: arb, begin: arb, low: arb, high: arb, stop: int) -> arb:
        t = high
        for _ in range(200):
            place, rate = self._flow(x, v, begin, t)
            over = stop * place - self.clearance
            if over > 0:
                high = t
            else:
                low = t
            new = (t - over / (stop * rate)).mid()
            if not low <= new <= high:
                new = ((low + high) / 2).mid()
            if abs(float(new - t)) < 1e-31:
                return new
            t = new
        raise AssertionError("the oracle's root search did not converge")

    def over_a_period(self, x: arb, v: arb) -> tuple[arb, arb]:
        """The state a forcing period after phase 0."""
        t, left = arb(0), 0
        while True:
            contact = self._contact(x, v, t, self.period - t, left)
            if contact is None:
                return self._flow(x, v, t, self.period - t)
            stop, passed = contact
            _, v = self._flow(x, v, t, passed)
            x, v = stop * self.clearance, -self.restitution * v
            t, left = (t + passed).mid(), stop
            self.impacts += 1

    def growth(self, x: float, v: float, direction: tuple[float, float], periods: int) -> np.ndarray:
        """Logarithms of the growth of a distance of 1e-15 in every period, in the norm sqrt(k/m x^2 + v^2)."""
        scale = (self.wd**2 + self.eta**2).sqrt()
        here = (arb(x), arb(v))
        away = (arb(direction[0]), arb(direction[1]))
        result = []
        for k in range(periods + 1):
            length = ((scale * away[0]) ** 2 + away[1] ** 2).sqrt().mid()
            if k:
                result.append(float((length / arb(10) ** -15).log()))
            step = arb(10) ** -15 / length
            there = tuple((a + step * b).mid() for a, b in zip(here, away, strict=True))
            if k == periods:
                break
            here, there = self.over_a_period(*here), self.over_a_period(*there)
            away = tuple((b - a).mid() for a, b in zip(here, there, strict=True))
        return np.array(result)
