"""The balances of momentum and energy over one period of a motion, for random general systems.

``K mean(x) = s + h mean(f_c)``, with f_c the contact force of impacts and rests, and
``mean(F^T x') = mean(x'^T C x') + losses at impacts``. Both hold for every periodic motion, so an error of an impulse,
of the effective mass, of a restitution, of the contact row or of an output breaks one of them. The mean power of the
forces is a quadrature of samples, which shares nothing with the observables.

`python -m tests.oracles.balances 200 50` checks 200 verified orbits and 50 motions with chatter or rests.
"""

from __future__ import annotations

import itertools
import math
import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.stops import Clearance
from grazemap_core.errors import CoreError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.orbit_observables import OrbitObserver
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.simulated_orbits import simulated_orbit
from grazemap_core.simulation.observables import MEANS, Observables, Output, of_record
from grazemap_core.simulation.start import State, forced_oscillator
from grazemap_core.simulation.trajectories import Trajectory, trajectory
from tests.support import random_systems
from tests.support.general_systems import random_system

NAMES = ("impulse_right", "impulse_left", "dissipated_power")
TOLERANCE = 1e-10
"""Of a balance, relative to its largest term."""


class Balance(NamedTuple):
    """What is missing in a balance, relative to its largest term: of momentum, and of energy."""

    seed: int
    label: str
    momentum: float
    energy: float

    @property
    def holds(self) -> bool:
        return self.momentum < TOLERANCE and self.energy < TOLERANCE


def observables(oscillator: Oscillator) -> Observables:
    """Return what the balances need: the means of all displacements, and the velocities in which C is diagonal."""
    size, nothing = oscillator.size, np.zeros(oscillator.size)
    damping = 0.5 * (oscillator.damping_matrix + oscillator.damping_matrix.T)
    outputs = [Output(f"x{i}", np.eye(size)[i], nothing) for i in range(size)]
    outputs += [Output(f"v{i}", nothing, row) for i, row in enumerate(np.linalg.eigh(damping)[1].T)]
    return Observables(NAMES, tuple(outputs))


def power_of_forces(oscillator: Oscillator, omega: float, run: Trajectory, periods: int) -> float:
    """Return the mean of F^T x' over a record of forcing periods that starts at phase 0, from its samples."""
    end = periods * 2.0 * math.pi / omega
    exponents = np.abs(np.linalg.eigvals(_generator(oscillator)))
    fastest = max(float(exponents.max()), omega * max(force.order for force in oscillator.forces))
    marks = [np.linspace(0.0, end, 2 + math.ceil(end * fastest)), run.impacts.time]
    marks += [run.sticking.start, run.sticking.stop_time]
    edges = np.unique(np.clip(np.concatenate(marks), 0.0, end))
    nodes, weights = np.polynomial.legendre.leggauss(12)
    lengths = np.diff(edges)
    times = (edges[:-1, None] + 0.5 * lengths[:, None] * (1.0 + nodes)).ravel()
    _, velocity = run.at(times)
    forces = sum(
        (np.outer(force.amplitudes(np.array([omega]))[0], np.exp(1j * force.order * omega * times))).imag
        for force in oscillator.forces
    )
    return float(np.sum(0.5 * np.outer(lengths, weights).ravel() * np.sum(forces * velocity, axis=0)) / end)


def _generator(oscillator: Oscillator) -> Floats:
    size = oscillator.size
    below = [
        np.linalg.solve(oscillator.mass_matrix, -part)
        for part in (oscillator.stiffness_matrix, oscillator.damping_matrix)
    ]
    return np.block([[np.zeros((size, size)), np.eye(size)], below])


def missing(oscillator: Oscillator, omega: float, figures: Floats, power: float) -> tuple[float, float]:
    """Return what is missing in the balances of momentum and of energy, from the figures of `observables`."""
    right, left, lost = figures[:3]
    size, means = oscillator.size, figures[3:].reshape(-1, len(MEANS))
    place, mean = means[:size, 1], oscillator.contact * omega / (2.0 * math.pi)
    contact = mean * (left - right)
    terms = [oscillator.stiffness_matrix * place, oscillator.bias[:, None], mean[:, None] * (left + right)]
    momentum = np.sum(terms[0], axis=1) - oscillator.bias - contact
    damping = 0.5 * (oscillator.damping_matrix + oscillator.damping_matrix.T)
    damped = np.linalg.eigvalsh(damping) @ means[size:, 0] ** 2
    largest = max(float(np.max(np.abs(term))) for term in terms)
    return float(np.max(np.abs(momentum))) / largest, abs(power - damped - lost) / max(power, damped, lost)


def of_orbit(seed: int) -> Balance | None:
    """Return the balances of the orbit with impacts of a random system, or None where it has none that is verified."""
    system = random_system(seed)
    if system is None:
        return None
    orbit = periodic_orbit(system.oscillator, system.omega, system.clearance, system.impacts)
    if not orbit.verified:
        return None
    wanted, start, period = observables(system.oscillator), orbit.start, orbit.impacts.period
    figures = OrbitObserver(system.oscillator, wanted).figures(
        system.oscillator, system.omega, system.clearance, orbit.impacts
    )
    run = _record(system.oscillator, system.omega, system.clearance, start, period)
    power = power_of_forces(system.oscillator, system.omega, run, period)
    return Balance(seed, orbit.label, *missing(system.oscillator, system.omega, figures, power))


def of_rests(seed: int) -> Balance | None:
    """Return the balances of the motion with chatter or rests of a random system, or None where it has none."""
    restitution = 0.0 if seed % 4 == 0 else 0.1 + 0.1 * (seed % 6)
    system = random_systems.random_system(seed, restitution=restitution)
    oscillator, omega, clearance = system.oscillator, system.omega, system.clearance
    try:
        run = trajectory(oscillator, omega, clearance, periods=64, transient_periods=600, samples_per_period=1)
        if run.motion.kind != "periodic" or not run.motion.sticking or run.motion.period is None:
            return None
        orbit = simulated_orbit(oscillator, omega, clearance, run)
    except CoreError:
        return None
    period, wanted = int(run.motion.period), observables(oscillator)
    again = _record(oscillator, omega, clearance, orbit.start, period)
    figures = of_record(again.record, forced_oscillator(oscillator, omega, clearance).structure.models, wanted, period)
    power = power_of_forces(oscillator, omega, again, period)
    kinds = f"{len(orbit.impacts.time)} impacts, {len(orbit.sticking.start)} rests"
    return Balance(seed, kinds, *missing(oscillator, omega, figures, power))


def _record(oscillator: Oscillator, omega: float, clearance: Clearance, start: State, period: int) -> Trajectory:
    x, v = start.displacement, start.velocity
    return trajectory(oscillator, omega, clearance, x, v, periods=period, samples_per_period=1)


def balances(orbits: int, rests: int) -> Iterator[Balance]:
    """Yield the balances of so many verified orbits, and motions with chatter or rests."""
    for count, of_seed in ((orbits, of_orbit), (rests, of_rests)):
        all_balances = (balance for seed in itertools.count() if (balance := of_seed(seed)) is not None)
        yield from itertools.islice(all_balances, count)


def main() -> int:
    """Print the worst balances, and return 1 if one does not hold."""
    motions = list(balances(*map(int, sys.argv[1:3])))
    for name in ("momentum", "energy"):
        print(f"largest residual of {name}: {max(getattr(motion, name) for motion in motions):.1e} of its terms")
    failed = [motion for motion in motions if not motion.holds]
    print(*failed, f"{len(motions) - len(failed)} of {len(motions)} motions are in balance", sep="\n")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
