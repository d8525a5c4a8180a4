"""Free motion, impacts and flights between the stops, in ball arithmetic.

A state is Z = (x, x'/W, s sin(omega t), s cos(omega t)) with constants W and s that scale the equations. Then
Z' = A Z, and the flow is the matrix exponential.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

from flint import acb, acb_mat, arb, arb_mat, arb_poly, ctx

from grazemap.checker.arithmetic import Refused, ball, column, exact, identity, largest, require

TERMS = 30
"""Terms of the Taylor series of a step of a flight."""
DEEPEST = 60
"""Bisections of a step after which a distance from a stop is undecided."""


class System:
    """The equations of motion at given frequency, gaps and restitutions, any of which may be a ball."""

    def __init__(self, data: dict[str, Any], omega: arb, gaps: Sequence[arb | None], restitutions: Sequence[arb]):
        mass, self.damping, self.stiffness = (
            arb_mat([[exact(x) for x in row] for row in data[name]]) for name in ("mass", "damping", "stiffness")
        )
        self.size = n = mass.nrows()
        contact = arb_mat([[exact(x) for x in data["contact"]]])
        sine, cosine = ([exact(x) for x in data["forcing"][name]] for name in ("sine", "cosine"))
        inverse = mass.inv()
        jump = inverse * contact.transpose()
        jump = jump * (1 / (contact * jump)[0, 0])
        self.mass, self.omega, self.gaps = mass, omega, {1: gaps[0], -1: gaps[1]}
        require(bool(omega > 0) and all(g is None or g > 0 for g in gaps), "the frequency and the gaps are positive")
        require(all(r >= 0 and r <= 1 for r in restitutions), "a restitution is not between 0 and 1")
        self.rebound = {1: 1 + restitutions[0], -1: 1 + restitutions[1]}
        spring, drag = inverse * self.stiffness, inverse * self.damping
        push = [inverse * column(sine), inverse * column(cosine)]
        self.scale = w = (largest(spring) + largest(drag) ** 2 + omega.abs_upper() ** 2).sqrt().mid()
        self.forced = s = (max(map(largest, push)) / w**2).mid() or arb(1)
        whole = arb_mat(2 * n + 2, 2 * n + 2)
        for i in range(n):
            whole[i, n + i] = w
            for j in range(n):
                whole[n + i, j], whole[n + i, n + j] = -spring[i, j] / w, -drag[i, j]
            whole[n + i, 2 * n], whole[n + i, 2 * n + 1] = push[0][i, 0] / (w * s), push[1][i, 0] / (w * s)
        whole[2 * n, 2 * n + 1], whole[2 * n + 1, 2 * n] = omega, -omega
        self.whole = whole
        self.free = arb_mat([[whole[i, j] for j in range(2 * n)] for i in range(2 * n)])
        self.norm = max(sum((abs(x).abs_upper() for x in row), arb(0)) for row in whole.tolist()).upper()
        self.row = arb_mat([contact.entries() + [0] * (n + 2)])
        self.kick = column([0] * n + [x / w for x in jump.entries()])
        self.force = acb_mat([[acb(a, b)] for a, b in zip(sine, cosine, strict=True)])

    def gap(self, stop: int) -> arb:
        """Return the gap of a stop."""
        gap = self.gaps[stop]
        if gap is None:
            raise Refused(f"stop {stop} is absent")
        return gap

    def flow(self, time: arb, free: bool = False) -> arb_mat:
        """Return exp(A t), of the motion without forcing if `free`."""
        return ((self.free if free else self.whole) * time).exp()

    def rows(self, orders: int) -> arb_mat:
        """Return the rows that give q, q', q'', ... of a free motion."""
        row = arb_mat([self.row.entries()[: 2 * self.size]])
        found = []
        for _ in range(orders):
            found.append(row.entries())
            row = row * self.free
        return arb_mat(found)

    @cached_property
    def response(self) -> tuple[acb_mat, acb_mat]:
        """The steady motion's amplitudes X, and their derivative with respect to the frequency."""
        w = self.omega
        dynamic = acb_mat(self.stiffness - self.mass * (w * w)) + acb_mat(self.damping * w) * acb(0, 1)
        amplitudes = dynamic.solve(self.force)
        slope = dynamic.solve((acb_mat(self.mass * (2 * w)) - acb_mat(self.damping) * acb(0, 1)) * amplitudes)
        return amplitudes, slope

    def steady(self, time: arb) -> tuple[list[arb], list[arb]]:
        """Return q and three derivatives of the steady motion, and their derivatives with respect to the frequency."""
        contact = acb_mat(arb_mat([self.row.entries()[: self.size]]))
        size, slope = ((contact * x)[0, 0] * acb(0, self.omega * time).exp() for x in self.response)
        changes = [size * d / self.omega + slope + size * acb(0, time) for d in range(4)]
        powers = [acb(0, self.omega) ** d for d in range(4)]
        return [(p * size).imag for p in powers], [(p * x).imag for p, x in zip(powers, changes, strict=True)]

    def with_phase(self, state: arb_mat, time: arb) -> arb_mat:
        """Return a state of the motion, completed by the phase of the forcing."""
        angle = self.omega * time
        return column([*state.entries(), self.forced * angle.sin(), self.forced * angle.cos()])

    def strike(self, state: arb_mat, stop: int) -> tuple[arb_mat, arb_mat]:
        """Return the state after an impact, and the saltation matrix of the motion without forcing."""
        rate = self.whole * state
        speed = (self.row * rate)[0, 0]
        n = 2 * self.size
        kick = column([*(self.kick * (self.rebound[stop] * speed)).entries(), 0, 0])
        after = state - kick
        across = arb_mat([self.row.entries()[:n]])
        velocity = arb_mat([(self.row * self.whole).entries()[:n]])
        bounce = identity(n) - self.kick * velocity * self.rebound[stop]
        change = column((self.whole * after).entries()[:n]) - bounce * column(rate.entries()[:n])
        return after, bounce + change * across * (1 / speed)

    def fly(self, state: arb_mat, length: arb, left: int, right: int, name: str) -> None:
        """Show that between two times the contact coordinate stays inside the gaps.

        The flight leaves the stop `left` at its start and meets the stop `right` at its end, 0 for none. Beside an
        impact, where the distance vanishes, q' or q'' decides.
        """
        require(bool(length > 0), f"{name}: its end does not follow its beginning")
        end = length.upper()
        steps = int(float(end * self.norm / 4)) + 1
        require(steps < 100_000, f"{name}: too long for the norm of the equations")
        with ctx.workprec(96 + 4 * steps if steps < 500 else 2096):
            half = end / (2 * steps)
            stride, here = self.flow(2 * half), self.flow(half)
            reach = half.upper()
            for step in range(steps):
                middle = here * state
                here = stride * here if (step + 1) % 256 else self.flow(half * (2 * step + 3))
                self.step(middle, reach, left if step == 0 else 0, right if step == steps - 1 else 0, name)

    def step(self, middle: arb_mat, reach: arb, left: int, right: int, name: str) -> None:
        """Show the same for one step around the time at which the state is given."""
        derivatives, state, factorial = [], middle, arb(1)
        for _ in range(TERMS + 2):
            derivatives.append((self.row * state)[0, 0])
            state = self.whole * state
        for m in range(2, TERMS + 1):
            factorial = factorial * m
        row = sum((abs(x) for x in self.row.entries()), arb(0))
        tail = row * self.norm**TERMS * (self.norm * reach).exp() * largest(middle) * reach**TERMS / factorial
        series = []
        for order in range(3):
            coefficients, factor = [], arb(1)
            for m in range(TERMS):
                coefficients.append(derivatives[order + m] / factor)
                factor = factor * (m + 1)
            coefficients[0] = ball(coefficients[0], tail * self.norm**order)
            series.append(arb_poly(coefficients))
        whole = [(-reach, reach, 0)]
        while whole:
            low, high, depth = whole.pop()
            centre = ((low + high) / 2).mid()
            around = ball(centre, ((high - low) / 2).upper())
            slope, bend = series[1](around), series[2](around)
            at = series[0](centre)
            place = at + slope * (around - centre)
            clear = True
            for stop, gap in self.gaps.items():
                if gap is None or gap > stop * place:
                    continue
                leaving = stop == left and bool(low == -reach) and (stop * slope < 0 or stop * bend < 0)
                meeting = stop == right and bool(high == reach) and (stop * slope > 0 or stop * bend < 0)
                if leaving or meeting:
                    continue
                if gap < stop * at:
                    raise Refused(f"{name}: it passes a stop by {(stop * at - gap).str(5, radius=False)}")
                clear = False
            if not clear:
                require(depth < DEEPEST, f"{name}: its distance from a stop is undecided")
                whole += [(low, centre, depth + 1), (centre, high, depth + 1)]

    def impact(self, base: arb_mat, stop: int, name: str) -> tuple[arb, arb_mat]:
        """Return the time to a contact with a stop, by Newton's method, and the state there.

        Every motion of the set has one contact at about that time. An earlier one is for `fly` to exclude.
        """
        gap, late, bits = stop * self.gap(stop), arb(0), 64
        while bits < 2 * ctx.prec:
            with ctx.workprec(min(bits, ctx.prec)):
                near = self.flow(late) * base.mid()
                late = (late - ((self.row * near)[0, 0] - gap) / (self.row * (self.whole * near))[0, 0]).mid()
            bits *= 2
        here = self.flow(late) * base
        off, speed = (self.row * here)[0, 0] - gap, (self.row * (self.whole * here))[0, 0]
        around = ball(arb(0), (2 * abs(off) / abs(speed)).upper())
        speed = (self.row * (self.whole * (self.flow(around) * here)))[0, 0]
        require(stop * speed > 0, f"{name}: the velocity is not shown to point at the stop")
        better = -off / speed
        require(around.contains_interior(better), f"{name}: no contact is shown to exist near the given time")
        return late + better, self.flow(better) * here
