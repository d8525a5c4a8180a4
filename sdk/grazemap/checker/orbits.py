"""Sets of motions through impacts, and the equations of a periodic orbit, its bifurcations and grazes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from flint import arb

from grazemap.checker.arithmetic import column, exact, identity, rational, require
from grazemap.checker.system import System, alike


class Run(NamedTuple):
    """A set of motions: its states at the end, their derivative by the initial ones, and the impacts."""

    system: System
    state: Any
    derivative: Any
    times: list[Any]
    velocities: list[Any]


def carry(
    system: System, span: tuple[Any, Any], states: Any, impacts: Sequence[tuple[int, str]], ends: Any = None
) -> Run:
    """Carry a set of states through impacts at about the given times, by the mean-value form.

    With `ends`, the stops touched at the beginning and the end or 0, show that there is no other contact.

    The set is a centre, the image of a box by the derivative, and the error of the centre. After an impact these are of
    the motion without the impact's stop, at one time for all of them.
    """
    (now, end), middle, left = span, column(states).mid(), ends and ends[0]
    box = column([*(column(states) - middle).entries(), *system.still])
    centre, error, total = system.with_phase(middle.entries(), now), box * 0, identity(len(box.entries()))
    after, begun, times, velocities = centre + box, now, [], []
    for i, (stop, text) in enumerate(impacts):
        name, time = f"impact {i + 1}", exact(text)
        ahead = system.flow(time - now)
        late, reached = system.impact(ahead * (centre + total * box + error), stop, name)
        own, struck = system.impact(ahead * centre, stop, name)
        times.append(time + late)
        velocities.append((system.rows * reached)[1, 0])
        if ends:
            require(stop * velocities[-1] > 0, f"{name} moves away from its stop")
            system.fly(after, times[-1] - begun, left, stop, f"the flight to {name}")
        (after, slope), begun, left = system.strike(reached, stop), times[-1], stop
        slope = system.flow(-late) * slope * system.flow(late) * ahead
        moved = system.flow(-own) * system.strike(struck, stop)[0]
        centre, now = moved.mid(), time
        error, total = slope * error + moved - centre, slope * total
    if ends:
        system.fly(after, end - begun, left, ends[1], "the flight to the section")
    ahead = system.flow(end - now)
    state = (ahead * (centre + total * box + error)).entries()[: system.size]
    return Run(system, column(state), system.free(ahead * total), times, velocities)


class BoundaryProblem:
    """The boundary value problem of a periodic orbit, or of a bifurcation of it: equations analytic in the unknowns.

    Unknowns are the state on a section between impacts; for a bifurcation the parameter; for a graze the time of the
    section, on which it lies, and else the perturbation that returns times the critical multiplier. The section's
    second crossing is after a period, or after half the period of a symmetric orbit, mirrored.
    """

    def __init__(self, data: dict[str, Any], theorem: dict[str, Any]):
        self.data, self.theorem = data, theorem
        point = theorem if theorem.get("kind") == "bifurcation" else {}
        self.parameter, self.graze = point.get("parameter"), point.get("graze", 0)
        self.period, self.symmetric, self.stops = theorem["period"], theorem["symmetric"], theorem["stops"]
        require(type(self.period) is int and self.period >= 1, "the period is not a number of forcing periods")
        require(not (self.symmetric and self.period % 2 == 0), "a symmetric orbit has an odd period")
        sides = [theorem["gaps"], theorem["restitutions"]]
        same = all(None not in pair and rational(pair[0]) == rational(pair[1]) for pair in sides)
        require(same or not self.symmetric, "a symmetric orbit needs two equal gaps and two equal restitutions")
        require(alike(data) or not self.symmetric, "a symmetric orbit needs odd harmonics and no bias")
        require(all(stop in (1, -1) for stop in [*self.stops, self.graze or 1]), "a stop is not 1 or -1")
        self.sign = -1 if self.symmetric else 1
        self.critical = self.sign if point.get("type") == "SN" else -self.sign
        self.impacts = list(zip(self.stops, theorem["times"], strict=True))
        texts = theorem["state"], point.get("direction", ())
        self.state, self.direction = ([exact(x) for x in numbers] for numbers in texts)
        self.names = ("value", "section")[: 0 if self.parameter is None else 2 if self.graze else 1]
        self.centre = [*self.state, *(exact(theorem[name]) for name in self.names), *self.direction]

    def run(self, unknowns: list[Any], checked: bool = True) -> Run:
        """Return the run of a set of orbits over a period; if checked, it is shown to have no other contact."""
        value, *others = unknowns[len(self.state) :] or [None]
        system = System(self.data, self.theorem, self.parameter, value)
        start = others[0] if self.graze else exact(self.theorem["section"])
        span = start, start + self.turn(system)
        ends = (self.graze, self.graze * self.sign) if checked else None
        return carry(system, span, unknowns[: len(self.state)], self.impacts, ends)

    def turn(self, system: System) -> Any:
        """Return the time between the crossings of the section."""
        return arb.pi() * (self.period if self.symmetric else 2 * self.period) / system.omega

    def residual(self, unknowns: list[Any]) -> list[Any]:
        """Return the equations."""
        run, size = self.run(unknowns, checked=False), len(self.state)
        found: list[Any] = (run.state * self.sign - column(unknowns[:size])).entries()
        if self.graze:
            place, speed, _ = (run.system.rows * run.system.with_phase(unknowns[:size], unknowns[-1])).entries()
            found += [place - self.graze * run.system.gap(self.graze), speed]
        elif self.direction:
            vector = unknowns[size + 1 :]
            found += (run.derivative * column(vector) - column(vector) * self.critical).entries()
            found.append(sum(a * (b - a) for a, b in zip(self.direction, vector, strict=True)))
        return found

    def whole(self, stops: list[int]) -> list[int]:
        """Return the stops of a period: of a symmetric orbit, half of them are mirrored."""
        return [*stops, *([-stop for stop in stops] if self.symmetric else [])]

    def require_least_period(self, run: Run) -> None:
        """Show that the impacts do not repeat after a divisor of the period."""
        stops, turn, halves = self.whole(self.stops), self.turn(run.system), 2 if self.symmetric else 1
        times = [time + half * turn for half in range(halves) for time in run.times]
        for parts in (p for p in range(2, self.period + 1) if self.period % p == 0 and len(stops) % p == 0):
            ahead, time = len(stops) // parts, turn * halves / parts
            pairs = zip(stops, stops[ahead:], times, times[ahead:], strict=False)
            differ = any(a != b or not (late - early - time).contains(0) for a, b, early, late in pairs)
            require(differ, f"the impacts may repeat after {self.period // parts} periods")

    def motion(self, run: Run) -> dict[str, Any]:
        """Return what identifies a motion: period, stops of a period, and the impacts."""
        stops, shown = self.whole(self.stops), {"times": run.times, "velocities": run.velocities}
        said = {"period": self.period, "symmetric": self.symmetric, "stops": stops}
        said |= {"impacts_right": stops.count(1), "impacts_left": stops.count(-1)}
        return said | {name: [str(x) for x in values] for name, values in shown.items()}
