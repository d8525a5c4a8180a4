"""Free motion, impacts and flights between the stops, in ball arithmetic.

A state is Z = (x, x'/W, s sin(omega t), s cos(omega t)) with powers of two W and s that scale the equations. Then
Z' = A Z, and the flow is the matrix exponential.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from flint import acb, acb_mat, arb, arb_mat

from grazemap.checker.arithmetic import Refused, ball, column, exact, identity, require

DEEPEST = 60
"""Bisections of a flight after which a distance from a stop is undecided."""


def _exponent(matrix: arb_mat) -> int:
    """Return the binary exponent of the largest entry of a matrix."""
    return math.frexp(max(abs(float(x)) for x in matrix.entries()))[1]


class System:
    """The equations of motion of an oscillator with the inputs of a theorem, or another value of its parameter."""

    def __init__(self, data: dict[str, Any], theorem: dict[str, Any], parameter: str | None = None, value: Any = None):
        require(len(theorem["gaps"]) == len(theorem["restitutions"]) == 2, "there are not two gaps and restitutions")
        given = [theorem["omega"], *theorem["gaps"], *theorem["restitutions"]]
        numbers: list[Any] = [None if text is None else exact(text) for text in given]
        omega, *sides = numbers
        gaps = [value] * 2 if parameter == "clearance" else sides[:2]
        restitutions = [value] * 2 if parameter == "restitution" else sides[2:]
        self.omega = omega = value if parameter == "omega" else omega
        positive = omega.real > 0 and all(gap is None or gap.real > 0 for gap in gaps)
        require(positive, "the frequency and the gaps are positive")
        require(all(r.real >= 0 and r.real <= 1 for r in restitutions), "a restitution is not between 0 and 1")
        self.gaps, self.rebound = {1: gaps[0], -1: gaps[1]}, {1: 1 + restitutions[0], -1: 1 + restitutions[1]}
        forces = [data["forcing"][name] for name in ("sine", "cosine")]
        rows = [data["mass"], data["damping"], data["stiffness"], [data["contact"]], forces]
        mass, damping, stiffness, contact, forcing = (arb_mat([[exact(x) for x in row] for row in m]) for m in rows)
        inverse, self.size = mass.inv(), 2 * mass.nrows()
        spring, drag, push = inverse * stiffness, inverse * damping, inverse * forcing.transpose()
        power = max((_exponent(spring) + 1) // 2, _exponent(drag))
        self.scale, self.forced = arb(2) ** power, arb(2) ** (_exponent(push) - 2 * power)
        still = [0] * mass.nrows()
        blocks = [spring * (-1 / self.scale), -drag, push * (1 / (self.scale * self.forced))]
        below = [[*a, *b, *c] for a, b, c in zip(*(block.tolist() for block in blocks), strict=True)]
        above = [[*still, *row, 0, 0] for row in (identity(len(still)) * self.scale).tolist()]
        phase = [[*still, *still, 0, omega], [*still, *still, -omega, 0]]
        kind: Any = acb_mat if isinstance(omega, acb) else arb_mat
        self.matrix, row = kind([*above, *below, *phase]), kind([[*contact.entries(), *still, 0, 0]])
        self.rows = kind([(row * self.matrix**order).entries() for order in range(3)])
        jump = inverse * contact.transpose()
        self.kick = column([*still, *(jump * (1 / ((contact * jump)[0, 0] * self.scale))).entries(), 0, 0])
        self.stride = cache(lambda level: self.flow(arb(2) ** level))
        self.spread = cache(lambda level: self.flow(ball(arb(2) ** level)))

    def flow(self, time: Any) -> Any:
        """Return exp(A t)."""
        return (self.matrix * time).exp()

    def free(self, matrix: Any) -> Any:
        """Return the part of a matrix that acts on displacements and velocities."""
        return type(matrix)([row[: self.size] for row in matrix.tolist()[: self.size]])

    def with_phase(self, state: list[Any], time: Any) -> Any:
        """Return a state of the motion, completed by the phase of the forcing."""
        angle = self.omega * time
        return column([*state, self.forced * angle.sin(), self.forced * angle.cos()])

    def gap(self, stop: int) -> Any:
        """Return the gap of a stop."""
        require(self.gaps[stop] is not None, f"stop {stop} is absent")
        return self.gaps[stop]

    def impact(self, base: Any, stop: int, name: str) -> tuple[Any, Any]:
        """Return the time to a contact with a stop, and the state there, of all motions through a set.

        Every motion has one contact at about that time. An earlier one is for `fly` to exclude.
        """
        place, speed, _ = (self.rows * base).entries()
        off = place - stop * self.gap(stop)
        reach = (2 * abs(off) / abs(speed)).upper()
        around = acb(ball(reach), ball(reach)) if isinstance(off, acb) else ball(reach)
        late = -off / (self.rows * (self.flow(around) * base))[1, 0]
        require(abs(late) < reach, f"{name}: no contact is shown to exist near the given time")
        better = late
        while better.rad() < around.rad() / 2:
            late, around = better, better
            off = (self.rows * (self.flow(late.mid()) * base))[0, 0] - stop * self.gap(stop)
            better = late.mid() - off / (self.rows * (self.flow(late) * base))[1, 0]
        return late, self.flow(late) * base

    def strike(self, state: Any, stop: int) -> tuple[Any, Any]:
        """Return the state after an impact, and the saltation matrix."""
        _, speed, acceleration = (self.rows * state).entries()
        row, rate, _ = (type(self.rows)([entries]) for entries in self.rows.tolist())
        late = (self.kick * (acceleration / speed) - self.matrix * self.kick) * row
        change = (late - self.kick * rate) * self.rebound[stop]
        return state - self.kick * (self.rebound[stop] * speed), identity(self.size + 2) + change

    def fly(self, state: arb_mat, length: arb, left: int, right: int, name: str) -> None:
        """Show that between two times the contact coordinate stays inside the gaps.

        The flight leaves the stop `left` at its start and meets the stop `right` at its end, 0 for none. Beside an
        impact, where the distance vanishes, q' or q'' decides.
        """
        require(length > 0, f"{name}: its end does not follow its beginning")
        end, top = length.upper(), math.frexp(float(length))[1]
        pending = [(self.rows, arb(0), top)]
        while pending:
            rows, low, level = pending.pop()
            if low > end:
                continue
            half = arb(2) ** level
            centre = rows * self.stride(level)
            place, slope, _ = (centre * state).entries()
            bend = (centre * (self.spread(level) * state))[2, 0]
            over = place + (slope + bend * ball(half) / 2) * ball(half)
            slope = slope + bend * ball(half)
            clear = True
            for stop, gap in self.gaps.items():
                if gap is None or gap > stop * over:
                    continue
                inward, high = stop * bend < 0, low + 2 * half
                leaving = stop == left and low == 0 and (inward or stop * slope < 0)
                approaching = stop * slope > 0 and not high < length
                meeting = stop == right and (approaching or (inward and low < length and length < high))
                if leaving or meeting:
                    continue
                if gap < stop * place and low + half < length:
                    raise Refused(f"{name}: it passes a stop by {(stop * place - gap).str(5, radius=False)}")
                clear = False
            if not clear:
                require(level > top - DEEPEST, f"{name}: its distance from a stop is undecided")
                pending += [(rows, low, level - 1), (centre, low + half, level - 1)]
