"""Branches of periodic motions with one impact, or one on each stop, at one forcing frequency, in closed form.

A branch runs over all gaps of the stop from the equilibrium; without a bias these are the clearances. The other stop
has the same gap, or is absent. Its special points are where it turns (SN), doubles its period (PD) or loses its
symmetry (SB), and where the contact touches a stop between its impacts (GR). See theory, "One impact a period".
Branches under several harmonics are those of `explicit_orbits`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Complexes
from grazemap_core.checks import checked_omega
from grazemap_core.errors import ConditioningError, ParameterError
from grazemap_core.grazing.kernels.kicked_motion import (
    ADMISSIBLE,
    ANGLE_NEEDS_MORE_CELLS,
    NEVER,
    KickedMotion,
    contact_angle,
)
from grazemap_core.grazing.one_impact_family import Pattern, PeriodicSums, periodic_sums
from grazemap_core.model.harmonic_response import harmonic_amplitudes, require_damped, require_forced
from grazemap_core.model.impulse_response import ImpulseResponse, impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import dataclass

Special = Literal["SN", "PD", "SB", "GR"]
Admissibility = Literal["decided", "undecided"]


@dataclass(frozen=True)
class BranchPoint:
    """A special point of a branch."""

    type: Special
    """Saddle-node, period doubling, symmetry breaking; or a graze, at which the branch ends."""
    angle: float
    """Angle on the branch, radians, decreasing from pi/2 (grazing)."""
    clearance: float
    """Clearance there."""
    impact_velocity: float
    """Velocity before an impact, >= 0."""
    admissible: bool
    """The orbit has no other contact with a stop; for a GR, the orbits on one side of it have none."""
    stop: int | None = None
    """GR only: +1 when the further contact is with the stop that is struck (first), -1 when with the other one."""
    time: float | None = None
    """GR only: time of the contact after the impact; 0 where the impact itself is the graze."""


@dataclass(frozen=True, eq=False)
class OneImpactBranch:
    """All motions of one pattern at one forcing frequency: ``v = A cos(angle)/d, b = A sin(angle) - c v``.

    They lie on the ellipse ``(b + c v)^2 + (d v)^2 = A^2``; v is the speed of the impact, b the gap of the stop, which
    is the clearance without a bias. Build it with `one_impact_branch`.
    """

    oscillator: Oscillator
    """The oscillator."""
    omega: float
    """Forcing frequency."""
    pattern: Pattern
    """The pattern of impacts."""
    stop: int
    """The stop of the impact, +1 or -1; of symmetric motions, of the first one."""
    amplitude: float
    """A, the gap of the grazing curve."""
    phase: float
    """Phase of the steady motion of the contact, which is A sin(omega t + phase)."""
    steady: Complexes
    """(N,) The steady motion, at phase 0."""
    position_coefficient: float
    """``c = (1 + R) H``, a time."""
    velocity_coefficient: float
    """``d = (1 + (1 + R) H')/omega``, a time, above ``(1 - R)/(2 omega)``."""
    lowest: float
    """Angle at which the clearance is 0; the branch ends there, or before."""
    admissible_above: float
    """Orbits with an angle above this, and below pi/2, have no contacts other than their impacts; pi/2 if there are
    none."""
    admissibility: Admissibility
    """It is "undecided" where round-off hides whether orbits of vanishing impact speed have another contact;
    `admissible_above` is pi/2 then too."""
    special_points: tuple[BranchPoint, ...]
    """In the order of the branch, by decreasing angle. The first is the graze at which it begins."""

    def clearance(self, angle: float) -> float:
        """Return b at an angle."""
        ratio = self.position_coefficient / self.velocity_coefficient
        return self.amplitude * (math.sin(angle) - ratio * math.cos(angle))

    def impact_velocity(self, angle: float) -> float:
        """Return v at an angle."""
        return self.amplitude * math.cos(angle) / self.velocity_coefficient

    def angles(self, clearance: float) -> list[float]:
        """Return the angles of the orbits with this gap: none, one, or two (above the grazing curve), decreasing.

        Raises
        ------
        ParameterError
            The clearance is not a finite number greater than 0.
        """
        if not (math.isfinite(clearance) and clearance > 0.0):
            raise ParameterError("clearance", "must be a finite number greater than 0")
        lean = math.atan2(self.position_coefficient, self.velocity_coefficient)
        height = clearance * math.cos(lean) / self.amplitude  # b = A sin(angle - lean)/cos(lean)
        if height > 1.0:
            return []
        rise = math.asin(height)
        solutions = [lean + math.pi - rise, lean + rise]
        return [angle for angle in dict.fromkeys(solutions) if -0.5 * math.pi < angle < 0.5 * math.pi]


def one_impact_branch(
    oscillator: Oscillator,
    omega: float,
    multiple: int = 1,
    symmetric: bool = False,
    stop: int = 1,
    alone: bool = False,
) -> OneImpactBranch:
    """Return the branch of motions with one impact in n forcing periods, or one on each stop.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega : float
        Forcing frequency > 0 (rad/s in SI).
    multiple : int
        n >= 1, odd for symmetric motions.
    symmetric : bool
        One impact on each stop, n/2 forcing periods apart; otherwise one impact on one stop.
    stop : {+1, -1}
        The stop that is struck.
    alone : bool
        Whether the other stop is absent; otherwise it has the same gap from the equilibrium.

    Raises
    ------
    ParameterError
        Nothing is forced, a number is out of range, there are other harmonics than the first, or symmetric motions are
        asked for between stops that are not symmetric.
    SteadyMotionError
        A mode is undamped.
    ConditioningError
        The modal model is ill-conditioned.
    """
    return next(one_impact_branches(oscillator, [omega], multiple, symmetric, stop, alone))


def one_impact_branches(
    oscillator: Oscillator, omega: ArrayLike, multiple: int, symmetric: bool, stop: int = 1, alone: bool = False
) -> Iterator[OneImpactBranch]:
    """Yield `one_impact_branch` for each forcing frequency of a list."""
    require_forced(oscillator)
    require_damped(oscillator)
    pattern = Pattern(multiple, symmetric)
    if symmetric and (alone or oscillator.restitution_of(1) != oscillator.restitution_of(-1)):
        raise ParameterError("symmetric", "motions need two stops of equal restitution")
    if [harmonic.order for harmonic in oscillator.drive] != [1]:
        raise ParameterError("forcing", "has other harmonics than the first, which these closed forms do not cover")
    values = checked_omega(omega)
    steady = harmonic_amplitudes(oscillator, values, oscillator.drive[0])
    response = impulse_response(modal_model(oscillator))
    for frequency, amplitudes in zip(values.tolist(), steady, strict=True):
        yield _branch(oscillator, response, frequency, pattern, stop, alone, amplitudes[:-1], amplitudes[-1])


def _branch(
    oscillator: Oscillator,
    response: ImpulseResponse,
    omega: float,
    pattern: Pattern,
    stop: int,
    alone: bool,
    steady: Complexes,
    contact: complex,
) -> OneImpactBranch:
    amplitude = float(np.abs(contact))
    if not (math.isfinite(amplitude) and amplitude > 0.0):
        raise ParameterError("omega", "is a frequency at which the amplitude of the contact overflows or underflows")
    sums = periodic_sums(response, pattern, omega)
    rebound = 1.0 + oscillator.restitution_of(stop)
    c = rebound * sums.displacement
    d = (1.0 + rebound * sums.velocity) / omega
    if not d > 0.0:  # only by round-off, for an elastic impact of a practically undamped structure
        raise ConditioningError("the impact speed is not determined: hardly any energy is lost in a period")
    further, admissibility = _first_contact(response, pattern, omega, sums, rebound / d, alone)
    points = _special_points(omega, pattern, amplitude, c, d, sums, rebound, further)
    return OneImpactBranch(
        oscillator=oscillator,
        omega=omega,
        pattern=pattern,
        stop=stop,
        amplitude=amplitude,
        phase=float(np.angle(contact)),
        steady=steady,
        position_coefficient=c,
        velocity_coefficient=d,
        lowest=math.atan2(c, d),
        admissible_above=further.angle,
        admissibility=admissibility,
        special_points=points,
    )


@dataclass(frozen=True)
class _BranchContact:
    """A further contact of an orbit."""

    sine: float
    """Sine of the angle on the branch."""
    cosine: float
    """Cosine of this angle."""
    stop: int
    """Stop of the contact."""
    time: float
    """Time of the contact after the impact."""

    @property
    def angle(self) -> float:
        return math.atan2(self.sine, self.cosine)


def _first_contact(
    response: ImpulseResponse, pattern: Pattern, omega: float, sums: PeriodicSums, factor: float, alone: bool
) -> tuple[_BranchContact, Admissibility]:
    """Return the first further contact on the branch, by decreasing angle from the graze at which the branch begins."""
    contacts: list[tuple[bool, _BranchContact]] = []
    undecided = False
    blocks = (response.decay, response.discriminant, response.frequency_squared)
    motion = KickedMotion(*blocks, sums.state, sums.displacement, factor, omega)
    for stop in (1,) if alone else (1, -1):
        meets = -1 if pattern.symmetric else 1
        sine, cosine, time, status = contact_angle(motion, pattern.half_periods, stop, meets)
        if status == ANGLE_NEEDS_MORE_CELLS:
            raise ParameterError("omega", "the motion oscillates too often between two impacts to be searched")
        undecided |= status not in (ADMISSIBLE, NEVER)
        contacts.append((status == NEVER, _BranchContact(sine, cosine, stop, time)))
    never, first = max(contacts, key=lambda contact: (contact[0], contact[1].angle))
    return first, "undecided" if undecided and not never else "decided"


def _special_points(
    omega: float,
    pattern: Pattern,
    amplitude: float,
    c: float,
    d: float,
    sums: PeriodicSums,
    rebound: float,
    contact: _BranchContact,
) -> tuple[BranchPoint, ...]:
    """Return the special points with a clearance above 0, by decreasing angle."""
    lowest = math.atan2(c, d)
    any_admissible = contact.cosine > 0.0
    points = [BranchPoint("GR", 0.5 * math.pi, amplitude, 0.0, any_admissible, 1, 0.0)]

    def add(kind: Special, sine: float, cosine: float, stop: int | None = None, time: float | None = None) -> None:
        angle = math.atan2(sine, cosine)
        if angle > lowest:
            clearance = amplitude * (sine - c / d * cosine)
            velocity = amplitude * cosine / d
            admissible = angle > contact.angle if stop is None else any_admissible
            points.append(BranchPoint(kind, angle, clearance, velocity, admissible, stop, time))

    sine, cosine = saddle_node(c, d)
    if cosine > 0.0:
        add("SN", sine, cosine)
    sine, cosine = doubling(omega, sums, d, rebound)
    if cosine > 0.0:
        add("SB" if pattern.symmetric else "PD", sine, cosine)
    if any_admissible:
        add("GR", contact.sine, contact.cosine, contact.stop, contact.time)
    return tuple(sorted(points, key=lambda point: -point.angle))


def saddle_node(c: float, d: float) -> tuple[float, float]:
    """Return sine and cosine of the angle of the largest clearance; it is a saddle-node if the cosine is positive."""
    length = math.hypot(c, d)
    return d / length, -c / length


def doubling(omega: float, sums: PeriodicSums, d: float, rebound: float) -> tuple[float, float]:
    """Return sine and cosine of the one angle at which a multiplier is -1 (a half multiplier: SB).

    ``tan(angle) = E/(Q d)`` with ``Q = -(1 + R) H(-1) omega^2`` and
    ``E = D(-1)^2 + (1 + R)^2 H(-1) (H''(1) - H''(-1)), D = 1 + (1 + R) H'``, from chi(-1) = 0.
    """
    drive = -rebound * sums.doubled_displacement * omega * omega
    straight = 1.0 + rebound * sums.doubled_velocity
    second_derivative = rebound * rebound * sums.doubled_displacement * (sums.acceleration - sums.doubled_acceleration)
    sine, cosine = straight * straight + second_derivative, drive * d
    if cosine < 0.0:
        sine, cosine = -sine, -cosine
    length = math.hypot(sine, cosine)
    return sine / length, cosine / length
