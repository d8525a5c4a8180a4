"""Families of periodic motions with impacts: a chain, a number of forcing periods, and whether they are symmetric.

A family gives the equations of its orbits at every frequency, in the form that the kernels take (theory, "Any impacting
orbit").
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from grazemap_core.arrays import Complexes
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.one_impact_family import Pattern, before_impulse
from grazemap_core.model.harmonic_response import require_damped, require_forced, steady_response
from grazemap_core.model.impulse_response import ImpulseResponse, impulse_response
from grazemap_core.model.modal import ModalModel, modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.kernels.equations import OrbitProblem


@dataclass(frozen=True, eq=False)
class OrbitFamily:
    """All motions of an oscillator that repeat after n forcing periods, or are mirrored after half of them.

    Attributes
    ----------
    oscillator : Oscillator
    pattern : Pattern
    model : ModalModel
    response : ImpulseResponse
    """

    oscillator: Oscillator
    pattern: Pattern
    model: ModalModel
    response: ImpulseResponse

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
        """Return the steady motion's amplitudes, complex (N,)."""
        amplitudes = steady_response(self.oscillator, [omega])[0]
        if not (np.isfinite(amplitudes[0]) and abs(amplitudes[0]) > 0.0):
            raise ParameterError("omega", "is a frequency at which the amplitude of mass 1 overflows or underflows")
        return np.asarray(amplitudes)

    def problem(self, omega: float, length: float, steady: Complexes) -> OrbitProblem:
        """Return the equations at one frequency, with `length` the unit of length."""
        blocks = self.response
        span = self.pattern.spacing(omega)
        unit_impulse = np.stack([blocks.value, blocks.slope], axis=1)
        kinds = self.pattern.kinds
        periodic, doubled = (before_impulse(kind, blocks, unit_impulse, span) + unit_impulse for kind in kinds)
        periodic_impulse_by_span = span * before_impulse(kinds[0], blocks, periodic, span)
        slope = self._slope(omega, steady) / length
        steady_table = steady[0] / length
        return OrbitProblem(
            decay=blocks.decay,
            discriminant=blocks.discriminant,
            frequency_squared=blocks.frequency_squared,
            frequency=np.sqrt(blocks.frequency_squared),
            unit_impulse=unit_impulse,
            periodic_impulse=periodic,
            doubled_impulse=doubled,
            periodic_impulse_by_span=periodic_impulse_by_span,
            steady_real=float(steady_table.real),
            steady_imag=float(steady_table.imag),
            steady_real_by_omega=float(slope.real),
            steady_imag_by_omega=float(slope.imag),
            omega=float(omega),
            length=float(length),
            restitution=self.oscillator.restitution,
            rebound=1.0 + self.oscillator.restitution,
            turn=self.turn,
            sign=-1.0 if self.pattern.symmetric else 1.0,
        )

    def _slope(self, omega: float, steady: Complexes) -> complex:
        """Return the derivative of mass 1's steady amplitude with respect to the frequency."""
        masses, damping = self.oscillator.mass_matrix, self.oscillator.damping_matrix
        stiffness = self.oscillator.stiffness_matrix - omega * omega * masses + 1j * omega * damping
        return complex(np.linalg.solve(stiffness, (2.0 * omega * masses - 1j * damping) @ steady)[0])
