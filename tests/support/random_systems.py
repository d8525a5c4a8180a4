"""Random linear structures between stops, of every kind that the model covers, as oscillators of the core."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap_core.contact.stops import Clearance
from grazemap_core.grazing.grazing_curve import VariedStop
from grazemap_core.grazing.point import GrazingPoint, grazing_point
from grazemap_core.model.drive import Harmonic, force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.structure import Structure

Floats = NDArray[np.float64]


class System(NamedTuple):
    """An oscillator at one frequency, and the clearances of its stops."""

    oscillator: Oscillator
    omega: float
    clearance: Clearance


def random_structure(random: np.random.Generator, size: int) -> Structure:
    """Return a dense structure, damped in proportion or not, gyroscopic in one of four cases, or a chain."""
    if random.integers(3) == 0:
        masses, stiffnesses = 10.0 ** random.uniform(-0.5, 0.5, (2, size))
        dampings = (10.0 ** random.uniform(-2.0, -0.5, size)).tolist()
        return Oscillator.create(masses, stiffnesses, dampings, np.ones(size), 1.0).structure
    mass, stiffness, damping = (
        root @ root.T + 0.3 * size * np.eye(size) for root in random.normal(size=(3, size, size))
    )
    if random.integers(2) == 0:
        return Matrices.create(mass, stiffness, modal=float(random.uniform(0.01, 0.1)))
    turn = random.normal(size=(size, size)) if random.integers(2) == 0 else np.zeros((size, size))
    return Matrices.create(mass, stiffness, 0.1 * damping + turn - turn.T)


def random_contact(random: np.random.Generator, size: int) -> Floats:
    """Return the row of one mass, of the difference of two, or any row."""
    row, kind = np.zeros(size), int(random.integers(3))
    if kind == 2:
        return random.normal(size=size)
    first, *others = random.permutation(size)
    row[first] = 1.0
    if kind == 1 and others:
        row[others[0]] = -1.0
    return row


def random_forces(random: np.random.Generator, size: int) -> list[Harmonic]:
    """Return one harmonic or two, in phase or not."""
    orders = [1] if random.integers(2) == 0 else [1, int(random.integers(2, 4))]
    phase = random.uniform(0.0, 6.0, size) if random.integers(2) == 0 else None
    return [force(order, random.normal(size=size) / order, phase) for order in orders]


def random_system(seed: int, *, restitution: float | None = None) -> System:
    """Return a system of 1 to 6 degrees of freedom whose steady motion would pass a stop."""
    random = np.random.default_rng(seed)
    size = 1 + seed % 6
    structure, row = random_structure(random, size), random_contact(random, size)
    drive = random_forces(random, size)
    bias = 0.3 * random.normal(size=size) if random.integers(2) == 0 else None
    both = random.uniform(0.2, 0.95, 2) if restitution is None else np.full(2, restitution)
    oscillator = Oscillator.of_structure(structure, row, drive, float(both[0]), bias, float(both[1]))
    omega = float(random.uniform(0.2, 0.9)) * float(np.sqrt(np.trace(structure.stiffness_matrix) / size))
    size_of_motion, place = _steady(oscillator, omega)
    right, left = (float(size_of_motion * random.uniform(0.2, 0.95)) + sign * place for sign in (1.0, -1.0))
    kind = int(random.integers(3))
    return System(oscillator, omega, [(right, left), (right, None), (None, left)][kind])


RESTING = (
    *(8, 14, 15, 7, 38, 21, 0, 4, 5, 6, 9, 10, 11, 13, 16, 17, 20, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 33, 34),
    *(35, 37),
)
"""Seeds of systems that come to rest at a quarter of their frequency with a restitution of 0.2."""


def resting_system(seed: int) -> System:
    """Return a system of `RESTING`."""
    system = random_system(seed, restitution=0.2)
    return system._replace(omega=0.25 * system.omega)


def mirrored(system: System) -> System:
    """Return the system with the signs of q, of the forces and of the bias changed, and the stops exchanged."""
    oscillator = system.oscillator
    drive = tuple(replace(h, constant=-h.constant, rate=-h.rate, quadratic=-h.quadratic) for h in oscillator.drive)
    restitution = oscillator.restitution_of(-1), oscillator.restitution_of(1)
    other = Oscillator.of_structure(
        oscillator.structure, oscillator.contact, drive, restitution[0], -oscillator.bias, restitution[1]
    )
    right, left = system.clearance if isinstance(system.clearance, tuple) else (system.clearance,) * 2
    return System(other, system.omega, (left, right))


def doubled(system: System) -> System:
    """Return the system with twice the contact row, and twice the clearances."""
    oscillator = system.oscillator
    left = oscillator.restitution_of(-1)
    other = Oscillator.of_structure(
        oscillator.structure, 2.0 * oscillator.contact, oscillator.drive, oscillator.restitution, oscillator.bias, left
    )
    right, left = system.clearance if isinstance(system.clearance, tuple) else (system.clearance,) * 2
    return System(other, system.omega, (right and 2.0 * right, left and 2.0 * left))


def _steady(oscillator: Oscillator, omega: float) -> tuple[float, float]:
    """Return the largest contact coordinate of the steady motion about the equilibrium, and that of the latter."""
    mass, damping, stiffness = oscillator.mass_matrix, oscillator.damping_matrix, oscillator.stiffness_matrix
    angle, motion = np.linspace(0.0, 2.0 * np.pi, 400), np.zeros(400)
    for harmonic in oscillator.drive:
        s = harmonic.order * omega
        amplitude = np.linalg.solve(
            stiffness - s * s * mass + 1j * s * damping, harmonic.amplitudes(np.array([omega]))[0]
        )
        motion += (oscillator.contact @ amplitude * np.exp(1j * harmonic.order * angle)).imag
    return float(np.abs(motion).max()), float(oscillator.contact @ np.linalg.solve(stiffness, oscillator.bias))


def general_grazing_points(count: int) -> list[GrazingPoint]:
    """Return grazing points of one stop of random systems, without another stop or with one farther away."""
    points = []
    for seed in range(count):
        oscillator, omega, _ = random_system(seed)
        stop = 1 if seed % 2 == 0 else -1
        point = grazing_point(oscillator, omega, VariedStop(stop))
        if seed % 3 == 0:
            size, place = _steady(oscillator, omega)
            point = grazing_point(oscillator, omega, VariedStop(stop, 1.5 * size - stop * place))
        points.append(point)
    return points
