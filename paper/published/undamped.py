"""Budd, Cliffe and Dux: orbits of the undamped oscillator, as F. Dux has coded their formulas."""

from __future__ import annotations

import math

from grazemap import Client
from paper.page import Row, Section
from paper.published.one_mass import Family, branch_over_clearance, one_mass, orbit_near, points_of

SOURCE = "Budd, Cliffe and Dux, in Dux's code"
CASES = ((3.7, 0.8, 2), (2.8, 0.8, 1), (2.4, 0.6, 1))
"""omega, restitution, forcing periods of the orbit."""
DAMPINGS = (1e-3, 1e-4)
# Clearances of the tests of the code, at omega 3.7, R 0.8, n 2, and what these say about the number of motions.
STATEMENTS = ((0.2, "two"), (0.0, "one"), (-0.06, "none"), (0.4, "none"))
WEAK = 1e-6


def fold(omega: float, restitution: float, multiple: int) -> float:
    """Return the clearance at the saddle-node, as coded: |gamma| sqrt(1 + (c/r)^2)."""
    gamma, c, r = _coefficients(omega, restitution, multiple)
    return abs(gamma) * math.hypot(1.0, c / r)


def doubling(omega: float, restitution: float, multiple: int) -> float:
    """Return the impact velocity at the period doubling, as coded."""
    gamma, c, r = _coefficients(omega, restitution, multiple)
    turn = 2.0 * math.pi * multiple / omega
    cosine, sine, e = math.cos(turn), abs(math.sin(turn)), 1.0 + restitution
    b = 4.0 * restitution * cosine - 2.0 * (1.0 + restitution**2) + (omega**2 - 1.0) * c**2 * (1.0 - cosine)
    inner = b**2 + (e * omega * sine) ** 2 * (omega**2 * (c**2 + r**2) - 2.0 * b / (1.0 - cosine))
    return 2.0 * e * sine * omega**2 * abs(gamma) / math.sqrt(inner)


def _coefficients(omega: float, restitution: float, multiple: int) -> tuple[float, float, float]:
    turn = 2.0 * math.pi * multiple / omega
    c = math.sin(turn) * (1.0 + restitution) / (1.0 - math.cos(turn))
    return 1.0 / (1.0 - omega**2), c, (1.0 - restitution) / omega


def undamped(client: Client) -> Section:
    """Return the section."""
    section = Section("Budd, Cliffe and Dux: the undamped oscillator")
    section.say(
        "C. Budd, F. Dux and A. Cliffe, *The effect of frequency and clearance variations on single-degree-of-freedom"
        " impact oscillators*, Journal of Sound and Vibration 184 (1995) 475-502, and F. Dux, *The dynamics of impact"
        " oscillators* (PhD thesis, Bristol, 1992). Read: not these, but Dux's own code of them,"
        " FelixDux/impact-oscillator on GitHub, with its tests. x'' + x = cos(omega t), a stop at sigma, one impact in"
        " n periods. Over sigma the impact velocities are an ellipse; its saddle-node and its period doubling are"
        " given in closed form."
    )
    section.say(
        "grazemap refuses a mode without damping that contact sees. So a damping c is given, and the difference goes"
        f" to zero with it. The last column is extrapolated linearly from c = {DAMPINGS[0]:g} and {DAMPINGS[1]:g}."
    )
    rows = []
    for omega, restitution, multiple in CASES:
        computed = [_special(client, omega, restitution, multiple, damping) for damping in DAMPINGS]
        printed = (fold(omega, restitution, multiple), doubling(omega, restitution, multiple))
        for k, what in enumerate(("saddle-node, sigma", "period doubling, velocity")):
            coarse, fine = computed[0][k], computed[1][k]
            limit = (10.0 * fine - coarse) / 9.0
            rows.append(
                [
                    f"omega = {omega:g}, R = {restitution:g}, n = {multiple}: {what}",
                    f"{printed[k]:.10f}",
                    f"{coarse:.8f}",
                    f"{fine:.8f}",
                    f"{limit:.8f}",
                ]
            )
            section.rows.append(
                Row(
                    SOURCE,
                    f"{what}; omega = {omega:g}, n = {multiple}",
                    f"{printed[k]:.10f}",
                    f"{limit:.8f}",
                    f"{abs(limit / printed[k] - 1.0):.0e}: no damping there, a limit here",
                )
            )
    section.show(["what", "printed", *(f"c = {damping:g}" for damping in DAMPINGS), "limit"], rows)
    section.say(
        f"The tests of the code say how many motions there are at omega = 3.7, R = 0.8, n = 2. Here with c = {WEAK:g}:"
        " all solutions with an impact velocity toward the stop, and whether they stay inside of it."
    )
    section.show(
        ["sigma", "motions by the tests", "velocities", "motions here"],
        [_statement(client, *statement) for statement in STATEMENTS],
    )
    return section


def _special(client: Client, omega: float, restitution: float, multiple: int, damping: float) -> tuple[float, float]:
    """Return the clearance at the saddle-node with positive speed, and the speed at the period doubling."""
    family, reach = Family.of(damping, restitution, omega, multiple), 1.1 * fold(omega, restitution, multiple)
    start = (0.0, family.guess(0.0, family.speeds(0.0)[-1], multiple))
    branch = branch_over_clearance(client, one_mass(damping, restitution), omega, start, (-reach, reach))
    (node,) = (abs(clearance) for clearance, speed in points_of(branch, "SN") if speed > 0.0)
    printed = doubling(omega, restitution, multiple)
    return node, min((speed for _, speed in points_of(branch, "PD")), key=lambda speed: abs(speed - printed))


def _statement(client: Client, clearance: float, expected: str) -> list[str]:
    omega, restitution, multiple = CASES[0]
    family, oscillator = Family.of(WEAK, restitution, omega, multiple), one_mass(WEAK, restitution)
    guesses = [family.guess(clearance, speed, multiple) for speed in family.speeds(clearance) if speed > 0.0]
    orbits = [orbit_near(client, oscillator, omega, clearance, guess) for guess in guesses]
    speeds = ", ".join(f"{float(orbit.velocities[0]):.9f}" for orbit in orbits) or "-"
    beyond = [f"{orbit.excess:.4f}" for orbit in orbits if not orbit.admissible]
    inside = len(orbits) - len(beyond)
    if not orbits:
        text = f"none: beyond the saddle-node at {fold(omega, restitution, multiple):.6f}"
    else:
        text = {0: "none", 1: "one", 2: "two"}[inside] + (
            f": it passes the stop by {', '.join(beyond)}" if beyond else ""
        )
    return [f"{clearance:g}", expected, speeds, text]
