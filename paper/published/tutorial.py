"""COCO: an impact oscillator (Recipes for Continuation, example 15.2), a branch over the force through a graze."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from grazemap import Client, OrbitBranch
from paper.page import Row, Section
from paper.published.one_mass import QUIET, Family, one_mass, orbit_near, right

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SOURCE = "COCO, example 15.2"
OSCILLATOR = one_mass(0.1, 0.8)
# The initial solution guess of the demo, in po/examples/impact/demo.m of COCO: the state after the impact, that at the
# phase -pi, and the durations of the two segments.
SPEED_AFTER, PHASE, AT_MINUS_PI, DURATIONS = -1.36, 0.076, (-0.98, -0.29), (3.2, 3.1)
# Frequencies at which the grazing curve is given; figure 15.6 shows it for forces up to 1 and frequencies up to 1.5.
GRAZES = (0.25, 0.5, 0.75, 0.9, 1.0, 1.1, 1.25)
NEAR = (0.09995, 0.10008)
"""Forces of the detail beside the graze."""


def tutorial(client: Client) -> Section:
    """Return the section."""
    section = Section("COCO: a branch over the force, through a graze")
    section.say(
        "H. Dankowicz and F. Schilder, *Recipes for Continuation* (SIAM, 2013), example 15.2, and section 9 of"
        " PO-Tutorial in COCO: x'' + 0.1 x' + x = A cos(t), a stop at 1 with R = 0.8, one impact in a period. Read:"
        " the scripts of the demo, in the copies of COCO on GitHub, and the tutorial; not the pages of the book, nor"
        " the output of a run. The demo starts at A = 1 from a guess with three digits, and continues over A down to"
        " the graze and beyond it."
    )
    orbit = client.periodic_orbit(OSCILLATOR, omega=1.0, clearance=right(1.0), motion=(1, [1]), **QUIET)
    speed, phase = float(orbit.velocities[0]), float(orbit.phases[0]) % (2.0 * math.pi)
    path = client.trajectory(
        OSCILLATOR, omega=1.0, clearance=right(1.0), initial=orbit.start, periods=1, times=[math.pi], **QUIET
    )
    state = (float(path.displacement[0, 0]), float(path.velocity[0, 0]))
    computed = [
        ("velocity after the impact, A = 1", SPEED_AFTER, -0.8 * speed),
        ("phase of the impact", PHASE, phase),
        ("displacement at the phase -pi", AT_MINUS_PI[0], state[0]),
        ("velocity at the phase -pi", AT_MINUS_PI[1], state[1]),
        ("time from the phase -pi to the impact", DURATIONS[0], math.pi + phase),
        ("time from the impact to the phase pi", DURATIONS[1], math.pi - phase),
    ]
    section.show(
        ["what", "printed", "computed"], [[what, f"{printed:g}", f"{value:.11f}"] for what, printed, value in computed]
    )
    section.rows.append(
        Row(SOURCE, "velocity after the impact, A = 1", f"{SPEED_AFTER:g}", f"{-0.8 * speed:.11f}", "agrees: a guess")
    )
    pair = max(orbit.multipliers, key=lambda multiplier: multiplier.imag)
    branch = client.orbit_branch(
        OSCILLATOR, omega=1.0, clearance=right(1.0), motion=orbit, vary="forcing", range=(0.05, 1.0), **QUIET
    )
    assert branch.forcing is not None
    named = {kind: [point for point in branch.special_points if point.type == kind] for kind in ("SN", "GR")}
    (fold,), (graze,) = named["SN"], named["GR"]
    assert fold.forcing is not None
    assert graze.forcing is not None
    virtual = float(branch.velocities[~branch.admissible][:, 0].min())
    section.say(
        f"The orbit at A = 1 is {orbit.said}: its multipliers are {pair.real:.10f} +- {pair.imag:.10f} i; the demo"
        " switches them off. The branch passes through the graze of the steady motion, which has the amplitude 1 at A"
        f" = {graze.forcing:.12f}; closed form: 0.1. The demo marks it too, and says that the solutions beyond are"
        f" nonphysical: here their impact velocity points away from the stop, down to {virtual:.11f} where A is 1"
        " again, and they are not admissible."
    )
    section.rows.append(Row(SOURCE, "force at the graze", "0.1 (closed form)", f"{graze.forcing:.12f}", "agrees"))
    section.say(
        "What the sources do not say: the branch does not reach the graze in one direction. It turns in a saddle-node"
        f" at A = {fold.forcing:.12f} with an impact speed of {float(fold.velocities[0]):.11f}, below the graze."
        " Between the two a stable and an unstable motion with impacts exist beside the steady motion, on"
        f" {graze.forcing - fold.forcing:.1e} of the force, which the steps of the demo pass over: omega = 1 is next to"
        f" the resonance at omega = {math.sqrt(1.0 - 0.05**2):.9f}, where the branch would leave the graze vertically."
    )
    section.draw(
        "published_force.png",
        "The branch over the force, and its end beside the graze",
        lambda: _picture(client, branch),
    )
    curve = client.grazing_curve(OSCILLATOR, omega=list(GRAZES), clearance={"left": None}, **QUIET)
    forces = [1.0 / value for value in curve.clearance_right.tolist()]
    section.say(
        "Figure 15.6 shows the force at which the steady motion grazes over the frequency; its axes end at 1 and at"
        " 1.5. The force is 1 at omega = sqrt(1.99), inside of the axes."
    )
    section.show(
        ["omega", "force at the graze", "closed form"],
        [
            [f"{w:g}", f"{force:.10f}", f"{math.hypot(1.0 - w * w, 0.1 * w):.10f}"]
            for w, force in zip(GRAZES, forces, strict=True)
        ],
    )
    return section


def _picture(client: Client, branch: OrbitBranch) -> Axes:
    from grazemap.plots.axes import axes_or_new

    ax = branch.plot(axes_or_new(None, 9.0, 5.0), labels=False, legend="inside")
    ax.set(xlabel="force $A$", ylabel="velocity before the impact")
    inset = ax.inset_axes((0.56, 0.32, 0.41, 0.28), zorder=5.0)
    special = {point.type: (point.forcing or 0.0, float(point.velocities[0])) for point in branch.special_points}
    inset.plot(*zip(*_beside(client, special["SN"]), strict=True), color="black", linewidth=1.2)
    for kind in ("SN", "GR"):
        inset.plot(*special[kind], "o", markersize=4, color="black")
        inset.annotate(kind, special[kind], (8, -3), textcoords="offset points", fontsize=8)
    inset.axhline(0.0, color="0.7", linewidth=0.8, zorder=0.0)
    inset.set(xlim=NEAR, ylim=(-0.004, 0.012))
    inset.ticklabel_format(useOffset=False)
    inset.tick_params(labelsize=7)
    inset.set_title("beside the graze", fontsize=8)
    return ax


def _beside(client: Client, fold: tuple[float, float]) -> list[tuple[float, float]]:
    """Return forces and velocities of the orbits on both sides of the saddle-node, in the order of the branch."""
    family = Family.of(0.1, 0.8, 1.0)
    forces = [fold[0] + (NEAR[1] - fold[0]) * (k / 12) ** 2 for k in range(1, 13)]
    parts = []
    for side in (0, 1):
        guesses = [family.guess(1.0 / force, family.speeds(1.0 / force)[side]) for force in forces]
        orbits = [
            orbit_near(client, OSCILLATOR, 1.0, 1.0 / force, at) for force, at in zip(forces, guesses, strict=True)
        ]
        parts.append([(force, float(orbit.velocities[0]) * force) for force, orbit in zip(forces, orbits, strict=True)])
    return [*reversed(parts[0]), fold, *parts[1]]
