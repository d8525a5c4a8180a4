"""Single orbits on a branch of one-impact motions in closed form: a state to start from, and every Floquet multiplier.

An orbit is chosen by its angle on the branch, or by its clearance (theory, "One impact a period").
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigvals

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.one_impact_family import before_impulse, periodic_sums
from grazemap_core.grazing.poincare_map import flow_of_blocks
from grazemap_core.model.impulse_response import impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.orbits.one_impact_branches import OneImpactBranch


@dataclass(frozen=True, eq=False)
class OneImpactOrbit:
    """A periodic motion with one impact in n forcing periods, or one on each stop, just before an impact.

    Attributes
    ----------
    omega, clearance : float
    multiple : int
        n.
    symmetric : bool
        One impact on each stop.
    stop : int
        Stop of the impact at t = 0: +1 (A) or -1 (C).
    angle : float
        Angle on the branch, radians in (-pi/2, pi/2).
    impact_velocity : float
        Speed of mass 1 before the impact, > 0.
    displacement, velocity : ndarray of shape (N,)
        State just before the impact. `trajectory.trajectory`, started there, begins with the impact.
    phase : float
        Forcing phase there, in (-pi, pi].
    multipliers : ndarray of complex, shape (2N,)
        Floquet multipliers over n forcing periods, by decreasing modulus.
    half_multipliers : ndarray of complex, shape (2N,), or None
        Symmetric motions only: those of half the period followed by the mirror image; their squares are the
        multipliers. At a saddle-node one is +1; where the symmetry breaks, -1.
    stable : bool
        Every multiplier has a modulus below 1.
    admissible : bool
        There is no contact with a stop other than its impacts. An orbit that is not admissible solves the equations,
        but is no motion.
    """

    omega: float
    clearance: float
    multiple: int
    symmetric: bool
    stop: int
    angle: float
    impact_velocity: float
    displacement: Floats
    velocity: Floats
    phase: float
    multipliers: Complexes
    half_multipliers: Complexes | None
    stable: bool
    admissible: bool


def orbit_at(branch: OneImpactBranch, angle: float, stop: int = 1) -> OneImpactOrbit:
    """Return the orbit at an angle of a branch.

    Parameters
    ----------
    branch : OneImpactBranch
    angle : float
        Above ``branch.lowest`` and below pi/2.
    stop : {1, -1}
        The stop that is struck at t = 0; with -1 the orbit is the mirror image.

    Raises
    ------
    ParameterError
        The angle or the stop is out of range.
    """
    velocity = branch.impact_velocity(angle) if math.isfinite(angle) else math.nan
    if not (max(branch.lowest, -0.5 * math.pi) < angle < 0.5 * math.pi and velocity > 0.0):
        raise ParameterError("angle", "must lie between that of a clearance of 0 and pi/2")
    return _orbit(branch, angle, branch.clearance(angle), velocity, stop)


def orbits_at_clearance(branch: OneImpactBranch, clearance: float, stop: int = 1) -> list[OneImpactOrbit]:
    """Return the orbits of a branch with this clearance, by rising impact velocity: none, one, or two.

    Raises
    ------
    ParameterError
        The clearance is not greater than 0, or the stop is not 1 or -1.
    """
    return [
        _orbit(branch, angle, float(clearance), branch.impact_velocity(angle), stop)
        for angle in branch.angles(clearance)
    ]


def _orbit(branch: OneImpactBranch, angle: float, clearance: float, speed: float, stop: int) -> OneImpactOrbit:
    if stop not in (1, -1):
        raise ParameterError("stop", "must be 1 or -1")
    phase = angle - float(np.angle(branch.steady[0]))
    turned = branch.steady * np.exp(1j * phase)
    count = branch.oscillator.size
    span, model = branch.pattern.spacing(branch.omega), modal_model(branch.oscillator)
    before = before_impulse(branch.pattern.kinds[0], model, model.unit_impulse, span)
    kicks = -(1.0 + branch.oscillator.restitution) * speed * (model.from_modal @ before.ravel())
    displacement = turned.imag + kicks[:count]
    velocity = branch.omega * turned.real + kicks[count:]
    # mass 1 is on its stop, and strikes it with that speed, exactly
    displacement[0], velocity[0] = clearance, speed
    if stop < 0:
        displacement, velocity, phase = -displacement, -velocity, phase + math.pi
    phase = math.remainder(phase, 2.0 * math.pi)

    signed = _multipliers(branch, angle, speed)
    symmetric = branch.pattern.symmetric
    multipliers = signed * signed if symmetric else signed
    return OneImpactOrbit(
        omega=branch.omega,
        clearance=clearance,
        multiple=branch.pattern.multiple,
        symmetric=symmetric,
        stop=stop,
        angle=angle,
        impact_velocity=speed,
        displacement=displacement,
        velocity=velocity,
        phase=phase if phase > -math.pi else math.pi,
        multipliers=multipliers,
        half_multipliers=signed if symmetric else None,
        stable=bool(np.all(np.abs(multipliers) < 1.0)),
        admissible=angle > branch.admissible_above,
    )


def _multipliers(branch: OneImpactBranch, angle: float, speed: float) -> Complexes:
    """Return the eigenvalues of flow times saltation matrix, by decreasing modulus.

    One part of the saltation matrix, ``(1 + R)(a/v) k x_1``, grows without bound as the impact velocity v vanishes. Its
    factor ``s = omega x_1 V/v``, with V = omega A, becomes an additional unknown. The eigenvalues are then those of a
    pencil whose entries remain of comparable size, so small ones keep their digits beside one that tends to infinity.
    The second infinite eigenvalue of the pencil belongs to the additional unknown.
    """
    model, omega = modal_model(branch.oscillator), branch.omega
    sums = periodic_sums(impulse_response(model), branch.pattern, omega)
    rebound = 1.0 + branch.oscillator.restitution
    count = model.size
    frequency = np.sqrt(model.frequency_squared)
    weight = np.stack([frequency, np.ones(count)], axis=1).ravel()  # energy coordinates: all entries have the same unit
    flow, rates = flow_of_blocks(model, branch.pattern.spacing(omega)), np.zeros((2 * count, 2 * count))
    if branch.pattern.symmetric:
        flow = -flow
    for j in range(count):
        rates[2 * j, 2 * j + 1] = 1.0
        rates[2 * j + 1, 2 * j] = -model.frequency_squared[j]
        rates[2 * j + 1, 2 * j + 1] = -2.0 * model.decay[j]
    unit_impulse = weight * model.unit_impulse.ravel()
    drift = weight * (rates @ model.unit_impulse.ravel())
    place, rate = model.from_modal[0] / weight, model.from_modal[count] / weight
    flow = flow * weight[:, None] / weight

    top_speed = omega * branch.amplitude
    acceleration = -omega * top_speed * math.sin(angle) - rebound * speed * sums.acceleration
    size = 2 * count
    left = np.zeros((size + 1, size + 1))
    left[:size, :size] = flow @ (np.eye(size) - rebound * (np.outer(unit_impulse, rate) + np.outer(drift, place)))
    left[:size, size] = flow @ unit_impulse * (rebound * acceleration / (omega * top_speed))
    left[size, :size] = omega * place
    left[size, size] = -speed / top_speed
    right = np.diag(np.append(np.ones(size), 0.0))
    above, below = eigvals(left, right, homogeneous_eigvals=True)
    finite = np.argsort(np.abs(below) / np.hypot(np.abs(above), np.abs(below)))[1:]
    multipliers = (above[finite] / below[finite]).astype(np.complex128)
    return multipliers[np.argsort(-np.abs(multipliers), kind="stable")]
