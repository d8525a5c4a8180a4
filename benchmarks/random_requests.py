"""Random valid requests of every process, from a seeded generator, each as a function of its size.

Chains have 1 to 64 masses (those of maps MAP_MASSES), light to heavy
damping, any restitution, including 1; clearances are tiny to wide, and frequencies lie beside natural frequencies too.
Some codimension-two points are at frequencies far below, where zeros are dense, and some branches are long.
Some are given as dense matrices, or have their contact between two masses, two restitutions, a bias or an unbalance;
some have one stop, or unequal ones; some maps and diagrams are of other parameters, and some quantities are observed.
The size multiplies what the time should be proportional to: points, periods or states.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from grazemap.wire import Oscillator
from grazemap.wire.linear import matrices, steady_amplitude

Body = dict[str, Any]
Sized = Callable[[float], Body]
MAP_MASSES = (1, 2, 3, 8)
MASSES = (1, 2, 3, 3, 5, 8, 16, 32, 64)


class Draw:
    """A random chain with a frequency and a clearance, and further random choices."""

    def __init__(self, random: np.random.Generator, masses: tuple[int, ...] = MASSES) -> None:
        self.random = random
        count = int(random.choice(masses))
        per_link = bool(random.random() < 0.3)
        damping = 10 ** random.uniform(-3.0, -0.3, count)
        forcing = random.normal(size=count) if random.random() < 0.5 else np.eye(count)[0]
        restitution = (1.0, 0.99, 0.8, float(random.uniform(0.5, 1.0)), float(random.uniform(0.0, 0.5)))
        self.chain: Body = {
            "masses": self.log(0.3, 10.0, count),
            "stiffnesses": self.log(0.3, 10.0, count),
            "damping": damping.tolist() if per_link else float(damping[0]),
            "forcing": forcing.tolist(),
            "restitution": restitution[int(random.choice(5))],
        }
        frequencies = Oscillator(**self.chain).natural_frequencies
        if random.random() < 0.4:
            self.omega = float(random.choice(frequencies)) * (1.0 + float(random.normal()) * 1e-2)
        else:
            self.omega = self.between(0.3, 2.0) * float(frequencies[0])
        self.oscillator = self._general() if self.chance(0.4) else self.chain
        tightest = -4.0 if self.chance(0.2) else -2.5
        self.clearance = 10 ** self.between(tightest, 0.2) * self.amplitude()
        self.left: float | None = self.clearance
        if self.chance(0.4):  # one stop, or unequal ones
            self.left = None if self.chance(0.5) else self.clearance * self.between(0.5, 2.0)

    def _general(self) -> Body:
        """Return the chain, or its matrices, with one thing that a chain between equal stops does not have."""
        masses, chain = len(self.chain["masses"]), Oscillator(**self.chain)
        mass, damping, stiffness = (matrix.tolist() for matrix in matrices(chain))
        forced = {name: self.chain[name] for name in ("forcing", "restitution")}
        dense: Body = {"matrices": {"mass": mass, "damping": damping, "stiffness": stiffness}, **forced}
        first = self.integer(1, max(1, masses - 1))
        choices: list[Body] = [
            {**dense, "contact": self.integer(1, masses)},
            {**self.chain, "contact": [first, first + 1] if masses > 1 else 1},
            {**self.chain, "restitution": {"right": self.between(0.3, 1.0), "left": self.between(0.3, 1.0)}},
            {**self.chain, "bias": [0.3 * float(self.random.normal()), *[0.0] * (masses - 1)]},
            {**self.chain, "forcing": {"amplitude": self.chain["forcing"], "law": "unbalance"}},
        ]
        return choices[int(self.random.choice(len(choices)))]

    @property
    def stops(self) -> Any:
        """The clearances of both stops, as requests take them where they are fixed."""
        if self.left == self.clearance:
            return self.clearance
        return {"right": self.clearance, "left": self.left}

    def stops_over(self, values: Body) -> Any:
        """Return the clearances where that of the right stop, or that of both, varies."""
        return values if self.left == self.clearance else {"right": values, "left": self.left}

    def line(self) -> Body:
        """Return what requests along one parameter have, without the number of points in `range`."""
        omega, clearance = self.window()
        clearance_name = "clearance" if self.left == self.clearance else "clearance_right"
        vary = str(self.random.choice(["omega", clearance_name, "restitution", "forcing"]))
        body: Body = {"oscillator": self.oscillator, "vary": vary, "omega": self.omega, "clearance": self.stops}
        body["range"] = {"restitution": {"start": 0.3, "stop": 0.9}, "forcing": {"start": 0.8, "stop": 1.2}}.get(vary)
        if vary == "omega":
            del body["omega"]
            body["range"] = omega
        elif vary == clearance_name:
            body["clearance"] = {"left": self.left} if clearance_name != "clearance" and self.left is not None else None
            body["range"] = clearance
        return {name: value for name, value in body.items() if value is not None}

    def observed(self) -> Body:
        """Return the fields of what is observed, if anything is."""
        if not self.chance(0.3):
            return {}
        row = [1.0] + [0.0] * (len(self.chain["masses"]) - 1)
        return {"observables": ["dissipated_power", "rms_displacement"], "outputs": {"speed": {"velocity": row}}}

    def between(self, low: float, high: float) -> float:
        """Return a random number."""
        return float(self.random.uniform(low, high))

    def integer(self, low: float, high: float) -> int:
        """Return a random integer, its logarithm uniform."""
        return round(float(np.exp(self.random.uniform(np.log(low), np.log(high)))))

    def log(self, low: float, high: float, count: int) -> list[float]:
        """Return random numbers, their logarithms uniform."""
        values: list[float] = np.exp(self.random.uniform(np.log(low), np.log(high), count)).tolist()
        return values

    def chance(self, probability: float) -> bool:
        """Return whether something is to be so."""
        return bool(self.random.random() < probability)

    def amplitude(self) -> float:
        """Return the amplitude of the steady motion of the contact."""
        return float(steady_amplitude(Oscillator(**self.oscillator), np.array([self.omega]))[0])

    def of_several_harmonics(self) -> Body:
        """Return the chain with its forces in a higher harmonic too."""
        first = {"amplitude": self.chain["forcing"]}
        higher = {"phase": [self.between(0.0, 6.0)] * len(self.chain["masses"]), "harmonic": self.integer(2, 30)}
        return {**self.chain, "forcing": [first, first | higher]}

    def point(self) -> Body:
        """Return the oscillator at its frequency, between its stops."""
        return {"oscillator": self.oscillator, "omega": self.omega, "clearance": self.stops}

    def window(self) -> tuple[Body, Body]:
        """Return intervals of omega and clearance."""
        wide = self.between(0.01, 0.2)
        omega = {"start": self.omega, "stop": self.omega * (1.0 + wide)}
        return omega, {"start": self.clearance, "stop": self.clearance * self.between(1.1, 3.0)}


def structures(draw: Draw) -> Sized:
    """Return the linear properties of a chain, or of its matrices, at more and more frequencies and times."""
    oscillator: Body = {**draw.chain, "base": {"amplitude": 1.0, "stops_move": draw.chance(0.5)}}
    if draw.chance(0.5):
        chain = Oscillator(**draw.chain)
        mass, damping, stiffness = (matrix.tolist() for matrix in matrices(chain))
        described = {"mass": mass, "damping": damping, "stiffness": stiffness}
        oscillator = {"matrices": described, "forcing": draw.chain["forcing"], "contact": chain.size}
    window, times = draw.window()[0], draw.chance(0.5)
    return lambda size: {
        "oscillator": oscillator,
        "omega": {**window, "points": many(10 * size, 50_000, 2)},
        "times": np.linspace(0.0, 100.0, many(10 * size, 10_000)).tolist() if times else [],
    }


def grazing_curves(draw: Draw) -> Sized:
    """Return curves of more and more points."""
    body = {"oscillator": draw.oscillator, "max_order": draw.integer(1, 200), "sequence": draw.chance(0.3)}
    if not body["sequence"] and draw.chance(0.3):
        body["oscillator"] = draw.of_several_harmonics()
    return lambda size: {**body, "omega": {**draw.window()[0], "points": many(100 * size, 1_000_000)}}


def codimension_two_points(draw: Draw) -> Sized:
    """Return points over longer and longer intervals, of higher and higher order."""
    order, multiple, omega = draw.integer(2, 30), draw.integer(1, 10), draw.omega
    if draw.chance(0.4):
        omega *= 10 ** draw.between(-2.5, -0.5)
    oscillator = draw.of_several_harmonics() if draw.chance(0.3) else draw.oscillator

    def body(size: float) -> Body:
        orders = {"max_order": many(order * size**0.5, 200), "max_multiple": many(multiple * size**0.5, 100)}
        return {"oscillator": oscillator, "omega": {"start": omega, "stop": omega * 1.5}, **orders}

    return body


def discontinuity_mappings(draw: Draw) -> Sized:
    """Return mappings of more and more overshoots."""
    scale, returns = draw.amplitude(), draw.integer(1, 100)
    order = str(draw.random.choice(["leading", "exact"]))

    def body(size: float) -> Body:
        overshoot = (scale * np.geomspace(1e-7, 1e-3, many(3 * size, 1000))).tolist()
        named = {"order": order, "returns": returns}
        return {"oscillator": draw.chain, "omega": draw.omega, "overshoot": overshoot, **named}

    return body


def trajectories(draw: Draw) -> Sized:
    """Return longer and longer trajectories, some with a transient, from several states, or with many samples."""
    body = {**draw.point(), "samples_per_period": draw.integer(1, 1000), **draw.observed()}
    states, transient = draw.integer(1, 20) if draw.chance(0.3) else 0, draw.integer(1, 10) * draw.chance(0.5)
    if states:
        body["initial"] = [{"phase": 0.1 * k} for k in range(states)]
    return lambda size: {
        **body,
        "periods": many(4 * size, 1_000_000 // body["samples_per_period"] // max(1, states)),
        "transient_periods": many(4 * transient * size, 10**5),
    }


def bifurcation_diagrams(draw: Draw) -> Sized:
    """Return diagrams of more and more points."""
    body = {
        **draw.line(),
        **draw.observed(),
        "policy": str(draw.random.choice(["rest", "sweep-up", "sweep-down"])),
        "periods": draw.integer(10, 100),
        "transient_periods": draw.integer(50, 500),
    }
    return lambda size: {**body, "range": {**body["range"], "points": many(2 * size, 10_000, 2)}}


def unfolding_maps(draw: Draw) -> Sized:
    """Return maps of more and more columns: every policy, adaptive ones, previews."""
    omega, clearance = draw.window()
    rows, policy = draw.integer(4, 512), str(draw.random.choice(["rest", "rest", "sweep-up", "ensemble"]))
    body: Body = {"oscillator": draw.oscillator, "policy": policy, "preview": draw.chance(0.25), **draw.observed()}
    body["max_periods"] = draw.integer(50, 1000)
    if policy == "ensemble":
        body["initial_conditions"], rows = draw.integer(2, 16), max(4, rows // 8)
    if draw.chance(0.25) and policy != "sweep-up" and "observables" not in body:
        body["adaptive"] = True
    if draw.chance(0.3) and not body.get("adaptive"):
        line = draw.line()
        name, values = ("damping", {"start": 0.5, "stop": 2.0}) if draw.chance(0.3) else (line["vary"], line["range"])
        if name != "omega":
            fixed = {"clearance": line["clearance"]} if "clearance" in line else {}
            fixed = {"clearance": draw.stops} if name == "damping" else fixed
            up = {"vary": name, "values": {**values, "points": max(2, rows // 8)}}
            return lambda size: {
                **body,
                **fixed,
                "horizontal": {"vary": "omega", "values": {**omega, "points": many(2 * size, 4096, 2)}},
                "vertical": up,
            }
    heights = draw.stops_over({**clearance, "points": rows})
    return lambda size: {**body, "omega": {**omega, "points": many(2 * size, 4096, 2)}, "clearance": heights}


def unfolding_diagrams(draw: Draw) -> Sized:
    """Return diagrams of larger and larger maps, some of them with borders."""
    omega, clearance = draw.window()
    body = {"oscillator": draw.oscillator, "max_periods": draw.integer(50, 400), "borders": draw.chance(0.4)}

    def sized(size: float) -> Body:
        side = {"points": many(4 * size**0.5, 256, 2)}
        return {**body, "omega": {**omega, **side}, "clearance": draw.stops_over({**clearance, **side})}

    return sized


def basins(draw: Draw) -> Sized:
    """Return basins of more and more states."""
    body = {**draw.point(), "max_periods": draw.integer(50, 1000)}
    across = draw.clearance

    def sized(size: float) -> Body:
        points = many(4 * size**0.5, 1024, 2)
        values = {"start": -0.9 * across, "stop": 0.9 * across, "points": points}
        speeds = {"start": -draw.omega * across, "stop": draw.omega * across, "points": points}
        return {
            **body,
            "horizontal": {"quantity": "displacement", "values": values},
            "vertical": {"quantity": "velocity", "values": speeds},
        }

    return sized


def basin_fractions(draw: Draw) -> Sized:
    """Return shares at more and more values of a parameter."""
    body = {**draw.line(), "states": draw.integer(10, 500), "max_periods": draw.integer(50, 1000)}
    return lambda size: {**body, "range": {**body["range"], "points": many(2 * size, 2000, 2)}}


def periodic_orbits(draw: Draw) -> Sized:
    """Return the orbit that a longer and longer trajectory settles to."""
    body = {**draw.point(), "max_period": draw.integer(4, 64), **draw.observed()}
    return lambda size: {**body, "transient_periods": many(100 * size, 900_000)}


def orbit_branches(draw: Draw) -> Sized:
    """Return branches over more and more of a parameter."""
    vary = "omega" if draw.chance(0.5) else "clearance" if draw.left == draw.clearance else "clearance_right"
    body = {
        **draw.point(),
        **draw.observed(),
        "vary": vary,
        "max_period": draw.integer(2, 8),
        "transient_periods": 2000,
    }
    value, widest = draw.omega if vary == "omega" else draw.clearance, 1000.0 if draw.chance(0.3) else 2.0

    def sized(size: float) -> Body:
        factor = 1.0 + min(0.02 * size, widest)
        interval = {"start": value / factor, "stop": value * factor}
        return {**body, "range": interval, "max_points": many(10 * size, 20_000)}

    return sized


def bifurcation_curves(draw: Draw) -> Sized:
    """Return curves in closed form at more and more frequencies, or the curves of a motion with one impact or two."""
    omega, clearance = draw.window()
    body: Body = {"oscillator": draw.oscillator, "omega": omega, "clearance": draw.stops_over(clearance)}
    if draw.chance(0.4):
        stops = [[1], [1, -1]][draw.integer(1, 2) - 1]
        return lambda size: {**body, "motions": [{"period": 1, "stops": stops}]}
    multiple = draw.integer(1, 20)
    return lambda size: {**body, "max_multiple": multiple, "points": many(10 * size, 100_000, 2)}


def proofs(draw: Draw) -> Sized:
    """Return one of the statements about the default oscillator."""
    orbit = {"omega": 0.29, "clearance": draw.between(1.5, 1.7)}
    motion = {"period": 1, "stops": [1, 1, -1, -1]}
    statements: list[Body] = [
        {"kind": "orbit", **orbit, "motion": motion},
        {"kind": "attraction", **orbit},
        {"kind": "codimension-two", "type": "g", "order": 2, "range": {"start": 0.282, "stop": 0.283}},
        {
            "kind": "bifurcation",
            "omega": 0.27,
            "clearance": 1.85,
            "motion": {"period": 1, "stops": [1]},
            "type": "SN",
            "vary": "clearance",
            "range": {"start": 1.8, "stop": 1.95},
        },
    ]
    statement = statements[int(draw.random.choice(4))]
    return lambda size: {"statement": statement, "digits": many(20 * size**0.25, 200, 10)}


def many(number: float, most: int, least: int = 1) -> int:
    """Return an integer within its bounds."""
    return max(least, min(most, round(number)))


KINDS: dict[str, tuple[Callable[[Draw], Sized], tuple[int, ...]]] = {
    "structures": (structures, MASSES),
    "grazing-curves": (grazing_curves, MASSES),
    "codimension-two-points": (codimension_two_points, MASSES),
    "discontinuity-mappings": (discontinuity_mappings, MASSES),
    "trajectories": (trajectories, MASSES),
    "bifurcation-diagrams": (bifurcation_diagrams, MASSES),
    "unfolding-maps": (unfolding_maps, MAP_MASSES),
    "unfolding-diagrams": (unfolding_diagrams, MAP_MASSES),
    "basins": (basins, MAP_MASSES),
    "basin-fractions": (basin_fractions, MAP_MASSES),
    "periodic-orbits": (periodic_orbits, MASSES),
    "orbit-branches": (orbit_branches, MASSES),
    "bifurcation-curves": (bifurcation_curves, MASSES),
    "proofs": (proofs, MASSES),
}


def drawn(process: str, seed: int) -> Sized:
    """Return a random request of a process, as a function of its size."""
    kind, masses = KINDS[process]
    return kind(Draw(np.random.default_rng([seed, sorted(KINDS).index(process)]), masses))
