"""Free motion, impacts and flights between the stops, in ball arithmetic.

A vector Z = (x, x'/W, s sin(k omega t), s cos(k omega t), ...) has displacements x from the equilibrium, velocities x',
and a sine and a cosine for every order k of the forces. The factors W and s bring the entries to one size. Then
Z' = A Z, and the flow is the matrix exponential. A state is Z; a free state is its first entries alone, x and x'/W.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cache, cached_property
from typing import Any, NamedTuple

from flint import acb, acb_mat, arb, arb_mat, fmpq, fmpq_mat

from grazemap.checker.arithmetic import Refused, ball, column, definite, exact, exponent, identity, require
from grazemap.checker.reading import VARIED

MAX_BISECTIONS = 60
"""Maximum number of bisections of a flight; then the distance from a stop counts as undecided."""
MAX_CELLS = 1_000_000
"""Maximum number of parts of a flight that are examined; then the distance from a stop counts as undecided."""

Powers = list[list[list[Fraction]]]
"""Amplitudes of the forces: by power of k omega, sine or cosine, and mass."""


class Machine:
    """The structure, the contact, the forces and the bias of an oscillator, as rational numbers."""

    def __init__(self, data: dict[str, Any]):
        """Take an oscillator as it is read from a certificate."""
        self.mass, self.damping, self.stiffness, self.contact = (
            fmpq_mat([[fmpq(*x.as_integer_ratio()) for x in row] for row in rows])
            for rows in (data["mass"], data["damping"], data["stiffness"], [data["contact"]])
        )
        require(self.mass == self.mass.transpose() and definite(arb_mat(self.mass)), "the mass matrix is not positive")
        require(any(data["contact"]), "the contact row vanishes")
        self.size = self.mass.nrows()
        self.bias = data.get("bias", [])
        self.forces = _summed(data["forcing"])

    @cached_property
    def inverse(self) -> fmpq_mat:
        """The inverse of the mass matrix."""
        return self.mass.inv()

    @cached_property
    def equilibrium(self) -> list[Fraction]:
        """The displacements at which the static force is balanced."""
        if not any(self.bias):
            return [Fraction(0)] * self.size
        force = fmpq_mat([[fmpq(*x.as_integer_ratio())] for x in self.bias])
        try:
            moved = self.stiffness.solve(force).entries()
        except ZeroDivisionError:
            raise Refused("the static force has no equilibrium: the stiffness matrix is singular") from None
        return [Fraction(int(x.p), int(x.q)) for x in moved]

    @property
    def place(self) -> Fraction:
        """The contact coordinate in the equilibrium."""
        row = (Fraction(int(x.p), int(x.q)) for x in self.contact.entries())
        return sum((h * x for h, x in zip(row, self.equilibrium, strict=True)), Fraction(0))

    @cached_property
    def scale(self) -> Fraction:
        """The power of two W that makes x and x'/W of one size, from the largest entries of M^-1 K and M^-1 C."""
        spring, drag = (arb_mat(self.inverse * matrix) for matrix in (self.stiffness, self.damping))
        return Fraction(2) ** max((_largest_exponent(spring) + 1) // 2, _largest_exponent(drag))

    @property
    def divisor(self) -> int:
        """The greatest common divisor p of the orders, 1 without forces: the period is T = 2 pi/(p omega)."""
        return math.gcd(*self.forces) or 1

    @property
    def half_wave_symmetric(self) -> bool:
        """Whether the forces change their sign after T/2."""
        return all(order // self.divisor % 2 for order in self.forces)


def _summed(parts: list[dict[str, Any]]) -> dict[int, Powers]:
    """Return the forces by order. Forces of one order are added; an order whose sum vanishes is left out."""
    sums: dict[int, Powers] = {}
    for part in parts:
        powers = sums.setdefault(part["harmonic"], [])
        for power, pair in enumerate(part["powers"]):
            if power == len(powers):
                powers.append([[Fraction(0)] * len(row) for row in pair])
            powers[power] = [
                [a + b for a, b in zip(*rows, strict=True)] for rows in zip(powers[power], pair, strict=True)
            ]
    return {order: sums[order] for order in sorted(sums) if any(x for pair in sums[order] for row in pair for x in row)}


def _largest_exponent(matrix: Any) -> int:
    """Return the binary exponent of the largest entry of a matrix; 0 for a matrix of zeros."""
    return max((exponent(abs(x).real) for x in matrix.entries() if not x.is_zero()), default=0)


def _amplitudes(powers: Powers, s: Any) -> list[list[Any]]:
    """Return the amplitudes of sine and cosine, polynomials of s."""
    return [
        [sum((exact(x) * s**power for power, x in enumerate(terms)), arb(0)) for terms in zip(*rows, strict=True)]
        for rows in zip(*powers, strict=True)
    ]


class Inputs(NamedTuple):
    """The inputs of a statement; "varied" stands for the parameter that varies."""

    omega: Any
    """Forcing frequency."""
    clearances: tuple[Any, Any]
    """Clearances of the right and the left stop."""
    restitutions: tuple[Any, Any]
    """Restitutions of the right and the left stop."""

    @classmethod
    def of(cls, statement: dict[str, Any]) -> Inputs:
        """Return the inputs of a statement."""
        sides = [(statement[name]["right"], statement[name]["left"]) for name in ("clearance", "restitution")]
        return cls(statement["omega"], *sides)

    def require_symmetric(self, machine: Machine) -> None:
        """Show that gaps from the equilibrium, restitutions and forces are symmetric, for any value that varies."""
        (right, left), place = self.clearances, machine.place
        if VARIED in (right, left):
            alike = right == left and place == 0
        else:
            alike = None not in (right, left) and right - place == left + place
        require(alike and self.restitutions[0] == self.restitutions[1], "the stops of a symmetric orbit are not equal")
        require(machine.half_wave_symmetric, "the forces of a symmetric orbit have even harmonics")


class System:
    """The equations of motion of a machine at some inputs, for one value of the parameter that varies.

    Displacements are from the static equilibrium.

    Attributes
    ----------
    machine
        The machine.
    omega
        Forcing frequency.
    rebound
        1 + restitution, by stop.
    turn
        The period T of the forces.
    place, equilibrium
        As of `Machine`, as balls.
    gaps
        Distances of the stops from the equilibrium, by stop; None for an absent stop.
    scale, force_scale
        The factors W and s of Z.
    orders, size
        Orders of the forces; number of displacements and velocities in Z.
    matrix
        A of Z' = A Z.
    rows
        Three rows: q, q' and q'' are `rows` times Z.
    kick
        Change of Z by an impulse at the contact that changes q' by 1.
    force_zeros
        List of zeros, one for every entry of Z that belongs to the forces.
    stride, spread
        Functions of a level: exp(A t) at t = 2^level; an enclosure of exp(A t) for all t of at most that modulus.
    """

    def __init__(self, machine: Machine, inputs: Inputs, value: Any = None, scale: Fraction | None = None):
        """Take the value of the varied parameter, if there is one, and the scale W; without `scale`, the machine's."""

        def number(entry: Any) -> Any:
            return value if entry == VARIED else None if entry is None else exact(entry)

        self.machine = machine
        omega, (right, left) = number(inputs.omega), map(number, inputs.restitutions)
        require(omega.real > 0, "the frequency is not positive")
        require(all(r.real >= 0 and r.real <= 1 for r in (right, left)), "a restitution is not between 0 and 1")
        self.omega, self.rebound = omega, {1: 1 + right, -1: 1 + left}
        self.turn = 2 * arb.pi() / (omega * machine.divisor)
        self.place = exact(machine.place)
        self.equilibrium = [exact(x) for x in machine.equilibrium]
        self.gaps = {
            stop: None if gap is None else number(gap) - stop * self.place
            for stop, gap in zip((1, -1), inputs.clearances, strict=True)
        }
        self.orders, self.size = list(machine.forces), 2 * machine.size
        zeros = [0] * machine.size
        kind: Any = acb_mat if isinstance(omega, acb) else arb_mat
        forcing = [row for order, powers in machine.forces.items() for row in _amplitudes(powers, order * omega)]
        inverse, contact = arb_mat(machine.inverse), arb_mat(machine.contact)
        spring, drag = arb_mat(machine.inverse * machine.stiffness), arb_mat(machine.inverse * machine.damping)
        push = kind(inverse) * kind(forcing).transpose() if forcing else kind(machine.size, 0)
        self.scale = exact(machine.scale if scale is None else scale)
        require(self.scale > 0, "the scale of the velocities is not positive")
        self.force_scale = arb(2) ** (_largest_exponent(push) - 2 * exponent(self.scale))
        blocks = [spring * (-1 / self.scale), -drag, push * (1 / (self.scale * self.force_scale))]
        velocity_rows = [[*a, *b, *c] for a, b, c in zip(*(block.tolist() for block in blocks), strict=True)]
        self.force_zeros = [0] * len(forcing)
        displacement_rows = [[*zeros, *row, *self.force_zeros] for row in (identity(len(zeros)) * self.scale).tolist()]
        phase_rows = [[0] * (self.size + len(forcing)) for _ in forcing]
        for i, order in enumerate(self.orders):
            sine, cosine = self.size + 2 * i, self.size + 2 * i + 1
            phase_rows[2 * i][cosine], phase_rows[2 * i + 1][sine] = order * omega, -order * omega
        self.matrix = kind([*displacement_rows, *velocity_rows, *phase_rows])
        row = kind([[*contact.entries(), *zeros, *self.force_zeros]])
        self.rows = kind([(row * self.matrix**order).entries() for order in range(3)])
        jump = inverse * contact.transpose()
        self.kick = column([*zeros, *(jump * (1 / ((contact * jump)[0, 0] * self.scale))).entries(), *self.force_zeros])
        self.stride = cache(lambda level: self.flow(arb(2) ** level))
        self.spread = cache(lambda level: self.flow(ball(arb(2) ** level)))

    def flow(self, time: Any) -> Any:
        """Return exp(A t)."""
        return (self.matrix * time).exp()

    def free_block(self, matrix: Any) -> Any:
        """Return the part of a matrix that acts on displacements and velocities."""
        return type(matrix)([row[: self.size] for row in matrix.tolist()[: self.size]])

    def with_phase(self, free_state: list[Any], time: Any) -> Any:
        """Return Z from the free state (x, x'/W) at a time."""
        angles = [order * self.omega * time for order in self.orders]
        return column([*free_state, *(self.force_scale * x for angle in angles for x in (angle.sin(), angle.cos()))])

    def from_equilibrium(self, displacement: Any, velocity: Any) -> list[Any]:
        """Return the free state (x, x'/W) from numbers; the displacements may be the word "equilibrium"."""
        moved = [arb(0)] * (self.size // 2)
        if displacement != "equilibrium":
            moved = [exact(x) - e for x, e in zip(displacement, self.equilibrium, strict=True)]
        return moved + [exact(v) / self.scale for v in velocity]

    def require_forces(self) -> None:
        """Show that no order of the forces vanishes at this frequency, so that their period is T."""
        for order, powers in self.machine.forces.items():
            entries = (x for row in _amplitudes(powers, order * self.omega) for x in row)
            require(any(abs(x) > 0 for x in entries), f"the forces of order {order} may vanish at this frequency")

    def require_stops(self) -> None:
        """Show that there is a stop, and that two stops are a positive distance apart."""
        known = [gap for gap in self.gaps.values() if gap is not None]
        require(
            len(known) == 1 or (len(known) == 2 and sum(known, arb(0)).real > 0),
            "there is no stop, or no distance between the stops",
        )

    def periodic_state(self, section: arb, turns: Any, sign: int, impacts: list[tuple[int, Any, Any]]) -> arb_mat:
        """Return the free state (x, x'/W), at the time `section`, of the periodic motion with given impacts.

        Impacts are stops, times and velocities before them. The motion returns after `turns` times T, mirrored for sign
        -1. This does not prove that a motion with these impacts exists.
        """
        end = section + self.turn * turns
        state = self.flow(end - section) * self.with_phase([0] * self.size, section)
        for stop, time, velocity in impacts:
            state -= self.flow(end - time) * self.kick * (self.rebound[stop] * velocity)
        around = identity(self.size) - self.free_block(self.flow(self.turn * turns)) * sign
        fixed: arb_mat = around.solve(column(state.entries()[: self.size]) * sign)
        return fixed

    def gap(self, stop: int) -> Any:
        """Return the gap of a stop."""
        require(self.gaps[stop] is not None, f"stop {stop} is absent")
        return self.gaps[stop]

    def impact(self, base: Any, stop: int, name: str, least: Any = 0) -> tuple[Any, Any]:
        """Return the time to a contact with a stop, and Z there, of all motions that start in the set `base`.

        Every motion is shown to have one contact near its start, earlier or later, and no other within `least` of its
        start. `fly` excludes contacts earlier in the flight. `name` is that of the impact in messages.
        """
        q, speed, _ = (self.rows * base).entries()
        off = q - stop * self.gap(stop)
        reach = (2 * abs(off) / abs(speed)).upper().max(arb(least).upper())
        around = acb(ball(reach), ball(reach)) if isinstance(off, acb) else ball(reach)
        # q' as q' at the start plus q'' times the time, because terms cancel in q' of the whole set
        late = -off / (speed + (self.rows * (self.flow(around) * base))[2, 0] * around)
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
        by_delay = (self.kick * (acceleration / speed) - self.matrix * self.kick) * row
        change = (by_delay - self.kick * rate) * self.rebound[stop]
        return state - self.kick * (self.rebound[stop] * speed), identity(self.size + len(self.force_zeros)) + change

    def fly(self, state: arb_mat, length: arb, leaves: int, meets: int, name: str) -> None:
        """Show that the contact coordinate stays between the stops during a flight.

        The flight leaves the stop `leaves` at its start and meets the stop `meets` at its end, 0 for none. Next to an
        impact the distance from the stop vanishes, and the sign of q' or q'' decides. That the velocity does not point
        into `leaves` at the start, and points into `meets` at the end, has to be shown elsewhere. `name` is that of the
        flight in messages.
        """
        require(length > 0 and length.is_finite(), f"{name}: its end does not follow its beginning")
        end, top = length.upper(), exponent(length)
        pending, cells = [(self.rows, arb(0), top)], 0
        while pending:
            rows, low, level = pending.pop()
            if low > end:
                continue
            cells += 1
            require(cells <= MAX_CELLS, f"{name}: its distance from a stop is undecided after {MAX_CELLS} parts")
            half = arb(2) ** level
            centre = rows * self.stride(level)
            q, slope, _ = (centre * state).entries()
            bend = (centre * (self.spread(level) * state))[2, 0]
            enclosure = q + (slope + bend * ball(half) / 2) * ball(half)
            slope = slope + bend * ball(half)
            clear = True
            for stop, gap in self.gaps.items():
                if gap is None or gap > stop * enclosure:
                    continue
                inward, high = stop * bend < 0, low + 2 * half
                leaving = stop == leaves and low == 0 and (inward or stop * slope < 0)
                approaching = stop * slope > 0 and not high < length
                meeting = stop == meets and (approaching or (inward and low < length and length < high))
                if leaving or meeting:
                    continue
                if gap < stop * q and low + half < length:
                    raise Refused(f"{name}: it passes a stop by {(stop * q - gap).str(5, radius=False)}")
                clear = False
            if not clear:
                require(level > top - MAX_BISECTIONS, f"{name}: its distance from a stop is undecided")
                pending += [(rows, low, level - 1), (centre, low + half, level - 1)]
