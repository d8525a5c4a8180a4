"""Sets of motions through impacts, and the equations of a periodic orbit, its bifurcations and grazes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from flint import arb, arb_mat

from grazemap.checker.arithmetic import ball, column, exact, identity, require
from grazemap.checker.system import Inputs, Machine, System


class Run(NamedTuple):
    """A set of motions."""

    system: System
    """The system."""
    state: Any
    """Its states at the end."""
    derivative: Any
    """Their derivative by the initial states."""
    times: list[Any]
    """Times of the impacts."""
    velocities: list[Any]
    """Velocities before the impacts."""


def carry(
    system: System,
    span: tuple[Any, Any],
    states: Any,
    impacts: Sequence[tuple[int, Any]],
    ends: Any = None,
    isolation: Sequence[Any] = (),
) -> Run:
    """Carry a set of states through impacts at about the given times, by the mean-value form.

    `ends` are the stops that are touched at the beginning and at the end, 0 for none. With them, show that there is no
    contact besides the impacts. `isolation` has a time for each impact. With it, show that no other contact is within
    that time of the given one.

    The set is a centre, the image of a box under the derivative, and the error of the centre. After an impact all three
    follow the motion without the impact's stop, so that the whole set is at one time.
    """
    (now, end), middle, left = span, column(states).mid(), ends and ends[0]
    box = column([*(column(states) - middle).entries(), *system.force_zeros])
    centre, error, total = system.with_phase(middle.entries(), now), box * 0, identity(len(box.entries()))
    flight_start, flight_begin, times, velocities = centre + box, now, [], []
    for i, (stop, place) in enumerate(impacts):
        name, time = f"impact {i + 1}", exact(place)
        ahead = system.flow(time - now)
        least = isolation[i] if isolation else 0
        late, reached = system.impact(ahead * (centre + total * box + error), stop, name, least)
        own, struck = system.impact(ahead * centre, stop, name)
        times.append(time + late)
        velocities.append((system.rows * reached)[1, 0])
        if ends:
            require(stop * velocities[-1] > 0, f"{name} moves away from its stop")
            system.fly(flight_start, times[-1] - flight_begin, left, stop, f"the flight to {name}")
        (flight_start, slope), flight_begin, left = system.strike(reached, stop), times[-1], stop
        slope = system.flow(-late) * slope * system.flow(late) * ahead
        moved = system.flow(-own) * system.strike(struck, stop)[0]
        centre, now = moved.mid(), time
        error, total = slope * error + moved - centre, slope * total
    if ends:
        system.fly(flight_start, end - flight_begin, left, ends[1], "the flight to the section")
    ahead = system.flow(end - now)
    state = (ahead * (centre + total * box + error)).entries()[: system.size]
    return Run(system, column(state), system.free_block(ahead * total), times, velocities)


class BoundaryProblem:
    """The boundary value problem of a periodic orbit, or of a bifurcation of it: equations analytic in the unknowns.

    The unknowns are the state on a section between impacts and, for a bifurcation, the parameter. A graze has the time
    of the section too, on which it lies. Any other bifurcation has the perturbation that returns multiplied by the
    critical multiplier. The orbit crosses the section again after its period, or, if it is symmetric, as its mirror
    image after half the period.
    """

    def __init__(self, machine: Machine, inputs: Inputs, theorem: dict[str, Any], bifurcation: str | None = None):
        """Take the numbers of a theorem; `bifurcation` is the type of a bifurcation, and None for an orbit."""
        self.machine, self.inputs, self.scale = machine, inputs, theorem["scale"]
        self.section = theorem["section"]
        self.period, self.symmetric, self.stops = theorem["period"], theorem["symmetric"], theorem["stops"]
        self.graze, self.direction = theorem.get("graze", 0), [exact(x) for x in theorem.get("direction", ())]
        if self.symmetric:
            require(self.period % 2 == 1, "a symmetric orbit has an odd period")
            inputs.require_symmetric(machine)
        self.sign = -1 if self.symmetric else 1
        self.critical = self.sign if bifurcation == "SN" else -self.sign
        self.turns = arb(self.period) / 2 if self.symmetric else arb(self.period)
        self.impacts = list(zip(self.stops, theorem["times"], strict=True))
        self.state = [exact(x) for x in theorem["state"]]
        self.names = ("value", "section")[: 0 if bifurcation is None else 2 if self.graze else 1]
        self.centre = [*self.state, *(exact(theorem[name]) for name in self.names), *self.direction]

    def run(self, unknowns: list[Any], checked: bool = True, isolation: Sequence[Any] = ()) -> Run:
        """Return the run of a set of orbits over a period; with `checked`, show that it has no further contacts."""
        value, *rest = unknowns[len(self.state) :] or [None]
        system = System(self.machine, self.inputs, value, self.scale)
        start = rest[0] if self.graze else exact(self.section)
        span = start, start + system.turn * self.turns
        ends = (self.graze, self.graze * self.sign) if checked else None
        if checked:
            system.require_stops()
            system.require_forces()
        return carry(system, span, unknowns[: len(self.state)], self.impacts, ends, isolation)

    def residual(self, unknowns: list[Any]) -> list[Any]:
        """Return the equations."""
        run, size = self.run(unknowns, checked=False), len(self.state)
        values: list[Any] = (run.state * self.sign - column(unknowns[:size])).entries()
        if self.graze:
            place, speed, _ = (run.system.rows * run.system.with_phase(unknowns[:size], unknowns[-1])).entries()
            values += [place - self.graze * run.system.gap(self.graze), speed]
        elif self.direction:
            vector = unknowns[size + 1 :]
            values += (run.derivative * column(vector) - column(vector) * self.critical).entries()
            values.append(sum(a * (b - a) for a, b in zip(self.direction, vector, strict=True)))
        return values

    @property
    def label(self) -> str:
        """The name of the motion, from the impacts of a whole period."""
        return label(self.period, [*self.stops, *(-stop for stop in self.stops)] if self.symmetric else self.stops)

    def jacobian(self, radius: arb) -> arb_mat | None:
        """Return an enclosure of the derivative of an orbit's equations over its box; None for a bifurcation."""
        if self.names:
            return None
        box = [x + ball(radius) for x in self.centre]
        derivative: arb_mat = self.run(box, checked=False).derivative * self.sign - identity(len(box))
        return derivative

    def contacts(self, run: Run, graze: Any = None) -> tuple[list[int], list[Any], list[Any]]:
        """Return the stops, times and velocities of the contacts of a period, with a graze at the time `graze`."""
        stops, times, velocities = list(self.stops), list(run.times), list(run.velocities)
        if graze is not None:
            stops, times, velocities = [self.graze, *stops], [graze, *times], [arb(0), *velocities]
        if self.symmetric:
            half = run.system.turn * self.turns
            stops, velocities = [*stops, *(-stop for stop in stops)], [*velocities, *(-v for v in velocities)]
            times = [*times, *(time + half for time in times)]
        return stops, times, velocities

    def require_least_period(self, run: Run) -> None:
        """Show that the impacts do not repeat after a divisor of the period."""
        stops, times, _ = self.contacts(run)
        for parts in (p for p in range(2, self.period + 1) if self.period % p == 0 and len(stops) % p == 0):
            ahead, time = len(stops) // parts, run.system.turn * self.period / parts
            pairs = zip(stops, stops[ahead:], times, times[ahead:], strict=False)
            differ = any(a != b or not (late - early - time).contains(0) for a, b, early, late in pairs)
            require(differ, f"the impacts may repeat after {self.period // parts} periods")

    def motion(self, contacts: tuple[list[int], list[Any], list[Any]]) -> dict[str, Any]:
        """Return what identifies a motion: its label, and the contacts of a period."""
        stops, times, velocities = contacts
        shown = {"label": self.label} | ({"symmetric": True} if self.symmetric else {})
        return shown | {"stops": stops, "times": list(map(str, times)), "velocities": list(map(str, velocities))}


def label(period: int, stops: Sequence[int]) -> str:
    """Return the name n-p_r-q_l of a motion that touches stops by impacts alone; (-1) stands for no contact."""
    right, left = (str(list(stops).count(stop) or "(-1)") for stop in (1, -1))
    return f"{period}-{right}r-{left}l"
