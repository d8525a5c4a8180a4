"""States of a periodic motion with impacts, of the whole chain, and all its Floquet multipliers."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import eigvals

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.grazing.one_impact_family import before_impulse
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.equations import OrbitProblem
from grazemap_core.orbits.kernels.multipliers import block_scale


def state_at(
    family: OrbitFamily, omega: float, steady: Complexes, sequence: ImpactSequence, phase: float
) -> tuple[Floats, Floats]:
    """Return displacement and velocity, (N,) each, at a forcing phase; just before the impact if there is one.

    `sequence` is as solved for: for a symmetric motion, half the period.
    """
    model, count = family.model, family.model.size
    span = family.pattern.spacing(omega)
    periodic_impulse = model.unit_impulse + before_impulse(family.pattern.kinds[0], model, model.unit_impulse, span)
    state = np.zeros((count, 2))
    for impact, speed in zip(sequence.phases, sequence.velocities, strict=True):
        spans = math.ceil((phase - impact) / family.turn) - 1
        time = (phase - impact - spans * family.turn) / omega
        sign = -1.0 if family.pattern.symmetric and spans % 2 else 1.0
        strength = -sign * (1.0 + family.oscillator.restitution) * speed
        for j in range(count):
            e11, e12, e21, e22 = block_flow(model.decay[j], model.discriminant[j], model.frequency_squared[j], time)
            state[j, 0] += strength * (e11 * periodic_impulse[j, 0] + e12 * periodic_impulse[j, 1])
            state[j, 1] += strength * (e21 * periodic_impulse[j, 0] + e22 * periodic_impulse[j, 1])
    turned = steady * np.exp(1j * phase)
    free = model.from_modal @ state.ravel()
    return turned.imag + free[:count], omega * turned.real + free[count:]


def multipliers_of(problem: OrbitProblem, phases: Floats, speeds: Floats, before: Floats) -> Complexes:
    """Return the Floquet multipliers over a span, by decreasing modulus, complex (2N,).

    One part of each saltation matrix grows as 1/v where the impact velocity v vanishes. With an additional unknown for
    that part of every impact the multipliers are the eigenvalues of a pencil with entries of comparable size, so small
    multipliers keep their digits beside one that tends to infinity. The infinite eigenvalues that belong to the
    additional unknowns are left out.
    """
    size, count = 2 * len(problem.decay), len(phases)
    scale = np.array([block_scale(problem, j) for j in range(size // 2)])
    place, rate = np.zeros(size), np.zeros(size)
    place[0::2], rate[1::2] = scale / problem.frequency, scale
    unit_impulse, drift = np.empty(size), np.empty(size)
    unit_impulse[0::2] = problem.frequency * problem.unit_impulse[:, 0] / scale
    unit_impulse[1::2] = problem.unit_impulse[:, 1] / scale
    second_derivative = (
        -problem.frequency_squared * problem.unit_impulse[:, 0] - 2.0 * problem.decay * problem.unit_impulse[:, 1]
    )
    drift[0::2] = problem.frequency * problem.unit_impulse[:, 1] / scale
    drift[1::2] = second_derivative / scale
    change = np.eye(size, size + count)
    rows = np.zeros((count, size + count))
    for i in range(count):
        rows[i] = problem.omega * (place @ change)
        rows[i, size + i] = -speeds[i]
        change = change - problem.rebound * (np.outer(unit_impulse, rate @ change) + np.outer(drift, place @ change))
        change[:, size + i] += problem.rebound * before[i, 2] * unit_impulse
        end = phases[0] + problem.turn if i == count - 1 else phases[i + 1]
        time = float(end - phases[i]) / problem.omega
        for j in range(size // 2):
            e11, e12, e21, e22 = block_flow(
                problem.decay[j], problem.discriminant[j], problem.frequency_squared[j], time
            )
            w = problem.frequency[j]
            change[2 * j : 2 * j + 2] = np.array([[e11, e12 * w], [e21 / w, e22]]) @ change[2 * j : 2 * j + 2]
    left = np.concatenate([problem.sign * change, rows])
    right = np.diag(np.concatenate([np.ones(size), np.zeros(count)]))
    above, below = eigvals(left, right, homogeneous_eigvals=True)
    finite = np.argsort(np.abs(below) / np.hypot(np.abs(above), np.abs(below)))[count:]
    with np.errstate(divide="ignore", invalid="ignore"):
        multipliers: Complexes = (above[finite] / below[finite]).astype(np.complex128)
    return multipliers[np.argsort(-np.abs(multipliers), kind="stable")]
