"""Free motion, impacts and flights between the stops, in ball arithmetic.

A state is Z = (x, x'/W, s sin(k omega t), s cos(k omega t), ...) with x from the equilibrium, the harmonics k of the
forces, and powers of two W and s that scale the equations. Then Z' = A Z, and the flow is the matrix exponential.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from flint import acb, acb_mat, arb, arb_mat

from grazemap.checker.arithmetic import Refused, ball, column, exact, identity, require

PARAMETERS = ("omega", "clearance_right", "clearance_left", "restitution_right", "restitution_left")
"""The inputs of a theorem; the clearances or the restitutions of both stops vary together without _right or _left."""
DEEPEST = 60
"""Bisections of a flight after which a distance from a stop is undecided."""


def _exponent(matrix: arb_mat) -> int:
    """Return the binary exponent of the largest entry of a matrix."""
    return math.frexp(max(float(abs(x).real) for x in matrix.entries()))[1]


def harmonics(data: dict[str, Any]) -> list[Any]:
    """Return the harmonics of the forces: an order k, and amplitudes of sine and cosine by powers of k omega."""
    forcing = data["forcing"]
    if isinstance(forcing, dict):
        forcing = [{"harmonic": 1, "powers": [[forcing["sine"], forcing["cosine"]]]}]
    require(all(type(one["harmonic"]) is int and one["harmonic"] >= 1 for one in forcing), "an order is not positive")
    return list(forcing)


def alike(data: dict[str, Any]) -> bool:
    """Return whether the forces change their sign after half a period, and no bias moves the equilibrium."""
    return all(one["harmonic"] % 2 == 1 for one in harmonics(data)) and "bias" not in data


def _amplitudes(powers: Any, s: Any) -> list[list[Any]]:
    """Return the amplitudes of sine and cosine, polynomials of s."""
    found = [[exact(x) for x in row] for row in powers[0]]
    for j, pair in enumerate(powers[1:], 1):
        found = [[a + exact(b) * s**j for a, b in zip(*rows, strict=True)] for rows in zip(found, pair, strict=True)]
    return found


class System:
    """The equations of motion of an oscillator with the inputs of a theorem, or another value of its parameter.

    Displacements are from the static equilibrium.
    """

    def __init__(self, data: dict[str, Any], theorem: dict[str, Any], parameter: str | None = None, value: Any = None):
        require(len(theorem["gaps"]) == len(theorem["restitutions"]) == 2, "there are not two gaps and restitutions")
        given = [theorem["omega"], *theorem["gaps"], *theorem["restitutions"]]
        varied = (parameter, f"{parameter}_right", f"{parameter}_left")
        numbers: list[Any] = [
            None if text is None else value if name in varied else exact(text)
            for name, text in zip(PARAMETERS, given, strict=True)
        ]
        omega, *gaps, right, left = numbers
        known = [gap for gap in gaps if gap is not None]
        positive = (omega.real > 0 and sum(known, arb(0)).real > 0) or (len(known) == 1 and omega.real > 0)
        require(positive, "the frequency and the gaps are positive")
        require(all(r.real >= 0 and r.real <= 1 for r in (right, left)), "a restitution is not between 0 and 1")
        self.omega, self.rebound = omega, {1: 1 + right, -1: 1 + left}
        rows = [data["mass"], data["damping"], data["stiffness"], [data["contact"]]]
        mass, damping, stiffness, contact = (arb_mat([[exact(x) for x in row] for row in m]) for m in rows)
        inverse, self.size, parts = mass.inv(), 2 * mass.nrows(), harmonics(data)
        still = [0] * mass.nrows()
        bias = [exact(x) for x in data["bias"]] if "bias" in data else []
        self.equilibrium = stiffness.solve(column(bias)) if bias else column(still)
        self.place = (contact * self.equilibrium)[0, 0]
        self.gaps = {
            stop: gap if gap is None else gap - stop * self.place for stop, gap in zip((1, -1), gaps, strict=True)
        }
        self.orders = [one["harmonic"] for one in parts]
        kind: Any = acb_mat if isinstance(omega, acb) else arb_mat
        forcing = [row for one in parts for row in _amplitudes(one["powers"], one["harmonic"] * omega)]
        forces: Any = acb_mat if any(isinstance(x, acb) for row in forcing for x in row) else arb_mat
        spring, drag, push = inverse * stiffness, inverse * damping, forces(inverse) * forces(forcing).transpose()
        power = max((_exponent(spring) + 1) // 2, _exponent(drag))
        self.scale, self.forced = arb(2) ** power, arb(2) ** (_exponent(push) - 2 * power)
        blocks = [spring * (-1 / self.scale), -drag, push * (1 / (self.scale * self.forced))]
        below = [[*a, *b, *c] for a, b, c in zip(*(block.tolist() for block in blocks), strict=True)]
        self.still = [0] * len(forcing)
        above = [[*still, *row, *self.still] for row in (identity(len(still)) * self.scale).tolist()]
        phase = [[0] * (self.size + len(forcing)) for _ in forcing]
        for i, order in enumerate(self.orders):
            sine, cosine = self.size + 2 * i, self.size + 2 * i + 1
            phase[2 * i][cosine], phase[2 * i + 1][sine] = order * omega, -order * omega
        self.matrix, row = kind([*above, *below, *phase]), kind([[*contact.entries(), *still, *self.still]])
        self.rows = kind([(row * self.matrix**order).entries() for order in range(3)])
        jump = inverse * contact.transpose()
        self.kick = column([*still, *(jump * (1 / ((contact * jump)[0, 0] * self.scale))).entries(), *self.still])
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
        angles = [order * self.omega * time for order in self.orders]
        return column([*state, *(self.forced * x for angle in angles for x in (angle.sin(), angle.cos()))])

    def from_equilibrium(self, displacement: Any, velocity: Any) -> list[Any]:
        """Return a state from decimals; displacements that are "equilibrium" are those of the equilibrium."""
        moved = [arb(0)] * (self.size // 2)
        if displacement != "equilibrium":
            moved = [exact(x) - e for x, e in zip(displacement, self.equilibrium.entries(), strict=True)]
        return moved + [exact(v) / self.scale for v in velocity]

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
        return state - self.kick * (self.rebound[stop] * speed), identity(self.size + len(self.still)) + change

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
