"""Weidemann, Bergman, Vakakis and Krack: an impact damper, a mass between stops on another mass."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.optimize import brentq

from grazemap import Client, OrbitBranch, Oscillator, PeriodicOrbit
from paper.page import Row, Section
from paper.published.one_mass import QUIET

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SOURCE = "Weidemann et al. 2025"
MASS_RATIO, DAMPING, RESTITUTION = 0.02, 1e-3, 0.8
# Of the absorber to the ground: its frequency and damping ratio. It is free in the source.
TETHER, TETHER_RATIO = 1e-4, 0.05
REFERENCE = 0.5 / DAMPING
SAMPLES = 4096
CASES = ((0.1, (0.95, 0.97, 0.99, 1.0, 1.002, 1.004, 1.01)), (0.2, (0.96, 0.97, 0.98, 0.99)))
"""Half clearance over the reference amplitude, and frequencies."""
SHOWN = 400
OSCILLATOR = Oscillator.model_validate(
    {
        "matrices": {
            "mass": [[1.0 - MASS_RATIO, 0.0], [0.0, MASS_RATIO]],
            "damping": [[2.0 * DAMPING, 0.0], [0.0, 2.0 * TETHER_RATIO * MASS_RATIO * TETHER]],
            "stiffness": [[1.0, 0.0], [0.0, MASS_RATIO * TETHER**2]],
        },
        "contact": [2, 1],
        "restitution": RESTITUTION,
        "forcing": {"amplitude": [1.0, 0.0], "phase": [0.5 * math.pi, 0.0]},
    }
)
_RHO = 2.0 / math.pi * (1.0 - RESTITUTION) / (1.0 + RESTITUTION)
_LEAST = _RHO / math.hypot(1.0, _RHO)


class Exact(NamedTuple):
    """An orbit, and its first harmonic of the displacement of mass 1 over the clearance."""

    orbit: PeriodicOrbit
    amplitude: float


def clearance_of(amplitude: float, omega: float) -> float:
    """Return the half clearance over the reference amplitude at which the source has an amplitude over clearance."""
    theta = (1.0 + math.sqrt(max(0.0, (1.0 + _RHO**2) * amplitude**2 - _RHO**2))) / (1.0 + _RHO**2)
    lag = complex(theta - 1.0, -_RHO * theta) / amplitude
    dynamic = complex(1.0 - (1.0 - MASS_RATIO) * omega**2, 2.0 * DAMPING * omega)
    impacts = 8.0 * MASS_RATIO / math.pi**2 * theta * lag * omega**2
    return 2.0 * DAMPING / abs(dynamic * amplitude - impacts)


def amplitudes(clearance: float, omega: float) -> list[float]:
    """Return all amplitudes that the source has at a clearance, increasing."""
    sizes = np.geomspace(_LEAST * (1.0 + 1e-12), 20.0, 4000)
    values = np.array([clearance_of(size, omega) for size in sizes.tolist()]) - clearance
    crossings = np.flatnonzero(np.diff(np.sign(values)) != 0.0)
    return [
        float(brentq(lambda size: clearance_of(size, omega) - clearance, sizes[k], sizes[k + 1], xtol=1e-14))
        for k in crossings.tolist()
    ]


def impact_damper(client: Client) -> Section:
    """Return the section."""
    section = Section("Weidemann, Bergman, Vakakis and Krack: an impact damper")
    section.say(
        "T. Weidemann, L. A. Bergman, A. F. Vakakis and M. Krack, *Energy transfer and localization in a forced cyclic"
        " chain of oscillators with vibro-impact nonlinear energy sinks*, Nonlinear Dynamics (2025),"
        " 10.1007/s11071-025-10928-4. Read: the code of their analytical frequency response and of its parameters for"
        " Figure 5 (tobiaswdm/CC on GitHub); not the paper. When all sectors move alike, one sector remains: a mass 1"
        " - eps on a spring, x'' (1 - eps) + 2 D x' + x = cos(r t) + impacts, and a free mass eps between stops at +-"
        " Gamma on it; eps = 0.02, D = 0.001, R = 0.8. The formula takes one harmonic of x, a triangular wave of the"
        " absorber, and one impact on each stop a period. It gives xi, the amplitude of x over Gamma; Gamma is"
        " relative to the amplitude at resonance, 1/(2 D)."
    )
    section.say(
        "grazemap refuses a free mass that contact sees. So the absorber has a spring to the ground here, of the"
        f" frequency {TETHER:g}, which changes xi by about 1e-5 of it. The orbits are exact but for that; xi is the"
        f" first harmonic of x, from {SAMPLES} samples."
    )
    rows, branches = [], []
    for clearance, frequencies in CASES:
        branch = _branch(client, clearance)
        branches.append((clearance, branch))
        for omega in frequencies:
            exact = exact_orbits(client, clearance, omega, branch)
            for printed, computed in zip(amplitudes(clearance, omega)[-len(exact) :], exact, strict=True):
                rows.append(
                    [
                        f"{clearance:g}",
                        f"{omega:g}",
                        f"{printed:.6f}",
                        f"{computed.amplitude:.6f}",
                        f"{100.0 * (printed / computed.amplitude - 1.0):+.1f} %",
                        f"{float(computed.orbit.velocities[0]):.4f}",
                        f"{computed.orbit.said}, {max(map(abs, computed.orbit.multipliers.tolist())):.4f}",
                    ]
                )
    section.show(
        ["Gamma", "r", "xi printed", "xi computed", "difference", "impact speed", "here; largest multiplier"], rows
    )
    largest = max(rows, key=lambda row: abs(float(row[4].split()[0])))
    section.rows.append(
        Row(
            SOURCE,
            f"amplitude over clearance, {len(rows)} points; Gamma = {largest[0]}, r = {largest[1]}",
            largest[2],
            largest[3],
            f"at most {largest[4].lstrip('+-')}: one harmonic there, exact orbits here",
        )
    )
    section.say(
        "Why they differ: the formula neglects the higher harmonics of x and the curvature of the flight of the"
        " absorber, which are of the order of eps. Exact orbits also lose their symmetry, at a multiplier 1 of the"
        " motion and its mirror image, or at a fold. Such stability is that of one sector, where all move alike; the"
        " criterion of the source is another one."
    )
    section.draw(
        "published_damper.png",
        "The amplitude of the damped mass over the frequency",
        lambda: _picture(client, branches),
    )
    return section


def exact_orbits(client: Client, clearance: float, omega: float, branch: OrbitBranch) -> list[Exact]:
    """Return the orbits of a branch at a frequency, by amplitude: one between any two turns of the branch."""
    turns = 1 + np.flatnonzero(np.diff(np.sign(np.diff(branch.omega))) != 0.0)
    parts = np.split(np.arange(len(branch.omega)), turns)
    there = [part for part in parts if branch.omega[part].min() <= omega <= branch.omega[part].max()]
    nearest = [int(part[np.argmin(np.abs(branch.omega[part] - omega))]) for part in there]
    return sorted((_exact(client, clearance, omega, branch, k) for k in nearest), key=lambda exact: exact.amplitude)


def _exact(client: Client, clearance: float, omega: float, branch: OrbitBranch, index: int) -> Exact:
    """Return the orbit at a frequency, from one of the branch."""
    gap = clearance * REFERENCE
    motion = {"period": 1, "stops": branch.stops.tolist(), "phases": branch.phases[index].tolist()}
    motion["velocities"] = branch.velocities[index].tolist()
    orbit = client.periodic_orbit(OSCILLATOR, omega=omega, clearance=gap, motion=motion, **QUIET)
    assert orbit.converged
    return Exact(orbit, _first_harmonic(client, omega, gap, orbit) / gap)


def _branch(client: Client, clearance: float) -> OrbitBranch:
    low, high = {0.1: (0.93, 1.02), 0.2: (0.93, 0.995)}[clearance]
    return client.orbit_branch(
        OSCILLATOR,
        omega=0.97,
        clearance=clearance * REFERENCE,
        motion=(1, [1, -1]),
        vary="omega",
        range=(low, high),
        **QUIET,
    )


def _first_harmonic(client: Client, omega: float, gap: float, orbit: PeriodicOrbit) -> float:
    path = client.trajectory(
        OSCILLATOR,
        omega=omega,
        clearance=gap,
        initial=orbit.start,
        periods=1,
        samples_per_period=SAMPLES,
        **QUIET,
    )
    return float(2.0 * abs(np.mean(path.displacement[0, :SAMPLES] * np.exp(-1j * omega * path.time[:SAMPLES]))))


def _picture(client: Client, branches: list[tuple[float, OrbitBranch]]) -> Axes:
    from grazemap.plots.axes import axes_or_new

    ax = axes_or_new(None, 9.0, 5.0)
    for (clearance, branch), colour in zip(branches, ("tab:blue", "tab:red"), strict=True):
        low, high = float(branch.omega.min()), float(branch.omega.max())
        roots = 2 if np.any(np.diff(np.sign(np.diff(branch.omega)))) else 1
        every = [
            (w, size) for w in np.linspace(low, high, SHOWN).tolist() for size in amplitudes(clearance, w)[-roots:]
        ]
        ax.plot(
            *zip(*every, strict=True),
            ".",
            color=colour,
            alpha=0.35,
            markersize=3,
            label=f"printed, $\\Gamma$ = {clearance:g}",
        )
        # evenly along the branch
        steps = np.abs(np.diff(branch.omega)) / (high - low) + np.abs(np.diff(np.log(branch.velocities[:, 0]))) / 3.0
        along = np.concatenate([[0.0], np.cumsum(steps)])
        chosen = np.unique(np.searchsorted(along, np.linspace(0.0, along[-1], 36)).clip(max=len(along) - 1))
        exact = [_exact(client, clearance, float(branch.omega[k]), branch, k) for k in chosen.tolist()]
        for stable, face in ((True, colour), (False, "white")):
            shown = [
                (computed.orbit.omega, computed.amplitude) for computed in exact if computed.orbit.stable == stable
            ]
            if shown:
                name = f"computed, {'stable' if stable else 'unstable'}"
                ax.plot(*zip(*shown, strict=True), "o", color=colour, markerfacecolor=face, markersize=5, label=name)
    ax.set(xlabel="frequency $r$", ylabel=r"$\xi$, amplitude over clearance", yscale="log")
    ax.legend(fontsize=8)
    return ax
