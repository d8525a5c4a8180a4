"""Attraction: a ball around an orbit that the return map contracts, and a trajectory that enters it."""

from __future__ import annotations

from typing import Any

from flint import arb, arb_mat

from grazemap.checker.arithmetic import ball, column, definite, exact, identity, require
from grazemap.checker.equations import Solution
from grazemap.checker.orbits import admissible_orbit, motion
from grazemap.checker.system import System


def pass_impact(system: System, state: arb_mat, start: arb, time: arb, stop: int, name: str) -> Any:
    """Return time, state after and saltation of the next impact, of all motions through a set; none comes before."""
    late, reached = system.impact(system.flow(time - start) * state, stop, name)
    taken = time - start + late
    system.fly(state, taken, 0, stop, f"the flight to {name}")
    return start + taken, *system.strike(reached, stop), taken


def contracts(orbit: Solution, states: list[arb_mat], matrix: arb_mat, section: arb, size: arb) -> tuple[Any, arb_mat]:
    """Show that a ball around an orbit is mapped into itself, contracting; return its norm and its centre."""
    system, n = orbit.system, 2 * orbit.system.size
    start = system.flow(section - orbit.times[0]) * states[0]
    base = system.flow(section - orbit.times[0], free=True)
    power = (base * matrix * base.inv()).mid()
    norm = identity(n)
    for _ in range(60):
        norm = (norm + power.transpose() * norm * power).mid()
        power = (power * power).mid()
    norm = ((norm + norm.transpose()) * arb(0.5)).mid()
    require(definite(norm), "the norm of the ball is not shown to be positive definite")
    inverse = norm.inv()
    box = column([ball(arb(0), (size * inverse[i, i].sqrt()).upper()) for i in range(n)])
    total, now = identity(n), section
    for i, stop in enumerate(orbit.stops):
        last = i == len(orbit.stops) - 1
        mean = start if i == 0 else system.flow(now - orbit.times[i]) * states[i]
        state = mean + column([*(total * box).entries(), 0, 0])
        name = f"impact {i + 1} of the ball"
        hit, after, saltation, taken = pass_impact(system, state, now, orbit.times[i].mid(), stop, name)
        following = section + orbit.turn if last else ((orbit.times[i] + orbit.times[i + 1]) / 2).mid()
        system.fly(after, following - hit, stop, 0, f"the flight after {name}")
        total = system.flow(following - hit, free=True) * saltation * system.flow(taken, free=True) * total
        now = following
    require(definite(norm - total.transpose() * norm * total), "the return map is not shown to contract on the ball")
    return norm, start


class Trajectory:
    """The trajectory from an exact state: a set that contains its state, and the flight that it is on.

    The set is a centre and a box around it. An impact takes the box by the derivative over all of the set, and the
    centre by itself (the mean-value form), so that the box grows little. After an impact the set is that of the motion
    without this impact's stop at one time for all its states, a little before or after their impacts.
    """

    def __init__(self, system: System, centre: arb_mat, time: arb):
        self.system, self.centre, self.time, self.left = system, centre, time, 0
        self.box = column([0] * (2 * system.size))
        self.after, self.begun = centre, time

    @property
    def state(self) -> arb_mat:
        """The set."""
        return self.centre + column([*self.box.entries(), 0, 0])

    def meet(self, stop: int, when: arb, name: str) -> None:
        """Show that the next contact is with this stop at about this time, and go past it."""
        system, ahead = self.system, self.system.flow(when - self.time)
        late, reached = system.impact(ahead * self.state, stop, name)
        system.fly(self.after, when + late - self.begun, self.left, stop, f"the flight to {name}")
        self.after, saltation = system.strike(reached, stop)
        own, struck = system.impact(ahead * self.centre, stop, name)
        new = (when + late).mid()
        moved = system.flow(new - when - own) * system.strike(struck, stop)[0]
        n = 2 * system.size
        free = arb_mat([row[:n] for row in ahead.tolist()[:n]])
        slope = system.flow(new - when - late, free=True) * saltation * system.flow(late, free=True) * free
        middle = moved.mid()
        self.box = slope * self.box + column((moved - middle).entries()[:n])
        self.centre, self.begun = system.with_phase(column(middle.entries()[:n]), new), when + late
        self.time, self.left = new, stop

    def at(self, time: arb) -> arb_mat:
        """Show that there is no contact until a time, and return the set then."""
        self.system.fly(self.after, time - self.begun, self.left, 0, "the flight to the section")
        return self.system.flow(time - self.time) * self.state


def prove_attraction(data: dict[str, Any], theorem: dict[str, Any]) -> dict[str, Any]:
    """Show that the trajectory from an exact initial state is attracted by an orbit."""
    orbit, states, matrix = admissible_orbit(data, theorem)
    system, section, size = orbit.system, exact(theorem["section"]), exact(theorem["size"])
    require(orbit.times[-1] - orbit.turn < section and section < orbit.times[0], "the section is not before impact 1")
    norm, centre = contracts(orbit, states, matrix, section, size)
    places, rates = ([exact(x) for x in theorem[name]] for name in ("displacement", "velocity"))
    time = exact(theorem["phase"]) / system.omega
    state = system.with_phase(column(places + [v / system.scale for v in rates]), time)
    q = (system.row * state)[0, 0]
    inside = all(gap is None or stop * q < gap for stop, gap in system.gaps.items())
    require(inside, "the initial state is not shown to lie between the stops")
    run, transient = Trajectory(system, state, time), theorem["transient"]
    turns = transient["turns"]
    require(type(turns) is int, "the number of returns is not an integer")
    for i, (stop, when) in enumerate(zip(transient["stops"], transient["times"], strict=True)):
        run.meet(stop, exact(when), f"transient impact {i + 1}")
    distance = run.at(section + orbit.turn * turns) * orbit.sign**turns - centre
    away = column(distance.entries()[: 2 * system.size])
    require((away.transpose() * norm * away)[0, 0] < size**2, "the trajectory is not shown to enter the ball")
    return motion(orbit, theorem) | {"stable": True}
