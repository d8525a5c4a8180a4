"""Requests as engineers write them, in SI, drawn at random: seven kinds of machines, most processes, odd cases too.

A machine is drawn from what its drawing fixes: masses, natural frequencies, damping ratios. What drives it is drawn so
that the contact moves about as far as the stops are away, as a question about stops supposes: forces from the
clearance, and the clearance from the balance quality of a rotor or the acceleration of a base. All numbers are rounded
to three digits, those of matrices to seven.

`STYLES` are the cases. In the usual one the frequencies lie about a resonance that the contact sees, and the stops
between a tenth of the amplitude and a little beyond it. The others are right too, and look odd.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pydantic import ValidationError

from grazemap.wire import Oscillator, ProcessRequest, parse_request
from grazemap.wire.linear import contact_equilibrium, steady_amplitude

Body = dict[str, Any]
GRAVITY = 9.81
DIGITS, MATRIX_DIGITS = 3, 7
MOST_DAMPED = 0.5  # damping ratio of the modes above the first, which a proportional damping has grow with frequency
TRIES = 50  # of one case, of which a machine may have none
# Bounds of what a machine has, in SI; what falls outside them is drawn again.
STIFFNESS = (30.0, 5e8)
CLEARANCE = (2e-5, 0.3)
ACCELERATION = (0.2, 5000.0)  # of the contact when it moves as far as the stop
SPECIFIC_FORCE = (1e-3, 50.0)  # forces over the weight of the machine
RELATIVE_SIZE = 0.3  # clearance over the size of the machine, a cube of its mass with
DENSITY = 500.0  # kg/m^3
# A range below resonance starts above this share of the lowest one that counts: nobody asks for impacts below it but in
# a wide sweep, and it is where Hz for rad/s would lie.
LOWEST = 0.3
STYLES = {
    "usual": 0.72,
    "above resonance": 0.04,
    "below resonance": 0.04,
    "higher mode": 0.04,
    "close stop": 0.03,
    "far stop": 0.03,
    "preload": 0.03,
    "weight": 0.02,
    "zero clearance": 0.02,
    "wide sweep": 0.02,
    "without damping": 0.01,
}
"""The cases, and the share of each."""


class Unsuitable(Exception):
    """What was drawn is no request that an engineer would write."""


@dataclass
class Machine:
    """A machine, driven by a unit of what drives it."""

    oscillator: Body
    drive: str
    """force, unbalance or base."""
    stops: str
    """both: alike; right: one stop; unlike: one distance for each."""
    resonance: int = 0
    """The mode, counted from 0, whose resonance is asked about."""

    def model(self, **changes: Any) -> Oscillator:
        return Oscillator(**{**self.oscillator, **changes})


@dataclass
class Case:
    """A request with what it was drawn from."""

    machine: str
    style: str
    process: str
    body: Body
    facts: dict[str, float] = field(default_factory=dict)
    """omega over the resonance that is asked about, and the clearance over the amplitude."""

    def request(self, body: Body | None = None) -> ProcessRequest:
        return parse_request(self.process, self.body if body is None else body)

    def __str__(self) -> str:
        facts = ", ".join(f"{name} {value:.3g}" for name, value in self.facts.items())
        return f"{self.machine}, {self.process}, {self.style}: {facts}"


class Draw:
    """A source of numbers."""

    def __init__(self, random: np.random.Generator) -> None:
        self.random = random

    def between(self, low: float, high: float) -> float:
        return float(self.random.uniform(low, high))

    def log(self, low: float, high: float) -> float:
        return float(np.exp(self.random.uniform(np.log(low), np.log(high))))

    def chance(self, probability: float) -> bool:
        return bool(self.random.random() < probability)

    def choice(self, values: Any, weights: Any = None) -> Any:
        several = list(values)
        shares = None if weights is None else np.array(list(weights)) / sum(weights)
        return several[int(self.random.choice(len(several), p=shares))]

    def spread(self, value: float, factor: float, count: int) -> list[float]:
        """Return numbers about a value."""
        return [value * self.log(1.0 / factor, factor) for _ in range(count)]

    def ratio(self) -> float:
        """Return a damping ratio: that of a metal part, of a bolted structure, of a damper."""
        return self.choice([self.log(0.001, 0.01), self.log(0.005, 0.05), self.log(0.05, 0.2)], [0.3, 0.5, 0.2])

    def restitution(self, pair: bool = False) -> Any:
        if pair and self.chance(0.6):
            return {"right": rounded(self.between(0.3, 0.95)), "left": rounded(self.between(0.3, 0.95))}
        return self.choice([rounded(self.between(0.3, 0.95)), 0.0, 1.0], [0.94, 0.03, 0.03])


def rounded(value: Any, digits: int = DIGITS) -> Any:
    """Return a number, or all of a list or a mapping, to some digits; integers and texts stay."""
    if isinstance(value, dict):
        return {name: rounded(item, MATRIX_DIGITS if name == "matrices" else digits) for name, item in value.items()}
    if isinstance(value, list):
        return [rounded(item, digits) for item in value]
    return float(f"{value:.{digits}g}") + 0.0 if isinstance(value, float) else value


def chain(draw: Draw, count: int, heavy: float, frequency: float, ratio: float) -> Body:
    """Return a chain whose lowest natural frequency is so many rad/s, with masses up to about `heavy`."""
    alike = 1.0 if draw.chance(0.3) else 1.7
    masses = draw.spread(heavy, alike, count)
    stiffnesses = draw.spread(heavy * frequency**2, alike, count)
    lowest = Oscillator(masses=masses, stiffnesses=stiffnesses, forcing=[1.0] * count).natural_frequencies[0]
    stiffnesses = [stiffness * (frequency / float(lowest)) ** 2 for stiffness in stiffnesses]
    return links({"units": "SI", "masses": masses, "stiffnesses": stiffnesses}, draw, frequency, ratio)


def links(structure: Body, draw: Draw, frequency: float, ratio: float) -> Body:
    """Return a chain with dampers: coefficients of its links, or one time of a proportional damping."""
    each = [2.0 * ratio * stiffness / frequency for stiffness in structure["stiffnesses"]]
    uneven = [coefficient * draw.log(0.6, 1.6) for coefficient in each]
    damping: Any = draw.choice([each, uneven, ratio / frequency], [0.3, 0.4, 0.3])
    return structure | {"damping": damping}


def speed(draw: Draw, heavy: float) -> float:
    """Return a natural frequency in rad/s that a machine of that mass has."""
    highest = min(200.0, 60.0 * (10.0 / heavy) ** 0.25)
    return 2.0 * math.pi * draw.log(1.5, highest)


def one_stop(draw: Draw) -> Machine:
    """A relay, a hammer, a gate: one mass and one stop."""
    heavy = draw.log(0.005, 300.0)
    oscillator = chain(draw, 1, heavy, speed(draw, heavy), draw.ratio())
    return Machine(oscillator | {"forcing": [1.0], "restitution": draw.restitution()}, "force", "right")


def two_stops(draw: Draw) -> Machine:
    """A carriage between two buffers, with a static load."""
    count, heavy = draw.choice([2, 2, 3]), draw.log(0.05, 300.0)
    oscillator = chain(draw, count, heavy, speed(draw, heavy), draw.ratio())
    alone = [1.0] + [0.0] * (count - 1)
    oscillator |= {"forcing": alone, "restitution": draw.restitution(pair=True)}
    return Machine(oscillator | ({"bias": alone} if draw.chance(0.8) else {}), "force", "unlike")


def impact_damper(draw: Draw) -> Machine:
    """A block on a soft spring in a box, which is forced, or stands on a shaken ground; sometimes on two storeys."""
    heavy, count = draw.log(0.3, 300.0), draw.choice([2, 2, 3])
    frequency = speed(draw, heavy)
    below = chain(draw, count - 1, heavy, frequency, draw.ratio())
    block = heavy * draw.log(0.02, 0.2)
    soft = frequency * draw.log(0.05, 0.4)
    structure = {
        "units": "SI",
        "masses": [block, *below["masses"]],
        "stiffnesses": [block * soft**2, *below["stiffnesses"]],
    }
    dampers = below["damping"]
    if not isinstance(dampers, list):
        dampers = [2.0 * dampers * stiffness for stiffness in below["stiffnesses"]]
    structure |= {"damping": [2.0 * draw.log(0.005, 0.1) * block * soft, *dampers], "contact": [1, 2]}
    structure |= {"restitution": draw.restitution()}
    if draw.chance(0.25):
        return Machine(structure | {"base": {"amplitude": 1.0, "stops_move": False}}, "base", "both", 1)
    return Machine(structure | {"forcing": [0.0, 1.0, *[0.0] * (count - 2)]}, "force", "both", 1)


def rotor(draw: Draw) -> Machine:
    """A rotor on an elastic shaft in a housing, with some unbalance."""
    heavy = draw.log(0.3, 1000.0)
    frequency = 2.0 * math.pi * draw.log(8.0, 150.0)
    shaft = heavy * frequency**2
    housing, ratio = heavy * draw.log(1.5, 8.0), draw.log(0.003, 0.06)
    support = housing * (frequency * draw.log(1.3, 4.0)) ** 2
    oscillator = {
        "units": "SI",
        "masses": [heavy, housing],
        "stiffnesses": [shaft, support],
        "damping": [2.0 * ratio * shaft / frequency, 2.0 * draw.log(0.005, 0.05) * math.sqrt(support * housing)],
        "forcing": {"amplitude": [1.0, 0.0], "law": "unbalance"},
        "contact": [1, 2],
        "restitution": draw.restitution(),
    }
    return Machine(oscillator, "unbalance", draw.choice(["both", "right"], [0.9, 0.1]))


def shaken_base(draw: Draw) -> Machine:
    """A rack, a board, a building on a ground that moves."""
    count, heavy = draw.choice([1, 2, 3, 4, 6]), draw.log(0.02, 500.0)
    frequency = 2.0 * math.pi * draw.log(0.8, 60.0)
    oscillator = chain(draw, count, heavy, frequency, draw.ratio()) | {"restitution": draw.restitution()}
    base = {"amplitude": 1.0, "stops_move": draw.chance(0.7)}
    return Machine(oscillator | {"base": base}, "base", draw.choice(["both", "right"], [0.8, 0.2]))


def plain_chain(draw: Draw) -> Machine:
    """Some masses in a row between two equal stops, of which one or each is forced; sometimes in two harmonics."""
    count, heavy = draw.choice([2, 3, 4, 6, 10]), draw.log(0.01, 100.0)
    oscillator = chain(draw, count, heavy, speed(draw, heavy), draw.ratio()) | {"restitution": draw.restitution()}
    alone = [1.0] + [0.0] * (count - 1)
    forcing: Any = draw.choice([alone, [1.0] * count, alone[::-1]], [0.6, 0.2, 0.2])
    if draw.chance(0.1):
        forcing = [{"amplitude": forcing}, {"amplitude": [0.3 * part for part in forcing], "harmonic": 3}]
    return Machine(oscillator | {"forcing": forcing}, "force", "both")


def dense(draw: Draw) -> Machine:
    """A cantilever by the matrices of some of its points, or by its modes, whose tip meets a stop."""
    if draw.chance(0.35):
        return modal(draw)
    count, heavy = draw.choice([2, 3, 4, 5]), draw.log(0.02, 100.0)
    frequency = speed(draw, heavy)
    place = np.arange(1, count + 1) / count
    near, far = np.minimum.outer(place, place), np.maximum.outer(place, place)
    stiffness = np.linalg.inv(near**2 * (3.0 * far - near))
    mass = np.diag([heavy / count] * (count - 1) + [0.5 * heavy / count + heavy * draw.log(0.02, 1.0)])
    lowest = float(np.min(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real))
    stiffness *= frequency**2 / lowest
    stiffness = 0.5 * (stiffness + stiffness.T)
    ratio = draw.ratio()
    damping: Any = draw.choice(
        [
            {"modal": ratio},
            {"rayleigh": [ratio * frequency, ratio / frequency]},
            (ratio * frequency * mass + ratio / frequency * stiffness).tolist(),
        ],
        [0.35, 0.15, 0.5],
    )
    row = [0.0] * (count - 1) + [1.0]
    forced = [0.0] * count
    forced[int(draw.random.integers(count))] = 1.0
    oscillator: Body = {
        "units": "SI",
        "matrices": {"mass": mass.tolist(), "damping": damping, "stiffness": stiffness.tolist()},
        "contact": {"row": row},
        "restitution": draw.restitution(),
    }
    stops = draw.choice(["right", "both"])
    if draw.chance(0.2):
        base = {"amplitude": 1.0, "stops_move": True, "influence": [1.0] * count}
        return Machine(oscillator | {"base": base}, "base", stops)
    return Machine(oscillator | {"forcing": forced}, "force", stops)


def modal(draw: Draw) -> Machine:
    """A cantilever by some of its modes of unit modal mass."""
    count, heavy = draw.choice([2, 3, 4]), draw.log(0.02, 100.0)
    frequencies = speed(draw, heavy) * np.array([1.0, 6.27, 17.5, 34.4][:count])
    tip = 2.0 / math.sqrt(heavy) * np.array([1.0, -1.0, 1.0, -1.0][:count])
    middle = tip * np.array([0.34, -0.71, 0.02, 0.7][:count])
    oscillator = {
        "units": "SI",
        "matrices": {
            "mass": np.eye(count).tolist(),
            "damping": {"modal": [draw.log(0.003, 0.03) for _ in range(count)]},
            "stiffness": np.diag(frequencies**2).tolist(),
        },
        "contact": {"row": tip.tolist()},
        "forcing": middle.tolist(),
        "restitution": draw.restitution(),
    }
    return Machine(oscillator, "force", "right")


MACHINES: dict[str, Callable[[Draw], Machine]] = {
    "one stop": one_stop,
    "two unlike stops": two_stops,
    "impact damper": impact_damper,
    "unbalanced rotor": rotor,
    "shaken base": shaken_base,
    "plain chain": plain_chain,
    "dense model": dense,
}


def is_modal(oscillator: Body) -> bool:
    """Whether the coordinates are those of modes, whose masses are 1 in any units."""
    return "matrices" in oscillator and all(row[k] == 1.0 for k, row in enumerate(oscillator["matrices"]["mass"]))


@dataclass
class Place:
    """Where a machine is asked about: a frequency, a window of it, the distances of the stops, in SI."""

    omega: float
    window: tuple[float, float]
    gap: float
    """Distance of the right stop from the equilibrium; that of both where they are alike."""
    left: float | None
    """Distance of the left stop from the equilibrium; None: there is none, or both are alike."""
    equilibrium: float = 0.0

    def clearance(self, stops: str, gap: Any = None) -> Any:
        """Return the clearances as they are written, with a range of gaps in place of the right one if there is any."""
        right = self.gap + self.equilibrium if gap is None else gap
        if stops == "both":
            return right
        if self.left is None:
            return {"right": right} if gap is None else {"right": right, "left": None}
        return {"right": right, "left": self.left - self.equilibrium}

    def other(self, stops: str) -> Body:
        """Return the field of a curve over the gap of the right stop."""
        if stops == "both":
            return {}
        return {"clearance": {"left": None if self.left is None else self.left - self.equilibrium}}


def frequencies(draw: Draw, machine: Machine, style: str, at_point: bool) -> tuple[float, tuple[float, float]]:
    """Return a frequency and a window around it, about a resonance that the contact sees, or as the style is."""
    model = machine.model()
    natural = model.natural_frequencies
    mode = machine.resonance
    if style == "higher mode":
        if len(natural) < mode + 2 or machine.drive == "unbalance":
            raise Unsuitable
        mode = int(draw.random.integers(mode + 1, min(len(natural), mode + 3)))
    centre, highest = float(natural[mode]), float(natural[-1])
    if style == "above resonance":
        omega = (centre if machine.drive == "unbalance" else highest) * draw.between(1.3, 3.0)
        return omega, (omega, omega * draw.between(1.1, 1.8))
    if style == "below resonance":
        omega = centre * draw.between(LOWEST + 0.15, 0.8)
        return omega, (max(LOWEST * centre, omega * draw.between(0.5, 0.9)), omega)
    if style == "wide sweep":
        return centre, (centre * draw.between(0.1, 0.4), highest * draw.between(1.5, 3.0))
    if style == "without damping":
        omega = centre * draw.choice([draw.between(0.6, 0.9), draw.between(1.1, 1.4)])
        return omega, (omega * 0.97, omega * 1.03)
    wide = draw.log(0.03, 0.4)
    window = centre * (1.0 - wide * draw.between(0.3, 1.0)), centre * (1.0 + wide * draw.between(0.3, 1.0))
    return centre * draw.between(0.8, 1.25) if at_point else draw.between(*window), window


def share_of_amplitude(draw: Draw, style: str) -> float:
    """Return the distance of the stop over the amplitude."""
    if style in ("close stop", "far stop"):
        return draw.log(0.003, 0.03) if style == "close stop" else draw.between(2.0, 5.0)
    return draw.log(0.1, 1.3)


def driven(draw: Draw, machine: Machine, style: str, at_point: bool) -> tuple[Place, float]:
    """Give a machine its drive; return where it is asked about, and its amplitude there."""
    omega, window = frequencies(draw, machine, style, at_point)
    model = machine.model(**({"bias": None} if "bias" in machine.oscillator else {}))
    grid = np.array([omega]) if at_point else np.geomspace(*window, 200)
    unit = float(np.max(steady_amplitude(model, grid)))
    if not np.isfinite(unit) or unit <= 0.0:
        raise Unsuitable
    share = share_of_amplitude(draw, style)
    if machine.drive == "force":
        gap = draw.log(5e-5, 2e-2)
        amount = gap / (share * unit)
    elif machine.drive == "unbalance":
        amount = machine.oscillator["masses"][0] * draw.log(4e-4, 4e-2) / omega
        gap = share * unit * amount
    else:
        amount = draw.log(0.05, 2.0) * GRAVITY / omega**2
        gap = share * unit * amount
    require_sensible(machine, omega, gap, amount)
    give(machine, amount)
    left = gap * draw.log(0.5, 2.0) if machine.stops == "unlike" else None
    return Place(omega, window, gap, left), unit * amount


def weight(oscillator: Body) -> float:
    """Return the weight of a machine: in modal coordinates that of a part of its effective mass."""
    if is_modal(oscillator):
        return GRAVITY * 4.0 / oscillator["contact"]["row"][0] ** 2
    masses = oscillator["masses"] if "masses" in oscillator else np.diag(oscillator["matrices"]["mass"])
    return GRAVITY * float(sum(masses))


def require_sensible(machine: Machine, omega: float, gap: float, amount: float) -> None:
    """Refuse what no machine has."""
    heavy = weight(machine.oscillator)
    within = [
        (gap, CLEARANCE),
        (gap * omega**2, ACCELERATION),
        (gap / (heavy / GRAVITY / DENSITY) ** (1 / 3), (0.0, RELATIVE_SIZE if machine.drive != "base" else 1.0)),
        *((stiffness, STIFFNESS) for stiffness in machine.oscillator.get("stiffnesses", ())),
    ]
    if machine.drive == "force":
        within.append((amount / heavy, SPECIFIC_FORCE))
    if not all(low <= value <= high for value, (low, high) in within):
        raise Unsuitable


def give(machine: Machine, amount: float) -> None:
    """Multiply what drives a machine."""
    oscillator = machine.oscillator
    if machine.drive == "base":
        oscillator["base"] = {**oscillator["base"], "amplitude": amount}
        return
    forces = oscillator["forcing"]
    if isinstance(forces, dict) or isinstance(forces[0], dict):
        several = [forces] if isinstance(forces, dict) else forces
        scaled = [force | {"amplitude": [amount * part for part in force["amplitude"]]} for force in several]
        oscillator["forcing"] = scaled[0] if isinstance(forces, dict) else scaled
    else:
        oscillator["forcing"] = [amount * part for part in forces]


def load(draw: Draw, machine: Machine, style: str, place: Place) -> None:
    """Give a machine its static load, and its stops their places from where no spring is stretched."""
    oscillator = machine.oscillator
    if style == "preload":
        if machine.stops == "both":
            raise Unsuitable
        if draw.chance(0.5) and machine.stops == "right":  # a spring that presses the mass against the stop
            place.gap *= -draw.between(0.1, 0.6)
            return
        oscillator["bias"] = [1.0 if value else 0.0 for value in machine.model().contact_row]
    if style == "weight":
        if "masses" not in oscillator or machine.stops == "both":
            raise Unsuitable
        oscillator["bias"] = [GRAVITY * mass for mass in oscillator["masses"]]
    elif style == "zero clearance":
        if machine.stops != "right":
            raise Unsuitable
        place.gap = 0.0
    if "bias" not in oscillator:
        return
    place.equilibrium = contact_equilibrium(machine.model())
    if style != "weight":
        share = draw.between(1.05, 2.0) if style == "preload" else draw.between(-0.6, 0.6)
        factor = share * place.gap / place.equilibrium
        oscillator["bias"] = [factor * force for force in oscillator["bias"]]
        # the place of the stops is fixed; a load beyond it presses the contact against the stop
        shift = share * place.gap
        place.equilibrium = shift if style != "preload" else 0.0


def of_range(ends: tuple[float, float], points: int | None) -> Body:
    values: Body = {"start": min(ends), "stop": max(ends)}
    return values if points is None else values | {"points": points}


AT_POINT = {"trajectories": 0.24, "periodic-orbits": 0.1, "orbit-branches": 0.08, "basins": 0.05}
IN_WINDOW = {
    "grazing-curves": 0.15,
    "codimension-two-points": 0.04,
    "unfolding-maps": 0.14,
    "unfolding-diagrams": 0.04,
    "bifurcation-curves": 0.03,
    "bifurcation-diagrams": 0.1,
    "basin-fractions": 0.03,
    "structures": 0.1,
}
"""The processes, and the share of each: those at one point, and those over frequencies."""


def at_point(draw: Draw, process: str, machine: Machine, place: Place) -> Body:
    """Return the fields of a request at one point."""
    body: Body = {"omega": place.omega, "clearance": place.clearance(machine.stops)}
    size = machine.model().size
    if process == "trajectories":
        body |= {"periods": draw.choice([8, 20, 50]), "transient_periods": draw.choice([0, 100, 400])}
        if draw.chance(0.15):
            body["initial"] = {"velocity": [place.omega * abs(place.gap) * draw.between(0.1, 1.0)] + [0.0] * (size - 1)}
    elif process == "orbit-branches":
        body["motion"] = {"period": 1, "stops": [1, -1] if machine.stops == "both" else [1]}
        vary = draw.choice(["omega", "clearance" if machine.stops == "both" else "clearance_right", "restitution"])
        value = {"omega": place.omega}.get(vary, place.gap + place.equilibrium)
        if vary == "restitution":
            if not isinstance(machine.oscillator["restitution"], float):
                raise Unsuitable
            body |= {"vary": vary, "range": {"start": 0.0, "stop": 1.0}}
        else:
            ends = value * draw.between(0.5, 0.95), value * draw.between(1.05, 1.8)
            body |= {"vary": vary, "range": of_range(ends, None)}
    elif process == "basins":
        contact = machine.oscillator.get("contact", 1)
        if isinstance(contact, dict) or place.gap <= 0.0 or place.equilibrium:
            raise Unsuitable
        reach = 0.9 * min(place.gap, place.left or place.gap)
        fast = place.omega * place.gap * draw.between(0.5, 2.0)
        body["horizontal"] = {"quantity": "displacement", "values": of_range((-reach, reach), 60)}
        body["vertical"] = {"quantity": "velocity", "values": of_range((-fast, fast), 60)}
    return body


def in_window(draw: Draw, process: str, machine: Machine, place: Place) -> Body:
    """Return the fields of a request over frequencies."""
    points = draw.choice([24, 64, 200])
    omega, stops = of_range(place.window, points), machine.stops
    if process == "structures":
        listed = np.linspace(*place.window, draw.choice([3, 5, 9])).tolist()
        clearance = {"clearance": place.clearance(stops)} if draw.chance(0.5) else {}
        return {"omega": listed if draw.chance(0.5) else omega, **clearance}
    if process in ("grazing-curves", "codimension-two-points"):
        if process == "codimension-two-points":
            omega = of_range(place.window, None)
        return {"omega": omega, **place.other(stops)}
    if process in ("bifurcation-diagrams", "basin-fractions"):
        vary = draw.choice(["omega", "clearance", "forcing"], [0.5, 0.3, 0.2])
        if vary == "omega":
            return {"omega": omega, "clearance": place.clearance(stops)}
        if vary == "forcing":
            fixed = {"omega": place.omega, "clearance": place.clearance(stops)}
            return {**fixed, "vary": vary, "range": {"start": 0.2, "stop": 2.0, "points": points}}
        return {"omega": place.omega, "clearance": place.clearance(stops, gaps(draw, place, points))}
    curves = process == "bifurcation-curves"
    if curves:
        omega = of_range(place.window, None)
    return {"omega": omega, "clearance": place.clearance(stops, gaps(draw, place, None if curves else points))}


def gaps(draw: Draw, place: Place, points: int | None) -> Body:
    """Return a range of the clearance about the one that was drawn."""
    if place.gap <= 0.0:
        raise Unsuitable
    low, high = place.gap * draw.between(0.2, 0.8), place.gap * draw.between(1.1, 2.5)
    return of_range((low + place.equilibrium, high + place.equilibrium), points)


def right_request(draw: Draw, name: str) -> Case:
    """Return a right request about a machine of this name."""
    while True:
        style = draw.choice(STYLES, STYLES.values())
        for _ in range(TRIES):
            process = draw.choice({**AT_POINT, **IN_WINDOW}, [*AT_POINT.values(), *IN_WINDOW.values()])
            try:
                case = drawn(draw, name, style, process)
                case.request()
            except (Unsuitable, ValidationError):
                continue
            return case


def drawn(draw: Draw, name: str, style: str, process: str) -> Case:
    """Return a request; raises Unsuitable."""
    pointed = process in AT_POINT
    if pointed and style == "wide sweep":
        raise Unsuitable
    machine = MACHINES[name](draw)
    if style == "without damping":
        if "matrices" in machine.oscillator:
            raise Unsuitable
        machine.oscillator["damping"] = [0.0] * len(machine.oscillator["masses"])
    if not float(np.max(machine.model().damping_ratios)) <= MOST_DAMPED:  # NaN where modes do not oscillate
        raise Unsuitable
    place, amplitude = driven(draw, machine, style, pointed)
    load(draw, machine, style, place)
    fields = (at_point if pointed else in_window)(draw, process, machine, place)
    if draw.chance(0.05):
        machine.oscillator.pop("restitution")
    resonance = float(machine.model().natural_frequencies[machine.resonance])
    facts = {"omega/resonance": place.omega / resonance, "gap/amplitude": place.gap / amplitude}
    return Case(name, style, process, rounded({"oscillator": machine.oscillator, **fields}), facts)
