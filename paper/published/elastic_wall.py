"""Manik: fixed points at the graze of an elastic wall, and their multipliers."""

from __future__ import annotations

import math
from typing import NamedTuple

from grazemap import Client
from paper.page import Row, Section
from paper.published.one_mass import QUIET, Family, one_mass, right

SOURCE = "Manik 2013"
DAMPING = 0.08


class Printed(NamedTuple):
    """A row of the file n.dat: n, the deviation from the steady motion at the impact, the moduli of two eigenvalues."""

    n: float
    displacement: float
    velocity: float
    moduli: tuple[float, float]


ROWS = (
    Printed(1.23, 1.85824592, 2.56601639, (0.19759, 3.06156)),
    Printed(1.495, 1.89961958, 1.05086146, (0.13430, 4.50416)),
    Printed(1.76, 1.76316868, 0.04008075, (0.33395, 1.81142)),
    Printed(2.025, 0.17418626, 0.48564617, (0.69237, 0.87370)),
    Printed(2.29, 1.80568888, -0.50360065, (0.34356, 1.76073)),
    Printed(3.35, 1.57758065, 3.58990755, (0.52773, 1.14628)),
    Printed(3.88, 0.68961118, -0.58001792, (0.73663, 0.82120)),
    Printed(5.735, 0.97563444, 0.35720780, (0.77464, 0.78091)),
)
# "grazing condition (Which is F=0.3903, to be exact)" for n = 2.235; the code has these two dampings.
FORCE, FORCE_N, DAMPINGS = 0.3903, 2.235, (0.062, 0.08)


def elastic_wall(client: Client) -> Section:
    """Return the section."""
    section = Section("Manik: fixed points at the graze of an elastic wall")
    section.say(
        "D. Manik, *Investigating piecewise smooth hybrid systems*, MS thesis (IISER Kolkata, 2013). Read: its LaTeX"
        " source, its code and its data (debsankha/piecewise-smooth on GitHub). x'' + 0.08 x' + k x = F cos(t), a wall"
        " at 1 with R = 1, at the force at which the steady motion grazes. n is 2 omega_g/omega with the damped"
        " natural frequency omega_g, so that k = n^2/4 + 0.0016. At each n there is a solution with one impact in a"
        " period besides the graze; the file n.dat has 5000 of them, as deviations from the steady motion at the"
        " impact, with the moduli of two eigenvalues."
    )
    rows = [_row(client, printed) for printed in ROWS]
    section.show(
        ["n", "deviation printed", "computed", "moduli printed", "moduli computed", "impact speed", "here"], rows
    )
    section.say(
        "The deviations agree to the printed digits. The eigenvalues do not: the thesis takes those of the map that"
        " advances by exactly one period with an impact at its beginning, which is no return map, as a disturbed"
        " motion does not hit the wall again after exactly one period. The determinant of its map is -exp(-0.08 T);"
        f" that of a return map is R^2 exp(-0.08 T) = {math.exp(-2.0 * math.pi * DAMPING):.5f}, the square of the"
        " moduli here. A negative impact speed, or a passage beyond the wall, makes a solution no motion; a comment in"
        " the code asks for such a check."
    )
    agree = [row for row in rows if row[1] == row[2]]
    section.rows.append(
        Row(SOURCE, f"deviations at the impact, {len(rows)} values of n", rows[0][1], rows[0][2], f"{len(agree)} agree")
    )
    section.rows.append(
        Row(SOURCE, f"moduli of the multipliers, n = {rows[0][0]}", rows[0][3], rows[0][4], "not those of a return map")
    )
    forces = [1.0 / float(_structure(client, damping, FORCE_N)[0]) for damping in DAMPINGS]
    swapped = 1.0 / float(_structure(client, DAMPINGS[1], 2.35)[0])
    section.say(
        f"The text says that at n = {FORCE_N:g} the graze is at F = {FORCE:g}. It is at {forces[0]:.7f} or"
        f" {forces[1]:.7f}, with the damping 0.062 or 0.08; with n = 2.35 it is at {swapped:.7f}, so digits of n may"
        " have been exchanged."
    )
    section.rows.append(
        Row(SOURCE, f"force at the graze, n = {FORCE_N:g}", f"{FORCE:g}", f"{forces[1]:.7f}", "n = 2.35 would fit")
    )
    return section


def _structure(client: Client, damping: float, n: float) -> tuple[float, float]:
    """Return amplitude and phase of the steady motion under a unit force at omega = 1."""
    structure = client.structure(one_mass(damping, 1.0, _stiffness(n, damping)), omega=[1.0], **QUIET)
    assert structure.amplitude is not None
    assert structure.phase is not None
    return float(structure.amplitude[0]), float(structure.phase[0])


def _stiffness(n: float, damping: float) -> float:
    return 0.25 * n**2 + 0.25 * damping**2


def _row(client: Client, printed: Printed) -> list[str]:
    stiffness = _stiffness(printed.n, DAMPING)
    amplitude, phase = _structure(client, DAMPING, printed.n)
    family = Family.of(DAMPING, 1.0, 1.0, 1, stiffness)
    speed = max(family.speeds(amplitude), key=abs)
    oscillator = one_mass(DAMPING, 1.0, stiffness)
    orbit = client.periodic_orbit(
        oscillator, omega=1.0, clearance=right(amplitude), motion=family.guess(amplitude, speed), **QUIET
    )
    if not orbit.converged:
        return [
            f"{printed.n:g}",
            _pair(printed.displacement, printed.velocity),
            "-",
            _moduli(printed.moduli),
            "-",
            "-",
            str(orbit.reason),
        ]
    at = float(orbit.phases[0])
    # in units in which the wall is at 1
    displacement = (amplitude - amplitude * math.sin(at + phase)) / amplitude
    velocity = (float(orbit.velocities[0]) - amplitude * math.cos(at + phase)) / amplitude
    moduli = sorted(map(abs, orbit.multipliers.tolist()))
    here = (
        orbit.said
        if orbit.admissible or orbit.velocities[0] < 0.0
        else f"no motion: passes the wall by {orbit.excess / amplitude:.3f}"
    )
    return [
        f"{printed.n:g}",
        _pair(printed.displacement, printed.velocity),
        _pair(displacement, velocity),
        _moduli(printed.moduli),
        _moduli((moduli[0], moduli[1])),
        f"{float(orbit.velocities[0]) / amplitude:.6f}",
        here,
    ]


def _pair(displacement: float, velocity: float) -> str:
    return f"{displacement:.8f}, {velocity:.8f}"


def _moduli(moduli: tuple[float, float]) -> str:
    return f"{moduli[0]:.5f}, {moduli[1]:.5f}"
