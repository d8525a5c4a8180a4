"""States of a periodic motion with impacts, of the whole structure, and all its Floquet multipliers."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.linalg.lapack import dggev

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.errors import ConditioningError
from grazemap_core.grazing.one_impact_family import before_impulse
from grazemap_core.model.equilibrium import equilibrium
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.orbits.family import ForcedFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.equations import OrbitImpacts, OrbitProblem, next_phase, rebound_of
from grazemap_core.orbits.kernels.multipliers import block_scales


def states_at(forced: ForcedFamily, sequence: ImpactSequence, phases: Sequence[float]) -> list[tuple[Floats, Floats]]:
    """Return displacement and velocity, (N,) each, at forcing phases; just before an impact where there is one.

    `sequence` is as solved for: for a symmetric motion, half the period.
    """
    family, model, orders = forced.family, forced.family.model, forced.family.orders
    (before,) = before_impulse(family.pattern.kinds[0], model, model.unit_impulse, np.array([forced.span]))
    periodic_impulse = model.unit_impulse + before
    turned = forced.steady[:, :-1] * np.exp(1j * np.outer(phases, orders))[:, :, None]
    place = np.add.reduce(turned.imag, axis=1)
    velocity = np.add.reduce((orders * forced.omega)[:, None] * turned.real, axis=1)
    static = equilibrium(family.oscillator)
    states = []
    for k, phase in enumerate(phases):
        free = model.from_modal @ _blocks_at(forced, sequence, phase, periodic_impulse)
        states.append((place[k] + free[: model.size] + static, velocity[k] + free[model.size :]))
    return states


def _blocks_at(forced: ForcedFamily, sequence: ImpactSequence, phase: float, periodic_impulse: Floats) -> Floats:
    """Return the state of the blocks at a phase, without the steady motion, (2N,).

    `periodic_impulse` (N, 2) is their state just after an impulse, one in every span.
    """
    family, model = forced.family, forced.family.model
    parts = (model.decay, model.discriminant, model.frequency_squared, periodic_impulse)
    blocks = list(zip(*(part.tolist() for part in parts), strict=True))
    state = [0.0] * (2 * len(blocks))
    impacts = (part.tolist() for part in (sequence.stops, sequence.phases, sequence.velocities))
    for stop, impact, speed in zip(*impacts, strict=True):
        spans = math.ceil((phase - impact) / family.turn) - 1
        time = (phase - impact - spans * family.turn) / forced.omega
        sign = family.sign if spans % 2 else 1.0
        strength = -sign * (1.0 + family.oscillator.restitution_of(stop)) * speed
        for j, (decay, discriminant, square, (first, second)) in enumerate(blocks):
            e11, e12, e21, e22 = block_flow(decay, discriminant, square, time)
            state[2 * j] += strength * (e11 * first + e12 * second)
            state[2 * j + 1] += strength * (e21 * first + e22 * second)
    return np.array(state)


_CRITICAL = {"SN": 1, "PD": 1, "SB": 1, "NS": 2, "GR": 0}
"""How many multipliers are on the unit circle where an orbit is special, by type."""


def stable_beside(kind: str, multipliers: Complexes) -> Booleans:
    """Return whether special orbits are stable on one side of their curve, (m,).

    All multipliers (m, 2N) but those that are on the unit circle at such a point are inside of it.
    """
    moduli = np.abs(multipliers)
    others = np.argsort(np.abs(moduli - 1.0), axis=1)[:, _CRITICAL[kind] :]
    return np.asarray(np.all(np.take_along_axis(moduli, others, axis=1) < 1.0, axis=1))


def multipliers_of(problem: OrbitProblem, impacts: OrbitImpacts, before: Floats) -> Complexes:
    """Return the Floquet multipliers of the blocks over a span, complex (2N,), in the order of `_by_modulus`.

    One part of each saltation matrix grows as 1/v where the impact velocity v vanishes. With an additional unknown for
    that part of every impact the multipliers are the eigenvalues of a pencil with entries of comparable size, so small
    multipliers keep their digits beside one that tends to infinity. The infinite eigenvalues that belong to the
    additional unknowns are left out.
    """
    phases, speeds = impacts.phases, impacts.speeds
    size, count = 2 * len(problem.decay), len(phases)
    scale = np.empty(size // 2)
    block_scales(problem, scale)
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
        rebound = rebound_of(impacts.stops, impacts.sides[i])
        change = change - rebound * (unit_impulse[:, None] * (rate @ change) + drift[:, None] * (place @ change))
        change[:, size + i] += rebound * before[i, 2] * unit_impulse
        time = float(next_phase(problem, phases, i) - phases[i]) / problem.omega
        for j in range(size // 2):
            e11, e12, e21, e22 = block_flow(
                problem.decay[j], problem.discriminant[j], problem.frequency_squared[j], time
            )
            w = problem.frequency[j]
            change[2 * j : 2 * j + 2] = np.array([[e11, e12 * w], [e21 / w, e22]]) @ change[2 * j : 2 * j + 2]
    left = np.concatenate([problem.sign * change, rows])
    right = np.diag(np.concatenate([np.ones(size), np.zeros(count)]))
    above, below = _eigenvalues(left, right)
    finite = np.argsort(np.abs(below) / np.hypot(np.abs(above), np.abs(below)))[count:]
    with np.errstate(divide="ignore", invalid="ignore"):
        multipliers: Complexes = (above / below).astype(np.complex128)
    second = np.flatnonzero(above.imag < 0.0)  # follows its conjugate, from which its quotient may differ by a rounding
    multipliers[second] = np.conj(multipliers[second - 1])
    return _by_modulus(multipliers[finite])


def _eigenvalues(left: Floats, right: Floats) -> tuple[Complexes, Complexes]:
    """Return the homogeneous eigenvalues of a pencil, as `scipy.linalg.eigvals`, whose checks take as long as they.

    Raises
    ------
    ConditioningError
        A number overflowed, or the iteration does not converge.
    """
    if not np.isfinite(left).all():
        raise ConditioningError("the equations of an orbit overflow, so its multipliers are not known")
    space = int(dggev(left, right, lwork=-1)[-2][0])
    # the iteration may fail for a pencil and converge for its transpose, which has the same eigenvalues
    for first, second in ((left, right), (left.T, right.T)):
        real, imaginary, below, _, _, _, status = dggev(first, second, compute_vl=0, compute_vr=0, lwork=space)
        if status == 0:
            return real + 1j * imaginary, below.astype(np.complex128)
    raise ConditioningError("the multipliers of an orbit could not be computed: the iteration does not converge")


def with_unseen(forced: ForcedFamily, multipliers: Complexes) -> Complexes:
    """Return multipliers with those of the modes that contact does not see, in the order of `_by_modulus`."""
    if forced.family.sees_all:
        return multipliers
    return _by_modulus(np.concatenate([multipliers, forced.unseen_multipliers()]))


def _by_modulus(multipliers: Complexes) -> Complexes:
    """Return multipliers by decreasing modulus; of a complex pair, the one with the positive imaginary part first."""
    return multipliers[np.lexsort((-multipliers.imag, -np.abs(multipliers)))]
