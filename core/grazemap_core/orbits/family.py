"""Families of periodic motions with impacts: a structure, a number of forcing periods, and whether they are symmetric.

A family gives the equations of its orbits at every frequency, in the form that the kernels take (theory, "Any impacting
orbit").
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.checks import checked_omega
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.one_impact_family import Pattern, before_impulse
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

    def steady(self, omega: float) -> Complexes:
        """Return the steady motion's amplitudes of each harmonic, complex (H, N + 1): displacements, then the contact.

        Raises
        ------
        ParameterError, SteadyMotionError
            As `steady_at`.
        """
        steady: Complexes = self.steady_at(np.array([omega]))[0]
        return steady

    def steady_at(self, omega: Floats) -> Complexes:
        """Return `steady` at frequencies (m,), complex (m, H, N + 1).

        Raises
        ------
        ParameterError
            A frequency is out of range, or the amplitude of the contact overflows or underflows there.
        SteadyMotionError
            The damping is too small to resolve a resonance.
        """
        values = checked_omega(omega)
        parts = [harmonic_amplitudes(self.oscillator, values, harmonic) for harmonic in self.oscillator.forces]
        steady = np.stack(parts, axis=1)
        if not all(0.0 < steady_size(amplitudes) < math.inf for amplitudes in steady):
            raise ParameterError(
                "omega", "is a frequency at which the amplitude of the contact overflows or underflows"
            )
        return steady

    def problem(self, omega: float, length: float, steady: Complexes) -> OrbitProblem:
        """Return the equations at one frequency, with `length` the unit of length."""
        blocks = self.response
        span = self.pattern.spacing(omega)
        unit_impulse = np.stack([blocks.value, blocks.slope], axis=1)
        kinds = self.pattern.kinds
        periodic, doubled = (before_impulse(kind, blocks, unit_impulse, span) + unit_impulse for kind in kinds)
        periodic_impulse_by_span = span * before_impulse(kinds[0], blocks, periodic, span)
        at, forces = np.array([omega]), self.oscillator.forces
        slopes = [
            complex(response_slope(self.oscillator, at, harmonic, steady[h : h + 1, :-1])[0]) / length
            for h, harmonic in enumerate(forces)
        ]
        return OrbitProblem(
            decay=blocks.decay,
            discriminant=blocks.discriminant,
            frequency_squared=blocks.frequency_squared,
            frequency=np.sqrt(blocks.frequency_squared),
            unit_impulse=unit_impulse,
            periodic_impulse=periodic,
            doubled_impulse=doubled,
            periodic_impulse_by_span=periodic_impulse_by_span,
            orders=np.array([float(harmonic.order) for harmonic in self.oscillator.forces]),
            steady=np.array([[amplitude.real, amplitude.imag] for amplitude in steady[:, -1] / length]),
            steady_by_omega=np.array([[slope.real, slope.imag] for slope in slopes]),
            steady_unit=1.0,
            omega=float(omega),
            length=float(length),
            turn=self.turn,
            sign=-1.0 if self.pattern.symmetric else 1.0,
        )

    @cached_property
    def sees_all(self) -> bool:
        """Whether contact sees every mode, and excites it."""
        return bool(np.all(self.response.seen))

    def unseen_multipliers(self, omega: float) -> Complexes:
        """Return the multipliers over a span of the modes that contact does not see, or does not excite."""
        unseen = ~self.response.seen
        decay, square = self.model.decay[unseen], self.model.frequency_squared[unseen]
        root = np.sqrt((decay * decay - square).astype(np.complex128))
        sign = -1.0 if self.pattern.symmetric else 1.0
        exponents = np.concatenate([-decay + root, -decay - root])
        return np.asarray(sign * np.exp(exponents * self.pattern.spacing(omega)))


def forced(problem: OrbitProblem, factor: float) -> OrbitProblem:
    """Return the equations under forces that are larger by a factor."""
    if factor == 1.0:
        return problem
    return problem._replace(steady=factor * problem.steady, steady_by_omega=factor * problem.steady_by_omega)


def steady_size(steady: Complexes) -> float:
    """Return a bound of the steady motion of the contact, from its amplitudes (H, N + 1)."""
    return float(sum(abs(amplitude) for amplitude in steady[:, -1]))
