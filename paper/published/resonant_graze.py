"""Ghosh and Simpson: saddle-nodes and period doublings that leave a resonant graze of one stop, and their tangency."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap import Client
from paper.page import Row, Section
from paper.published.one_mass import QUIET, Family, branch_over_clearance, one_mass

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SOURCE = "Ghosh and Simpson, arXiv:2510.16218"
DAMPING, RESTITUTION, MULTIPLE = 0.04, 0.9, 2
OSCILLATOR = one_mass(DAMPING, RESTITUTION)
RESONANCE = 0.8 * math.sqrt(1.0 - 0.25 * DAMPING**2)


class Printed(NamedTuple):
    """A row of pp2_omega0.8_*.csv: type, omega, force, impact velocity, and the multiplier that is not +-1."""

    kind: str
    omega: float
    force: float
    speed: float
    other: float


ROWS = (
    Printed("PD", 0.80079, 0.3601817821, 0.0060385, -0.432389),
    Printed("PD", 0.80499, 0.3540145838, 0.0329037, -0.433812),
    Printed("PD", 0.81, 0.3475333989, 0.0653040, -0.435491),
    Printed("PD", 0.82001, 0.3372162367, 0.1311963, -0.438800),
    Printed("PD", 0.84001, 0.3258663331, 0.2679908, -0.445257),
    Printed("PD", 0.87001, 0.3287889277, 0.4908951, -0.454537),
    Printed("PD", 0.90001, 0.3542326295, 0.7472408, -0.463376),
    Printed("PD", 0.93001, 0.4037395633, 1.0530083, -0.471799),
    Printed("PD", 0.96001, 0.4699410361, 1.3880923, -0.479829),
    Printed("PD", 0.98001, 0.4665055416, 1.4420962, -0.484985),
    Printed("PD", 0.99801, 0.1113789381, 0.3291997, -0.489493),
    Printed("SN", 0.799751, 0.3618133826, 0.0132077, 0.4320383),
    Printed("SN", 0.799, 0.3628362020, 0.1240866, 0.4317851),
    Printed("SN", 0.796998, 0.3642240031, 0.4112545, 0.4311005),
    Printed("SN", 0.792998, 0.3615686674, 0.9201764, 0.4297364),
    Printed("SN", 0.788138, 0.3506941723, 1.3730124, 0.4280592),
)
# Rows from which the coefficients of the tangency are extrapolated: the nearest that are not too near for ten digits.
NEAREST = {"SN": (0.799, 0.796998, 0.792998), "PD": (0.80079, 0.80499, 0.81)}


class Found(NamedTuple):
    """Force and impact velocity of a special point, and the multiplier that is not +-1."""

    force: float
    speed: float
    other: float


def curves(client: Client) -> Section:
    """Return the section on the two curves."""
    section = Section("Ghosh and Simpson: two curves from a resonant graze of one stop")
    section.say(
        "I. Ghosh and D. J. W. Simpson, *The VIVID function for numerically continuing periodic orbits arising from"
        " grazing bifurcations of hybrid dynamical systems*, arXiv:2510.16218, Figure 4: x'' + 0.04 x' + x = A"
        " cos(omega t), a stop at 1 with R = 0.9, one impact in two periods. Read: the abstract, the code and all data"
        " of the figure, in the authors' repository indrag49/VIVID on GitHub. The table has every kind of row of the"
        " data. The difference is that of the forces, relative to the printed one."
    )
    points = [special_point(client, row) for row in ROWS]
    differences = [point.force / row.force - 1.0 for row, point in zip(ROWS, points, strict=True)]
    section.show(
        [
            "type",
            "omega",
            "A printed",
            "A computed",
            "difference",
            "velocity printed",
            "computed",
            "multiplier printed",
            "computed",
        ],
        [
            [
                row.kind,
                f"{row.omega:g}",
                f"{row.force:.10f}",
                f"{point.force:.10f}",
                f"{difference:.0e}",
                f"{row.speed:.7f}",
                f"{point.speed:.7f}",
                f"{row.other:.6f}",
                f"{point.other:.6f}",
            ]
            for row, point, difference in zip(ROWS, points, differences, strict=True)
        ],
    )
    largest = {
        kind: max(abs(d) for row, d in zip(ROWS, differences, strict=True) if row.kind == kind) for kind in ("SN", "PD")
    }
    section.say(
        "Why they differ: the authors bisect until a multiplier is within 1e-5 of 1 or -1. At a saddle-node the force"
        " is stationary along the branch, so that its error is of second order; at a period doubling it is of first"
        " order, and grows where the multiplier depends little on the force."
    )
    for kind, name in (("SN", "saddle-nodes, 5 forces"), ("PD", "period doublings, 11 forces")):
        verdict = f"at most {largest[kind]:.0e} of A: multipliers were bisected to 1e-5"
        (row, point) = next((row, point) for row, point in zip(ROWS, points, strict=True) if row.kind == kind)
        section.rows.append(
            Row(SOURCE, f"{name}; at omega = {row.omega:g}", f"{row.force:.10f}", f"{point.force:.10f}", verdict)
        )
    ends = client.codimension_two_points(
        OSCILLATOR, omega=(0.78, 1.01), max_order=2, max_multiple=MULTIPLE, clearance={"left": None}, **QUIET
    )
    doublings = [
        (point.omega, 1.0 / point.clearance)
        for point in ends.points
        if point.bifurcation == "PD" and point.multiple == MULTIPLE
    ]
    section.say(
        "Both curves start on the grazing curve at omega = 4 xi/5, xi = sqrt(1 - 0.0004), and the period doublings end"
        " on it at omega = xi. The codimension-two points of period 2 over this interval are at (omega, A) ="
        f" {' and '.join(f'({w:.12f}, {force:.12f})' for w, force in doublings)}. The authors mark the end at (1,"
        " 0.0404136): the last row of their file but one, as the last one has a negative impact velocity and is no"
        " motion."
    )
    section.draw(
        "published_resonant.png",
        "Forces at saddle-nodes and period doublings, less that at the graze",
        lambda: _picture(points),
    )
    return section


def tangency(client: Client) -> Section:
    """Return the section on the quadratic coefficients."""
    section = Section("Simpson and Ghosh: the tangency at a resonant graze")
    section.say(
        "D. J. W. Simpson and I. Ghosh, *Resonant grazing bifurcations revisited*, arXiv:2602.22797, show for one"
        " degree of freedom and one stop that the curves of saddle-nodes and of period doublings are quadratically"
        " tangent to the grazing curve, and give their coefficients. Read: the abstract and the beginning of the"
        " introduction. The formulas and the parameters of its example could not be read here, so their printed values"
        " are not on this page. The same authors' data of the section above test the statement: A - A_graz, divided by"
        " the square of omega - 4 xi/5, has a limit. It is extrapolated here from three printed rows by a parabola."
    )
    points = client.codimension_two_points(
        OSCILLATOR, omega=(0.78, 0.85), max_order=2, max_multiple=MULTIPLE, clearance={"left": None}, **QUIET
    )
    rows = []
    for kind in ("SN", "PD"):
        (point,) = (candidate for candidate in points.points if candidate.bifurcation == kind)
        assert point.unfolding is not None
        unfolding = point.unfolding
        assert unfolding.quadratic is not None
        graze = 1.0 / point.clearance
        coefficient, speed = -unfolding.quadratic * graze**2, unfolding.velocity_slope * graze
        fitted = _extrapolated(kind)
        rows.append([kind, unfolding.contact, f"{fitted:.3f}", f"{coefficient:.10f}", f"{speed:.9f}"])
        section.rows.append(
            Row(
                "Simpson and Ghosh, arXiv:2602.22797",
                f"coefficient of the tangency, {kind}",
                f"{fitted:.3f} (from data of arXiv:2510.16218)",
                f"{coefficient:.10f}",
                f"{abs(fitted / coefficient - 1.0):.0e}: extrapolated from three rows",
            )
        )
    section.show(
        ["curve", "contact", "coefficient from their data", "coefficient computed", "velocity over distance in omega"],
        rows,
    )
    section.say(
        "The saddle-nodes are at frequencies below 4 xi/5 and forces below the graze, the period doublings above both,"
        " as in their figures. The tangency of both is special to one degree of freedom: with more, the period"
        " doublings leave at an angle ([theory.md](theory.md))."
    )
    return section


def special_point(client: Client, row: Printed) -> Found:
    """Return the special point that a row is of."""
    there = 1.0 / row.force
    clearance = there * (1.0 - 1e-3) if row.kind == "SN" else there
    family = Family.of(DAMPING, RESTITUTION, row.omega, MULTIPLE)
    speed = min(family.speeds(clearance), key=lambda value: abs(value - row.speed * clearance))
    start = (clearance, family.guess(clearance, speed, MULTIPLE))
    branch = branch_over_clearance(client, OSCILLATOR, row.omega, start, (0.99 * there, 1.01 * there))
    at = [k for k, point in enumerate(branch.special_points) if point.type == row.kind]
    best = min(at, key=lambda k: abs(branch.special_points[k].velocities[0] / there - row.speed))
    point = branch.special_points[best]
    force = 1.0 / float(point.clearance_right or math.nan)
    orbit = client.periodic_orbit(
        OSCILLATOR,
        omega=row.omega,
        clearance={"right": 1.0 / force, "left": None},
        motion={
            "period": MULTIPLE,
            "stops": [1],
            "phases": point.phases.tolist(),
            "velocities": point.velocities.tolist(),
        },
        **QUIET,
    )
    critical = 1.0 if row.kind == "SN" else -1.0
    other = max(orbit.multipliers, key=lambda multiplier: abs(multiplier - critical))
    return Found(force, float(point.velocities[0]) * force, float(other.real))


def graze_force(omega: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Return the force at which the steady motion has the amplitude 1."""
    return np.hypot(1.0 - np.square(omega), DAMPING * np.asarray(omega))


def _extrapolated(kind: str) -> float:
    """Return the coefficient to which printed rows tend at the resonance."""
    rows = [row for row in ROWS if row.kind == kind and row.omega in NEAREST[kind]]
    distance = np.array([row.omega - RESONANCE for row in rows])
    above = np.array([row.force for row in rows]) - graze_force(np.array([row.omega for row in rows]))
    return float(np.polyfit(distance, above / distance**2, len(rows) - 1)[-1])


def _picture(points: list[Found]) -> Axes:
    from grazemap.plots.axes import axes_or_new

    ax = axes_or_new(None, 9.0, 5.0)
    for kind, marker, name in (("SN", "^", "saddle-node"), ("PD", "s", "period doubling")):
        rows = [(row, point) for row, point in zip(ROWS, points, strict=True) if row.kind == kind]
        omega = np.array([row.omega for row, _ in rows])
        graze = graze_force(omega)
        ax.plot(
            omega, [row.force for row, _ in rows] - graze, marker, color="0.65", markersize=9, label=f"{name}, printed"
        )
        ax.plot(omega, [point.force for _, point in rows] - graze, "k.", markersize=4, label=f"{name}, computed")
    ax.axhline(0.0, color="black", linewidth=0.8)
    ax.axvline(RESONANCE, color="0.6", linewidth=0.8, linestyle="--")
    ax.axvline(RESONANCE / 0.8, color="0.6", linewidth=0.8, linestyle="--")
    ax.set(xlabel=r"$\omega$", ylabel="force less that at the graze")
    ax.set_yscale("symlog", linthresh=1e-5)
    ax.set_ylim(-0.1, 2.0)
    ax.legend(fontsize=8)
    return ax
