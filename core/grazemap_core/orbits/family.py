"""Families of periodic motions with impacts: a structure, a number of forcing periods, and whether they are symmetric.

A family at a frequency gives the equations of its orbits there, in the form that the kernels take (theory, "Any
impacting orbit").
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.reference_motion import real_and_imaginary
from grazemap_core.errors import ParameterError, checked_omega
from grazemap_core.grazing.one_impact_family import Pattern, PeriodicSums, periodic_sums
from grazemap_core.model.harmonic_response import (
    harmonic_amplitudes,
    require_damped,
    require_forced,
    response_slope,
)
from grazemap_core.model.impulse_response import ImpulseResponse, impulse_response
from grazemap_core.model.modal import ModalModel, modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.kernels.equations import OrbitProblem
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class OrbitFamily:
    """All motions of an oscillator that repeat after n forcing periods, or are mirrored after half of them."""

    oscillator: Oscillator
    """The oscillator."""
    pattern: Pattern
    """The number of periods, and whether the motions are mirrored."""
    model: ModalModel
    """Modal model of the free motion."""
    response: ImpulseResponse
    """Response of the contact to an impulse."""

    @classmethod
    def of(cls, oscillator: Oscillator, period: int, symmetric: bool) -> OrbitFamily:
        """Return the family.

        Raises
        ------
        ParameterError
            Nothing is forced, the period is below 1, or even for symmetric motions.
        SteadyMotionError
            A mode is undamped.
        ConditioningError
            The modal model is ill-conditioned.
        """
        require_forced(oscillator)
        require_damped(oscillator)
        try:
            pattern = Pattern(period, symmetric)
        except ParameterError as error:
            raise ParameterError("period", error.message) from None
        model = modal_model(oscillator)
        return cls(oscillator, pattern, model, impulse_response(model))

    @property
    def turn(self) -> float:
        """Phase after which the impacts repeat, or repeat on the opposite stops."""
        return self.pattern.half_periods * math.pi

    @property
    def sign(self) -> float:
        """1 if the impacts repeat on the same stop, -1 if on the other one."""
        return -1.0 if self.pattern.symmetric else 1.0

    @cached_property
    def orders(self) -> Floats:
        """Orders of the harmonics of the forces, (H,), increasing."""
        return np.array([float(harmonic.order) for harmonic in self.oscillator.forces])

    @property
    def has_one_harmonic(self) -> bool:
        """Whether the forces have one harmonic, of order 1."""
        return [harmonic.order for harmonic in self.oscillator.forces] == [1]

    @cached_property
    def sees_all(self) -> bool:
        """Whether contact sees every mode, and excites it."""
        return bool(np.all(self.response.seen))

    def at(self, omega: float) -> ForcedFamily:
        """Return the family at a frequency. Raises as `over`."""
        return self.over(np.array([omega]))[0]

    def over(self, omega: Floats) -> list[ForcedFamily]:
        """Return the family at each of several frequencies (m,).

        Raises
        ------
        ParameterError
            A frequency is out of range, or the amplitude of the contact overflows or underflows there.
        SteadyMotionError
            The damping is too small to resolve a resonance.
        """
        values = checked_omega(omega)
        parts = [harmonic_amplitudes(self.oscillator, values, harmonic) for harmonic in self.oscillator.forces]
        slopes = [
            response_slope(self.oscillator, values, harmonic, part[:, :-1])
            for harmonic, part in zip(self.oscillator.forces, parts, strict=True)
        ]
        at_each = values.tolist(), np.stack(parts, axis=1), np.stack(slopes, axis=1)
        sums = periodic_sums(self.response, self.pattern, values)
        families = [ForcedFamily(self, *there) for there in zip(*at_each, sums, strict=True)]
        if not all(0.0 < family.steady_size < math.inf for family in families):
            raise ParameterError(
                "omega", "is a frequency at which the amplitude of the contact overflows or underflows"
            )
        return families


@dataclass(frozen=True, eq=False)
class ForcedFamily:
    """A family of orbits at one frequency.

    `contact.forced.ForcedStructure` is the record of trajectories. Its motion without impacts may leave out resonant
    modes, and it has the cells of a forcing period and the structure at rest on a stop. Orbits need neither; they need
    the steady motion of all modes, which are damped, and the response to an impulse in every span.
    """

    family: OrbitFamily
    """The structure and the pattern of impacts."""
    omega: float
    """Angular frequency of the forces."""
    steady: Complexes
    """(H, N + 1) Amplitudes of the steady motion by harmonic: displacements, then the contact."""
    steady_by_omega: Complexes
    """(H,) Derivatives of the contact's amplitudes with respect to omega."""
    sums: PeriodicSums
    """The response to unit impulses, one per span."""

    @property
    def span(self) -> float:
        """The time after which the impacts repeat, or repeat on the opposite stops."""
        return self.family.pattern.spacing(self.omega)

    @property
    def steady_size(self) -> float:
        """A bound of the steady motion of the contact."""
        return float(sum(abs(amplitude) for amplitude in self.steady[:, -1]))

    def problem(self, length: float) -> OrbitProblem:
        """Return the equations of the orbits, with `length` the unit of length."""
        family, blocks, sums = self.family, self.family.response, self.sums
        return OrbitProblem(
            decay=blocks.decay,
            discriminant=blocks.discriminant,
            frequency_squared=blocks.frequency_squared,
            frequency=np.sqrt(blocks.frequency_squared),
            unit_impulse=blocks.unit_impulse,
            periodic_impulse=sums.after,
            doubled_impulse=sums.doubled_after,
            periodic_impulse_by_span=sums.after_by_span,
            orders=family.orders,
            steady=real_and_imaginary(self.steady[:, -1] / length),
            steady_by_omega=real_and_imaginary(np.array([slope / length for slope in self.steady_by_omega.tolist()])),
            steady_unit=1.0,
            omega=self.omega,
            length=float(length),
            turn=family.turn,
            sign=family.sign,
        )

    def unseen_multipliers(self) -> Complexes:
        """Return the multipliers over a span of the modes that contact does not see, or does not excite."""
        family, unseen = self.family, ~self.family.response.seen
        decay, square = family.model.decay[unseen], family.model.frequency_squared[unseen]
        root = np.sqrt((decay * decay - square).astype(np.complex128))
        exponents = np.concatenate([-decay + root, -decay - root])
        return np.asarray(family.sign * np.exp(exponents * self.span))
