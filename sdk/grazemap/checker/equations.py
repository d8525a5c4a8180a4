"""The equations of a periodic orbit, in the times and velocities of its impacts, and Newton's method for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from flint import arb, arb_mat

from grazemap.checker.arithmetic import ball, column, diagonal, identity, require, stacked
from grazemap.checker.system import System


class Solution(NamedTuple):
    """The impacts of an orbit, or of half a symmetric one: times, velocities, parameter."""

    system: System
    sign: int
    turn: arb
    stops: list[int]
    times: list[arb]
    velocities: list[arb]


class Equations:
    """The equations of a periodic orbit and their derivatives (theory, "Any impacting orbit").

    With e the factors 1 + R and v the velocities, q^(d) just before impact i is that of the steady motion less the sum
    of g^(d)_ij e_j v_j. A matrix `twisted` has the g^(d)_ij for perturbations that return times mu.
    """

    def __init__(self, orbit: Solution, parameter: str | None = None):
        self.orbit, self.parameter, self.count = orbit, parameter, len(orbit.stops)
        system, k, times = orbit.system, range(len(orbit.stops)), orbit.times
        self.rebound = column([system.rebound[stop] for stop in orbit.stops])
        self.force = diagonal(self.rebound) * column(orbit.velocities)
        following = [*times[1:], times[0] + orbit.turn]
        flights = [system.flow(end - start, free=True) for start, end in zip(times, following, strict=True)]
        self.flows = [[identity(0)] * self.count for _ in k]
        for j in k:
            reached = identity(2 * system.size)
            for i in (*range(j + 1, self.count), *range(j + 1)):
                reached = flights[i - 1] * reached
                self.flows[i][j] = reached
        self.around = system.flow(orbit.turn, free=True)
        self.values = self.observed(orbit.sign)
        self.steady = [system.steady(time) for time in times]
        self.motion = [column([s[0][d] for s in self.steady]) - g * self.force for d, g in enumerate(self.values)]

    def responses(self, twist: int, slope: bool = False) -> list[list[arb_mat]]:
        """Return the states at the impacts after unit velocities at others and their images, each times `twist`.

        With `slope`, their derivatives with respect to the frequency at fixed times.
        """
        system, k = self.orbit.system, range(self.count)
        inverse = (identity(2 * system.size) - self.around * twist).inv()
        inside, outside = inverse * system.kick, inverse * system.kick * twist
        if slope:
            outside = system.free * inverse * inverse * system.kick * (-twist * self.orbit.turn / system.omega)
            inside = self.around * outside
        return [[self.flows[i][j] * (inside if j < i else outside) for j in k] for i in k]

    def observed(self, twist: int, slope: bool = False) -> list[arb_mat]:
        """Return the matrices of g and its first three derivatives."""
        rows = self.orbit.system.rows(4)
        seen = [[(rows * state).entries() for state in row] for row in self.responses(twist, slope)]
        return [arb_mat([[entry[d] for entry in row] for row in seen]) for d in range(4)]

    def residual(self) -> list[arb]:
        """Return the equations: q is at its stop, and q' is the velocity, at every impact."""
        stops, system = self.orbit.stops, self.orbit.system
        at_stops = self.motion[0] - column([stop * system.gap(stop) for stop in stops])
        return at_stops.entries() + (self.motion[1] - column(self.orbit.velocities)).entries()

    def jacobian(self, twisted: list[arb_mat]) -> arb_mat:
        """Return J(mu): rows of the equations, columns of times and velocities."""
        force, rebound = diagonal(self.force), diagonal(self.rebound)
        return stacked(
            [diagonal(self.motion[d + 1]) + twisted[d + 1] * force, -twisted[d] * rebound - identity(self.count) * d]
            for d in (0, 1)
        )

    def by_orbit(self, twisted: list[arb_mat], vector: list[arb]) -> arb_mat:
        """Return the derivatives of `jacobian(twisted)` times a vector with respect to times and velocities."""
        w, z = (diagonal(column(half)) for half in (vector[: self.count], vector[self.count :]))
        force, rebound, ones = diagonal(self.force), diagonal(self.rebound), column([1] * self.count)
        rows = []
        for d in (0, 1):
            late = twisted[d + 2] * force * w - twisted[d + 1] * rebound * z
            own = diagonal(w * self.motion[d + 2] + late * ones)
            by_speed = (twisted[d + 1] * w - w * self.values[d + 1]) * rebound
            rows.append([own + w * self.values[d + 2] * force - late, by_speed])
        return stacked(rows)

    def by_parameter(self, twist: int, vector: list[arb]) -> tuple[list[arb], list[arb]]:
        """Return the derivatives of the equations, and of `jacobian` times a vector, by the parameter."""
        k, varies = self.count, self.parameter == "omega"
        bounce = column([int(self.parameter == "restitution")] * k)
        force, factor = diagonal(bounce) * column(self.orbit.velocities), int(varies)
        own, slopes = (
            self.observed(t, slope=True) if varies else [arb_mat(k, k)] * 4 for t in (self.orbit.sign, twist)
        )
        steady = [column([s[1][d] * factor for s in self.steady]) for d in range(4)]
        motion = [steady[d] - self.values[d] * force - own[d] * self.force for d in range(3)]
        stops = column(self.orbit.stops) * int(self.parameter == "clearance")
        twisted = self.observed(twist)
        w, z = (column(half) for half in (vector[:k], vector[k:]))
        change: list[arb] = []
        for d in (0, 1):
            late = (twisted[d + 1] * diagonal(force) + slopes[d + 1] * diagonal(self.force)) * w
            speed = (twisted[d] * diagonal(bounce) + slopes[d] * diagonal(self.rebound)) * z
            change += (diagonal(motion[d + 1]) * w + late - speed).entries()
        return (motion[0] - stops).entries() + motion[1].entries(), change


def newton(centre: list[arb], radius: arb, equations: Callable[[list[arb]], tuple[list[arb], list[list[arb]]]]) -> Any:
    """Return an enclosure of the only zero within a radius of the centre: Newton's operator maps the box into it."""
    box = [ball(x, radius) for x in centre]
    step = arb_mat(equations(box)[1]).solve(column(equations(centre)[0]))
    found = [x - dx for x, dx in zip(centre, step.entries(), strict=True)]
    inside = all(b.contains_interior(x) for b, x in zip(box, found, strict=True))
    require(inside, "Newton's operator does not map the box into itself: no solution is shown to exist in it")
    return found
