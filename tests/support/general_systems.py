"""Random general systems for tests of orbits, and the balances that every periodic motion obeys."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from grazemap_core.contact.stops import Clearance
from grazemap_core.model.drive import force
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence, impacts_of
from grazemap_core.orbits.periodic_orbits import PeriodicOrbit, periodic_orbit
from grazemap_core.simulation.trajectories import trajectory


@dataclass(frozen=True, eq=False)
class System:
    """An oscillator, a frequency, clearances, and the impacts of the motion that it settles to from rest."""

    oscillator: Oscillator
    omega: float
    clearance: Clearance
    impacts: ImpactSequence


def positive(random: np.random.Generator, size: int) -> np.ndarray:
    """Return a symmetric, positive definite matrix."""
    root = random.normal(size=(size, size))
    return root @ root.T + 0.3 * size * np.eye(size)


def random_oscillator(random: np.random.Generator, kind: int) -> Oscillator:
    """Return a dense structure of 1 to 4 degrees of freedom, with a relative contact, two harmonics or a bias."""
    size = 1 + kind % 4
    mass, stiffness = positive(random, size), positive(random, size)
    damping = 0.15 * positive(random, size)
    contact = random.normal(size=size)
    if size > 1 and kind % 3 == 0:
        contact = np.eye(size)[0] - np.eye(size)[1]
    drive = [force(1, *random.normal(size=(2, size)))]
    if kind % 2:
        drive.append(force(2 + kind // 2 % 2, 0.4 * random.normal(size=size)))
    return Oscillator.of_structure(
        Matrices.create(mass, stiffness, damping),
        contact,
        drive,
        float(random.uniform(0.3, 0.9)),
        0.1 * random.normal(size=size),
        restitution_left=float(random.uniform(0.3, 0.9)),
    )


def random_system(seed: int) -> System | None:
    """Return a system whose trajectory from rest settles to a periodic motion with impacts alone, or None."""
    random = np.random.default_rng(seed)
    oscillator = random_oscillator(random, seed)
    omega = float(random.uniform(0.4, 1.6))
    size = OrbitFamily.of(oscillator, 1, False).at(omega).steady_size
    place = contact_equilibrium(oscillator)
    right, left = random.uniform(0.3, 0.9, 2) * size
    clearance = [(right + place, left - place), (right + place, None), (None, left - place)][seed % 5 % 3]
    run = trajectory(oscillator, omega, clearance, periods=16, transient_periods=600, samples_per_period=1)
    if run.motion.kind != "periodic" or run.motion.sticking or not len(run.impacts.time):
        return None
    if np.any(run.impacts.kind != "impact"):
        return None
    return System(oscillator, omega, clearance, impacts_of(run))


@functools.cache
def with_orbit(seed: int) -> tuple[System, PeriodicOrbit]:
    """Return a system of `random_system` that settles to a periodic motion, and the orbit of this motion."""
    system = random_system(seed)
    assert system is not None
    return system, periodic_orbit(system.oscillator, system.omega, system.clearance, system.impacts)


def mismatch(ours: np.ndarray, theirs: Any) -> float:
    """Return the largest distance of a multiplier from the nearest of the others, each other used once."""
    rest = list(theirs)
    away = 0.0
    for multiplier in ours:
        nearest = min(rest, key=lambda other: abs(other - multiplier))
        away = max(away, abs(nearest - multiplier))
        rest.remove(nearest)
    return away
