"""Whether the statement of a certificate is true: decided without the checker, by closed forms in 100 digits.

The motion between impacts is a sum over the modes of the structure, from the eigenvalues of its first-order matrix; the
checker has matrix exponentials and no modes. A periodic motion with given impacts is the steady motion and the sums of
the impulse responses over all past periods; Newton's method solves for the times and velocities of its impacts. What is
too close to its opposite is not decided.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
from flint import acb, acb_mat, arb, arb_mat, ctx, fmpq

from tests.oracles.general_oracle import GeneralOracle

DIGITS = 100
BITS = 400
STEP = arb(10) ** -30
"""Step of difference quotients."""
CLOSE = 1e-7
"""Distance from a stop, from a period or of a multiplier from the unit circle that decides nothing."""
LINEAR = 3
"""Factor to which equations in a box of at most `SMALL` are trusted to be as far from linear."""
SMALL = 1e-4
SETTLED = 1e-9
"""Change of the impacts of a trajectory from period to period that is taken as settled."""
SAMPLES = 4000
STEPS = 40


class Undecided(Exception):
    """The statement is too close to its opposite, or of a kind that is not decided here."""


def number(text: str) -> arb:
    return arb(fmpq(*Fraction(text).as_integer_ratio()))


class Modes:
    """The exponents and weights of the contact coordinate of an oscillator, and its steady motion at a frequency."""

    def __init__(self, oscillator: dict[str, Any]) -> None:
        mass, damping, stiffness = (
            arb_mat([[number(x) for x in row] for row in oscillator[name]]) for name in ("mass", "damping", "stiffness")
        )
        self.size, self.mass, self.damping, self.stiffness = mass.nrows(), mass, damping, stiffness
        self.row = arb_mat([[number(x) for x in oscillator["contact"]]])
        inverse = mass.inv()
        jump = inverse * self.row.transpose()
        self.jump = jump * (1 / (self.row * jump)[0, 0])
        still, identity = (
            arb_mat(self.size, self.size),
            arb_mat([[int(i == j) for j in range(self.size)] for i in range(self.size)]),
        )
        top = [[*a, *b] for a, b in zip(still.tolist(), identity.tolist(), strict=True)]
        spring, drag = (inverse * stiffness).tolist(), (inverse * damping).tolist()
        below = [[*(-x for x in a), *(-x for x in b)] for a, b in zip(spring, drag, strict=True)]
        self.matrix = arb_mat([*top, *below])
        try:
            values, vectors = acb_mat(self.matrix).eig(right=True)
        except ValueError:
            raise Undecided("the exponents are not simple") from None
        self.exponents = [x.mid() for x in values]
        kick = acb_mat([[0]] * self.size + [[x] for x in self.jump.entries()])
        amounts = vectors.solve(kick).entries()
        seen = (acb_mat([[*self.row.entries(), *[0] * self.size]]) * vectors).entries()
        self.weights = [(a * b).mid() for a, b in zip(seen, amounts, strict=True)]
        sums: dict[int, list[list[list[Fraction]]]] = {}
        for part in oscillator["forcing"]:
            for power, pair in enumerate(part["powers"]):
                known = sums.setdefault(part["harmonic"], [])
                if len(known) <= power:
                    known.append([[Fraction(0)] * self.size, [Fraction(0)] * self.size])
                for total, row in zip(known[power], pair, strict=True):
                    total[:] = [a + Fraction(b) for a, b in zip(total, row, strict=True)]
        self.forces = {k: p for k, p in sums.items() if any(x for pair in p for row in pair for x in row)}
        self.divisor = math.gcd(*self.forces) or 1
        bias = [number(x) for x in oscillator.get("bias", ["0"] * self.size)]
        rest = stiffness.solve(arb_mat([[x] for x in bias])) if any(x != 0 for x in bias) else arb_mat(self.size, 1)
        self.place = (self.row * rest)[0, 0].mid()
        self.decays = all(x.real < 0 for x in self.exponents)

    def amplitudes(self, omega: arb) -> dict[int, acb]:
        """X_k of the contact coordinate, q = Im sum X_k exp(i k omega t)."""
        amplitudes = {}
        for order, powers in self.forces.items():
            s = order * omega
            force = [
                sum((acb(number(str(a[i])), number(str(b[i]))) * s**j for j, (a, b) in enumerate(powers)), acb(0))
                for i in range(self.size)
            ]
            dynamic = acb_mat(self.stiffness) - acb_mat(self.mass) * s**2 + acb_mat(self.damping) * acb(0, s)
            amplitudes[order] = (acb_mat(self.row) * dynamic.solve(acb_mat([[x] for x in force])))[0, 0].mid()
        return amplitudes

    def response(self, kind: str, time: arb) -> arb:
        """g(t), or its sums h and h_s over the multiples of t."""
        twist = {"g": 0, "h": 1, "h_s": -1}[kind]
        total = acb(0)
        for weight, exponent in zip(self.weights, self.exponents, strict=True):
            grown = (exponent * time).exp()
            total += weight * grown / (1 - twist * grown)
        return total.real.mid()


class Orbits:
    """Periodic motions with given stops: residuals of times and velocities, admissibility and multipliers.

    With sign -1, `stops` are those of half the period, after which the motion is its mirror image.
    """

    def __init__(self, modes: Modes, inputs: dict[str, Any], period: int, stops: list[int], sign: int = 1) -> None:
        self.modes, self.stops, self.sign = modes, stops, sign
        self.omega, self.gaps, self.rebound = inputs["omega"], inputs["gaps"], inputs["rebound"]
        self.forces_turn = 2 * arb.pi() / (self.omega * modes.divisor)
        self.turn = period * self.forces_turn * (arb(1) if sign > 0 else arb(0.5))
        self.steady = modes.amplitudes(self.omega)
        self.grown = [1 / (1 - sign * (x * self.turn).exp()) for x in modes.exponents]

    def motion(self, time: arb, impacts: list[tuple[arb, arb, int]], derivatives: int) -> list[arb]:
        """q and its derivatives just before a time."""
        values = [acb(0)] * derivatives
        for order, x in self.steady.items():
            turned = x * (acb(0, 1) * order * self.omega * time).exp()
            for j in range(derivatives):
                values[j] += acb((turned * acb(0, order * self.omega) ** j).imag)
        values[0] += self.modes.place
        for then, speed, stop in impacts:
            late = time - then
            turns = math.ceil(float(late / self.turn)) - 1
            late -= self.turn * turns  # in (0, turn]
            push = -self.rebound[stop] * speed * self.sign**turns
            for weight, exponent, grown in zip(self.modes.weights, self.modes.exponents, self.grown, strict=True):
                term = push * weight * grown * (exponent * late).exp()
                for j in range(derivatives):
                    values[j] += term * exponent**j
        return [x.real.mid() for x in values]

    def sampled(self, times: np.ndarray, impacts: list[tuple[arb, arb, int]]) -> np.ndarray:
        """q at many times, in double precision."""
        place = np.full(len(times), float(self.modes.place))
        for order, x in self.steady.items():
            place += np.imag(complex(x) * np.exp(1j * order * float(self.omega) * times))
        turn = float(self.turn)
        for then, speed, stop in impacts:
            late = times - float(then)
            turns = np.ceil(late / turn) - 1.0
            push = -float(self.rebound[stop] * speed) * float(self.sign) ** turns
            for weight, exponent, grown in zip(self.modes.weights, self.modes.exponents, self.grown, strict=True):
                term = complex(weight) * complex(grown) * np.exp(complex(exponent) * (late - turn * turns))
                place += push * term.real
        return place

    def impacts(self, unknowns: list[arb]) -> list[tuple[arb, arb, int]]:
        count = len(self.stops)
        return list(zip(unknowns[:count], unknowns[count : 2 * count], self.stops, strict=True))

    def residual(self, unknowns: list[arb]) -> list[arb]:
        impacts = self.impacts(unknowns)
        before = [self.motion(time, impacts, 2) for time, _, _ in impacts]
        places = [q - stop * self.gaps[stop] for (q, _), stop in zip(before, self.stops, strict=True)]
        return [*places, *(rate - v for (_, rate), (_, v, _) in zip(before, impacts, strict=True))]

    def monodromy(self, impacts: list[tuple[arb, arb, int]]) -> np.ndarray:
        """The derivative of the return map, in double precision, by saltation matrices."""
        modes, size = self.modes, self.modes.size
        total = np.eye(2 * size)
        row = np.array([float(x) for x in modes.row.entries()])
        kick = np.concatenate([np.zeros(size), [float(x) for x in modes.jump.entries()]])
        place, rate = np.concatenate([row, 0 * row]), np.concatenate([0 * row, row])
        free = np.array([[float(x) for x in line] for line in modes.matrix.tolist()])
        for i, (time, speed, stop) in enumerate(impacts):
            acceleration, v, e = float(self.motion(time, impacts, 3)[2]), float(speed), float(self.rebound[stop])
            salt = (
                np.eye(2 * size) - e * np.outer(kick, rate) + e * np.outer(acceleration / v * kick - free @ kick, place)
            )
            total = salt @ total
            end = impacts[i + 1][0] if i + 1 < len(impacts) else impacts[0][0] + self.turn
            flow = (modes.matrix * (end - time)).exp()
            total = np.array([[float(x) for x in line] for line in flow.tolist()]) @ total
        return total

    def is_admissible(self, impacts: list[tuple[arb, arb, int]], grazes: list[tuple[arb, int]]) -> bool:
        """Whether the impacts move into their stops, and q stays between the stops at many times elsewhere.

        Around a graze, given by its time and its stop, q must stay below the stop by a tenth of its parabola.
        """
        if any(stop * float(v) < -CLOSE for _, v, stop in impacts):
            return False
        if any(stop * float(v) < CLOSE for _, v, stop in impacts):
            raise Undecided("an impact is almost a graze")
        turn = float(self.turn)
        times = np.linspace(0.0, turn, SAMPLES, endpoint=False) + (float(impacts[0][0]) if impacts else 0.0)

        def away(time: arb) -> np.ndarray:
            return np.abs((times - float(time) + 0.5 * turn) % turn - 0.5 * turn)

        margin = np.full(SAMPLES, math.inf)
        places = self.sampled(times, impacts)
        for stop, gap in self.gaps.items():
            if gap is not None:
                margin = np.minimum(margin, float(gap) - stop * places)
        for time, _, _ in impacts:
            margin[away(time) < turn / SAMPLES] = math.inf
        for time, stop in grazes:
            curvature = -stop * float(self.motion(time, impacts, 3)[2])
            if curvature < CLOSE:
                raise Undecided("a graze is hardly curved")
            near = away(time) < turn / 200
            if np.any(margin[near] < 0.1 * curvature * away(time)[near] ** 2 - CLOSE**2):
                raise Undecided("the motion comes close to a stop beside a graze")
            margin[near] = math.inf
        if np.min(margin) < -CLOSE:
            return False
        if np.min(margin) < 1e-5:  # a maximum between two samples may pass
            raise Undecided("the motion comes close to a stop elsewhere")
        return True


def newton(function: Callable[[list[arb]], list[arb]], start: list[arb]) -> list[arb]:
    unknowns = [x.mid() for x in start]
    for _ in range(STEPS):
        here = function(unknowns)
        rows = []
        for j in range(len(unknowns)):
            moved = function([x + STEP * (i == j) for i, x in enumerate(unknowns)])
            rows.append([((b - a) / STEP).mid() for a, b in zip(here, moved, strict=True)])
        try:
            jacobian = arb_mat(rows).transpose()
            step = jacobian.solve(arb_mat([[x.mid()] for x in here]), algorithm="approx").entries()
        except ZeroDivisionError:
            raise Undecided("the equations are singular") from None
        unknowns = [(x - dx).mid() for x, dx in zip(unknowns, step, strict=True)]
        largest = max(abs(float(dx)) for dx in step)
        if largest > 1e3:
            break
        if largest < 1e-60:
            return unknowns
    raise Undecided("Newton's method does not converge")


def may_hold(residual: Callable[[list[arb]], list[arb]], centre: list[arb], radii: list[arb]) -> bool:
    """Whether the equations can hold in a small box: their values there differ little from those of the derivative."""
    here = residual(centre)
    spans = [arb(0)] * len(here)
    for j, radius in enumerate(radii):
        step = STEP * (1 if radius == 0 else radius)
        moved = residual([x + step * (i == j) for i, x in enumerate(centre)])
        spans = [s + abs((b - a).mid() / step) * radius for s, a, b in zip(spans, here, moved, strict=True)]
    return not any(abs(x.mid()) > LINEAR * s.mid() for x, s in zip(here, spans, strict=True))


def inputs_of(modes: Modes, statement: dict[str, Any], value: arb | None = None) -> dict[str, Any]:
    def of(text: str | None) -> arb | None:
        return None if text is None else value if text == "varied" else number(text)

    sides = {1: "right", -1: "left"}
    gaps = {stop: of(statement["clearance"][side]) for stop, side in sides.items()}
    rebound = {stop: 1 + of(statement["restitution"][side]) for stop, side in sides.items()}
    omega = of(statement["omega"])
    if not omega > 0 or any(not 1 <= e <= 2 for e in rebound.values()):
        raise Undecided("the inputs are out of range")
    known = [gap for gap in gaps.values() if gap is not None]
    if not known or (len(known) == 2 and not sum(known) > 0):
        raise Undecided("the inputs are out of range")
    return {"omega": omega, "gaps": gaps, "rebound": rebound}


def decide(certificate: dict[str, Any]) -> bool:
    """Whether what a certificate says is true, its verdict included. Raises Undecided."""
    ctx.prec = BITS
    statement = certificate["statement"]
    modes = Modes(certificate["oscillator"])
    is_true = KINDS[statement["kind"]](modes, statement, certificate)
    return is_true if certificate["verdict"] == "proven" else not is_true


def of_orbit(modes: Modes, statement: dict[str, Any], _: dict[str, Any]) -> bool:
    if "phases" not in statement:
        raise Undecided("other orbits may have these stops")
    orbits = Orbits(modes, inputs_of(modes, statement), statement["period"], statement["stops"])
    if any(orbits.gaps[stop] is None for stop in statement["stops"]):
        return False
    start = [number(x) / orbits.omega for x in statement["phases"]] + [number(x) for x in statement["velocities"]]
    radius, half = number(statement["radius"]), len(statement["stops"])
    fast = radius * max(abs(x) for x in start[half:])
    if radius < SMALL and not may_hold(orbits.residual, start, [radius / orbits.omega] * half + [fast] * half):
        return False
    unknowns = newton(orbits.residual, start)
    if not box_has(orbits, statement, unknowns):
        return False
    impacts = orbits.impacts(unknowns)
    if not orbits.is_admissible(impacts, []) or repeats(orbits, impacts, statement["period"]):
        return False
    return is_stable(orbits.monodromy(impacts)) == statement["stable"]


def box_has(orbits: Orbits, statement: dict[str, Any], unknowns: list[arb]) -> bool:
    count = len(statement["stops"])
    radius = float(number(statement["radius"]))
    fast = radius * max(abs(float(number(v))) for v in statement["velocities"])
    away = [
        abs(float(t * orbits.omega - number(p))) / radius for t, p in zip(unknowns, statement["phases"], strict=False)
    ]
    speeds = zip(unknowns[count : 2 * count], statement["velocities"], strict=True)
    away += [abs(float(v - number(w))) / fast if fast else 0.0 for v, w in speeds]
    if max(away) > 1.001:
        if max(away) > 1e4:
            raise Undecided("the orbit found is far from the box")
        return False
    if max(away) > 0.999:
        raise Undecided("the orbit is at the edge of the box")
    return True


def repeats(orbits: Orbits, impacts: list[tuple[arb, arb, int]], period: int) -> bool:
    """Whether the impacts repeat after a divisor of the period."""
    for parts in (p for p in range(2, period + 1) if period % p == 0 and len(impacts) % p == 0):
        ahead, time = len(impacts) // parts, float(orbits.turn) / parts
        pairs = list(zip(impacts, impacts[ahead:], strict=False))
        late = [abs(float(b[0] - a[0]) - time) + abs(float(a[1] - b[1])) + (a[2] != b[2]) for a, b in pairs]
        if max(late) < CLOSE:
            return True
    return False


def is_stable(monodromy: np.ndarray) -> bool:
    sizes = np.abs(np.linalg.eigvals(monodromy))
    if np.any(np.abs(sizes - 1.0) < 1e-5):
        raise Undecided("a multiplier is close to the unit circle")
    return bool(np.all(sizes < 1.0))


def of_attraction(modes: Modes, statement: dict[str, Any], certificate: dict[str, Any]) -> bool:
    """Simulated by Taylor series, without modes."""
    if not modes.decays:
        raise Undecided("a free motion does not decay")
    data, inputs = certificate["oscillator"], inputs_of(modes, statement)
    omega = inputs["omega"]
    harmonics = [
        (
            order,
            [
                sum(
                    (acb(number(str(a[i])), number(str(b[i]))) * (order * omega) ** j for j, (a, b) in enumerate(p)),
                    acb(0),
                )
                for i in range(modes.size)
            ],
        )
        for order, p in modes.forces.items()
    ]
    rows = {name: [[number(x) for x in row] for row in data[name]] for name in ("mass", "damping", "stiffness")}
    place = statement["displacement"]
    run = GeneralOracle(
        **rows,
        contact=[number(x) for x in data["contact"]],
        harmonics=harmonics,
        restitution=tuple(inputs["rebound"][stop] - 1 for stop in (1, -1)),
        gaps=tuple(inputs["gaps"][stop] for stop in (1, -1)),
        omega=omega,
        bias=[number(x) for x in data["bias"]] if "bias" in data else None,
        displacement=None if place == "equilibrium" else [number(x) for x in place],
        velocity=[number(x) for x in statement["velocity"]],
        phase=number(statement["phase"]) / 1,
        digits=DIGITS,
    )
    if place != "equilibrium":
        contact = sum((h * x for h, x in zip(run.contact, run.displacement, strict=True)), arb(0))
        if any(gap is not None and not stop * contact < gap for stop, gap in inputs["gaps"].items()):
            raise Undecided("the state is on a stop or beyond it")
    turn = float(2 * arb.pi() / (omega * modes.divisor))
    for end in range(30, 301, 30):
        run.run(until=end * turn)
        if run.rests:
            raise Undecided("the trajectory rests")
        times, stops, speeds = ([float(x) for x in values] for values in (run.times, run.stops, run.speeds))
        for period in range(1, 16):
            change, label = last_change(times, [int(x) for x in stops], speeds, period, turn, end * turn)
            if change < SETTLED:
                return statement.get("label", label) == label
            if change < CLOSE:  # of a smaller period than that of the motion to come, or not yet settled
                break
    raise Undecided("the trajectory does not settle")


def last_change(
    times: list[float], stops: list[int], speeds: list[float], n: int, turn: float, end: float
) -> tuple[float, str]:
    """The change of the impacts from the last n periods but n to the last n, and the label of these."""
    last = [i for i, t in enumerate(times) if t > end - n * turn]
    before = [i for i, t in enumerate(times) if end - 2 * n * turn < t <= end - n * turn]
    right, left = (sum(stops[i] == stop for i in last) or "(-1)" for stop in (1, -1))
    label = f"{n}-{right}r-{left}l"
    if len(last) != len(before) or any(stops[i] != stops[j] for i, j in zip(last, before, strict=True)):
        return math.inf, label
    pairs = list(zip(last, before, strict=True))
    changes = (abs(times[i] - times[j] - n * turn) + abs(speeds[i] - speeds[j]) for i, j in pairs)
    return max(changes, default=0.0), label


def of_bifurcation(modes: Modes, statement: dict[str, Any], certificate: dict[str, Any]) -> bool:
    """Solved for the impacts, the value and, of a graze, its time; the condition by differences."""
    if "phases" not in statement:
        raise Undecided("the statement names no orbit")
    guess, kind = number(certificate["theorem"]["value"]), statement["type"]
    low, high = (number(x) for x in statement["range"])
    speeds, period = [number(v) for v in statement["velocities"]], statement["period"]
    grazes = [i for i, v in enumerate(speeds) if v == 0]
    if (kind == "GR") != bool(grazes):
        if kind == "GR" and min(abs(v) for v in speeds) > number(statement["radius"]) * max(abs(v) for v in speeds):
            return False
        raise Undecided("a velocity of 0 does not fit the type")
    sign = -1 if kind == "SB" or len(grazes) == 2 else 1
    if sign < 0:
        require_mirrored(modes, statement)
    contacts = range(len(speeds) // (2 if sign < 0 else 1))
    struck, grazed = [i for i in contacts if speeds[i] != 0], [i for i in contacts if speeds[i] == 0]
    if len(grazed) > 1:
        raise Undecided("several grazes")
    stops = [statement["stops"][i] for i in struck]

    def orbits_at(value: arb) -> Orbits:
        return Orbits(modes, inputs_of(modes, statement, value), period, stops, sign)

    here = orbits_at(guess)
    times = [number(p) / here.omega for p in statement["phases"]]
    start = [times[i] for i in struck] + [speeds[i] for i in struck] + [guess]
    if grazed:
        stop, start = statement["stops"][grazed[0]], [*start, times[grazed[0]]]

        def condition(orbits: Orbits, unknowns: list[arb]) -> list[arb]:
            place, rate = orbits.motion(unknowns[-1], orbits.impacts(unknowns), 2)
            return [place - stop * orbits.gaps[stop], rate]
    else:
        critical = {"SN": 1, "PD": -1, "SB": 1}[kind]

        def condition(orbits: Orbits, unknowns: list[arb]) -> list[arb]:
            return [exact_determinant(orbits, orbits.impacts(unknowns), critical)]

    def residual(unknowns: list[arb]) -> list[arb]:
        orbits = orbits_at(unknowns[2 * len(stops)])
        return [*orbits.residual(unknowns), *condition(orbits, unknowns)]

    radius = number(statement["radius"])
    radii = [radius / here.omega] * len(struck) + [radius * max(abs(v) for v in speeds)] * len(struck) + [high - low]
    radii += [radius / here.omega] * len(grazed)
    small = max(float(radius), float((high - low) / guess)) < SMALL
    if small and low <= guess <= high and not may_hold(residual, start, radii):
        return False
    unknowns = newton(residual, start)
    value = unknowns[2 * len(stops)]
    if not (low < value < high):
        return False
    orbits = orbits_at(value)
    impacts = orbits.impacts(unknowns)
    touched = {i: (t, v, stop) for i, (t, v, stop) in zip(struck, impacts, strict=True)}
    touched |= {i: (unknowns[-1], arb(0), statement["stops"][i]) for i in grazed}
    if sign < 0:
        touched |= {i + len(contacts): (t + orbits.turn, -v, -stop) for i, (t, v, stop) in touched.items()}
        impacts = [touched[i] for i in range(len(speeds)) if speeds[i] != 0]
        stops = [stop for _, _, stop in impacts]
        orbits = Orbits(modes, inputs_of(modes, statement, value), period, stops)
    every = [touched[i] for i in range(len(speeds))]
    if not box_has(orbits, statement, [t for t, _, _ in every] + [v for _, v, _ in every]):
        return False
    touching = [(touched[i][0], touched[i][2]) for i in grazes]
    return orbits.is_admissible(impacts, touching) and not repeats(orbits, impacts, period)


def require_mirrored(modes: Modes, statement: dict[str, Any]) -> None:
    """Decide only for machines and stops that are their own mirror images."""
    half, sides = len(statement["stops"]) // 2, (statement["clearance"], statement["restitution"])
    mirrored = [-stop for stop in statement["stops"][:half]] == statement["stops"][half:]
    alike = all(pair["right"] == pair["left"] for pair in sides) and modes.place == 0
    if not (mirrored and alike and statement["period"] % 2 and all(k // modes.divisor % 2 for k in modes.forces)):
        raise Undecided("whether the orbit is symmetric is not decided")


def exact_determinant(orbits: Orbits, impacts: list[tuple[arb, arb, int]], critical: int) -> arb:
    """det(M - mu I) of the return map, with all digits."""
    modes, size = orbits.modes, orbits.modes.size
    identity = arb_mat([[int(i == j) for j in range(2 * size)] for i in range(2 * size)])
    total, still = identity, [arb(0)] * size
    kick = arb_mat([[x] for x in [*still, *modes.jump.entries()]])
    place, rate = arb_mat([[*modes.row.entries(), *still]]), arb_mat([[*still, *modes.row.entries()]])
    for i, (time, speed, stop) in enumerate(impacts):
        acceleration, e = orbits.motion(time, impacts, 3)[2], orbits.rebound[stop]
        salt = identity - kick * rate * e + (kick * (acceleration / speed) - modes.matrix * kick) * place * e
        end = impacts[i + 1][0] if i + 1 < len(impacts) else impacts[0][0] + orbits.turn
        total = ((modes.matrix * (end - time)).exp() * salt * total).mid()
    return (total - identity * critical).det().mid()


def of_codimension_two(modes: Modes, statement: dict[str, Any], certificate: dict[str, Any]) -> bool:
    kind, order, stop = statement["type"], statement["order"], statement.get("stop")
    if not modes.decays:
        raise Undecided("a free motion does not decay")
    low, high = (number(x) for x in statement["range"])
    if not 0 < low < high:
        return False

    def value(omega: arb) -> arb:
        return modes.response(kind, arb.pi() * order / (omega * modes.divisor))

    if stop is not None:
        if stop and order % 2:
            return False
        odd = all(k // modes.divisor % 2 for k in modes.forces)
        if not modes.forces or (not stop and not (odd and modes.place == 0)):
            return False
    places = [low + (high - low) * k / 400 for k in range(401)]
    values = [value(x) for x in places]
    if not any(a * b < 0 for a, b in pairwise(values)):
        if min(abs(float(x)) for x in values) < CLOSE * max(abs(float(x)) for x in values):
            raise Undecided("the function nearly vanishes")
        return False
    if stop is not None and not grazes_once(modes, number(certificate["theorem"]["value"]), stop or 1):
        raise Undecided("the maxima of the steady motion are almost equal")
    return True


def grazes_once(modes: Modes, omega: arb, stop: int) -> bool:
    """Whether the steady motion has one highest maximum in T that is well above the others."""
    phase = np.linspace(0.0, 2.0 * np.pi, SAMPLES, endpoint=False)
    moved = np.zeros_like(phase)
    for k, x in modes.amplitudes(omega).items():
        z = complex(float(x.real), float(x.imag))
        moved += stop * (z * np.exp(1j * (k // modes.divisor) * phase)).imag
    peaks = np.sort(moved[(moved > np.roll(moved, 1)) & (moved >= np.roll(moved, -1))])
    size = np.abs(moved).max()
    return size > 1e-12 and (len(peaks) < 2 or peaks[-1] - peaks[-2] > 1e-6 * size)


KINDS: dict[str, Callable[[Modes, dict[str, Any], dict[str, Any]], bool]] = {
    "orbit": of_orbit,
    "attraction": of_attraction,
    "bifurcation": of_bifurcation,
    "codimension-two": of_codimension_two,
}
