"""Random valid requests of every process, from a seeded generator, each as a function of its size.

Chains have 1 to 64 masses (those of maps MAP_MASSES, whose kernels are compiled for each number), light to heavy
damping, any restitution, including 1; clearances are tight to wide, and frequencies lie beside natural frequencies too.
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
        self.clearance = 10 ** self.between(-2.5, 0.2) * self.amplitude()

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
        """Return the amplitude of the steady motion of mass 1."""
        return float(steady_amplitude(Oscillator(**self.chain), np.array([self.omega]))[0])

    def point(self) -> Body:
        """Return the chain at its frequency and clearance."""
        return {"oscillator": self.chain, "omega": self.omega, "clearance": self.clearance}

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
    body = {"oscillator": draw.chain, "max_order": draw.integer(1, 200), "sequence": draw.chance(0.3)}
    return lambda size: {**body, "omega": {**draw.window()[0], "points": many(100 * size, 1_000_000)}}


def codimension_two_points(draw: Draw) -> Sized:
    """Return points over longer and longer intervals, of higher and higher order."""
    order, multiple, omega = draw.integer(2, 30), draw.integer(1, 10), draw.omega

    def body(size: float) -> Body:
        orders = {"max_order": many(order * size**0.5, 200), "max_multiple": many(multiple * size**0.5, 100)}
        return {"oscillator": draw.chain, "omega": {"start": omega, "stop": omega * 1.5}, **orders}

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
    body = {**draw.point(), "samples_per_period": draw.integer(1, 1000)}
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
    vary = str(draw.random.choice(["omega", "clearance"]))
    omega, clearance = draw.window()
    fixed = {"clearance": draw.clearance} if vary == "omega" else {"omega": draw.omega}
    body = {
        "oscillator": draw.chain,
        "vary": vary,
        **fixed,
        "policy": str(draw.random.choice(["rest", "sweep-up", "sweep-down"])),
        "periods": draw.integer(10, 100),
        "transient_periods": draw.integer(50, 500),
    }
    interval = omega if vary == "omega" else clearance
    return lambda size: {**body, "range": {**interval, "points": many(2 * size, 10_000, 2)}}


def unfolding_maps(draw: Draw) -> Sized:
    """Return maps of more and more columns: every policy, adaptive ones, previews."""
    omega, clearance = draw.window()
    rows, policy = draw.integer(4, 512), str(draw.random.choice(["rest", "rest", "sweep-up", "ensemble"]))
    body: Body = {"oscillator": draw.chain, "policy": policy, "preview": draw.chance(0.25)}
    body["max_periods"] = draw.integer(50, 1000)
    if policy == "ensemble":
        body["initial_conditions"], rows = draw.integer(2, 16), max(4, rows // 8)
    if draw.chance(0.25) and policy != "sweep-up":
        body["adaptive"] = True
    heights = {**clearance, "points": rows}
    return lambda size: {**body, "omega": {**omega, "points": many(2 * size, 4096, 2)}, "clearance": heights}


def unfolding_diagrams(draw: Draw) -> Sized:
    """Return diagrams of larger and larger maps, some of them with borders."""
    omega, clearance = draw.window()
    body = {"oscillator": draw.chain, "max_periods": draw.integer(50, 400), "borders": draw.chance(0.4)}

    def sized(size: float) -> Body:
        side = {"points": many(4 * size**0.5, 256, 2)}
        return {**body, "omega": {**omega, **side}, "clearance": {**clearance, **side}}

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


def periodic_orbits(draw: Draw) -> Sized:
    """Return the orbit that a longer and longer trajectory settles to."""
    body = {**draw.point(), "max_period": draw.integer(4, 64)}
    return lambda size: {**body, "transient_periods": many(100 * size, 900_000)}


def orbit_branches(draw: Draw) -> Sized:
    """Return branches over more and more of a parameter."""
    vary = str(draw.random.choice(["omega", "clearance"]))
    body = {**draw.point(), "vary": vary, "max_period": draw.integer(2, 8), "transient_periods": 2000}
    value = draw.omega if vary == "omega" else draw.clearance

    def sized(size: float) -> Body:
        factor = 1.0 + min(0.02 * size, 2.0)
        interval = {"start": value / factor, "stop": value * factor}
        return {**body, "range": interval, "max_points": many(10 * size, 20_000)}

    return sized


def bifurcation_curves(draw: Draw) -> Sized:
    """Return curves in closed form at more and more frequencies, or the curves of a motion with one impact or two."""
    omega, clearance = draw.window()
    body: Body = {"oscillator": draw.chain, "omega": omega, "clearance": clearance}
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
    said = statements[int(draw.random.choice(4))]
    return lambda size: {"statement": said, "digits": many(20 * size**0.25, 200, 10)}


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
    "periodic-orbits": (periodic_orbits, MASSES),
    "orbit-branches": (orbit_branches, MASSES),
    "bifurcation-curves": (bifurcation_curves, MASSES),
    "proofs": (proofs, MASSES),
}


def drawn(process: str, seed: int) -> Sized:
    """Return a random request of a process, as a function of its size."""
    kind, masses = KINDS[process]
    return kind(Draw(np.random.default_rng([seed, sorted(KINDS).index(process)]), masses))
