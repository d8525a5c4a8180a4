"""What branches of orbits may vary: the forcing frequency, clearances, restitutions, the bias and the forces."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.contact.stops import Clearance, both_clearances, unit_of_stops
from grazemap_core.errors import ParameterError, check_range
from grazemap_core.model.drive import Harmonic
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import NamedTuple
from grazemap_core.tolerances import LARGEST_NUMBER, SMALLEST_NUMBER

Parameter = str
"""One of PARAMETERS, or a parameter of the structure that may vary (`Oscillator.variants`)."""

Structure = tuple[tuple[str, float], ...]
"""Names and values of the parameters of a structure that may vary."""

PARAMETERS: Final = (
    "omega",
    "clearance",
    "clearance_right",
    "clearance_left",
    "restitution",
    "restitution_right",
    "restitution_left",
    "bias",
    "forcing",
)
"""`clearance` and `restitution` are those of both stops, `bias` and `forcing` factors of the oscillator's."""

_OF_ANY_SIGN = ("clearance_right", "clearance_left", "bias")
_KEEP_SYMMETRY = ("omega", "clearance", "restitution", "forcing")
_OF_BOTH = ("clearance", "restitution")
_FIELDS = {name: (f"{name}_right", f"{name}_left") for name in _OF_BOTH}


class ParameterPoint(NamedTuple):
    """The values of all parameters."""

    omega: float
    """Forcing frequency."""
    clearance_right: float
    """Clearance of the right stop from q = 0; infinite for an absent stop."""
    clearance_left: float
    """Clearance of the left stop, likewise."""
    restitution_right: float
    """R of the right stop."""
    restitution_left: float
    """R of the left stop."""
    bias: float = 1.0
    """Factor of the bias of the oscillator."""
    forcing: float = 1.0
    """Factor of the forces of the oscillator."""
    structure: Structure = ()
    """The parameters of the structure that may vary."""

    @classmethod
    def of(cls, oscillator: Oscillator, omega: float, clearance: Clearance) -> ParameterPoint:
        """Return the values of an oscillator at a point, with the factors 1."""
        right, left = both_clearances(clearance)
        both = oscillator.restitution_of(1), oscillator.restitution_of(-1)
        structure = () if oscillator.variants is None else tuple(oscillator.variants.values.items())
        return cls(omega, float(right), float(left), *both, structure=structure)

    @property
    def clearance(self) -> Clearance:
        """Clearance of both stops, or of the right and of the left one, as functions of orbits take it."""
        if self.clearance_right == self.clearance_left:
            return self.clearance_right
        right, left = (None if math.isinf(gap) else gap for gap in (self.clearance_right, self.clearance_left))
        return right, left

    @property
    def restitution(self) -> float:
        """Restitution of both stops, or of the only stop; NaN where they differ."""
        if self.restitution_right == self.restitution_left or math.isinf(self.clearance_left):
            return self.restitution_right
        return self.restitution_left if math.isinf(self.clearance_right) else math.nan

    def value(self, name: Parameter) -> float:
        """Return the value of a parameter.

        Raises
        ------
        ParameterError
            The name stands for both stops, and they differ or one is absent; or for an absent stop; or for no
            parameter.
        """
        if name not in PARAMETERS:
            if name not in dict(self.structure):
                raise ParameterError("parameter", f"{name} is not a parameter that may vary here")
            return dict(self.structure)[name]
        if name in _OF_BOTH:
            right, left = getattr(self, f"{name}_right"), getattr(self, f"{name}_left")
            if right != left:
                raise ParameterError(
                    "parameter", f"{name} stands for both stops, which differ here: {name}_right or {name}_left varies"
                )
            return float(right)
        value = float(getattr(self, name))
        if math.isinf(value):
            raise ParameterError("parameter", f"{name} is that of a stop that is absent")
        return value

    def varied(self, name: Parameter, value: float) -> ParameterPoint:
        """Return the values with one of them changed."""
        if name not in PARAMETERS:
            return self._replace(structure=tuple({**dict(self.structure), name: value}.items()))
        changes: dict[str, Any] = dict.fromkeys(_FIELDS.get(name, (name,)), value)
        return self._replace(**changes)

    def applied(self, oscillator: Oscillator) -> Oscillator:
        """Return the oscillator with these values of its structure and restitutions, its bias and forces by factors."""
        if self == ParameterPoint.of(oscillator, self.omega, self.clearance):
            return oscillator
        oscillator = oscillator.with_structure(dict(self.structure))
        same = self.restitution_right == self.restitution_left
        return replace(
            oscillator,
            restitution=self.restitution_right,
            restitution_left=None if same else self.restitution_left,
            bias=self.bias * oscillator.bias,
            drive=tuple(_scaled(harmonic, self.forcing) for harmonic in oscillator.drive),
        )

    def stops(self, equilibrium: float, odd: bool) -> Stops:
        """Return the stops.

        Parameters
        ----------
        equilibrium : float
            Contact coordinate at the static equilibrium, with the bias of the factor 1.
        odd : bool
            Whether the forces have odd harmonics only.
        """
        place = self.bias * equilibrium
        right, left = self.clearance_right - place, self.clearance_left + place
        both = self.restitution_right, self.restitution_left
        unit = float(unit_of_stops(right, left))
        return Stops(right, left, *both, unit, 0.0, 0.0, odd and right == left and both[0] == both[1])


def domain(parameter: Parameter) -> tuple[float, float]:
    """Return the least and the largest value of a parameter."""
    if parameter.startswith("restitution"):
        return 0.0, 1.0
    if parameter.startswith("damping"):
        return 0.0, LARGEST_NUMBER
    if parameter in _OF_ANY_SIGN:
        return -LARGEST_NUMBER, LARGEST_NUMBER
    return SMALLEST_NUMBER, LARGEST_NUMBER


def check_domain(parameter: Parameter, values: Floats, named: str | None = None) -> None:
    """Raise ParameterError, on the argument `named`, where a value is not within the domain of a parameter."""
    check_range(named or parameter, values, *domain(parameter))


def check_interval(parameter: Parameter, start: float, stop: float, named: str = "start") -> None:
    """Raise ParameterError, on the argument `named`, where an interval of a parameter is not within its domain."""
    if not start < stop:
        raise ParameterError(named, "must be below stop")
    check_domain(parameter, np.array([start, stop]), named)


def keeps_symmetry(oscillator: Oscillator, parameter: Parameter) -> bool:
    """Return whether stops remain symmetric over a parameter if they are."""
    return parameter in _KEEP_SYMMETRY or (parameter not in PARAMETERS and not np.any(oscillator.bias))


class ParameterOrbit:
    """An orbit with the values of all parameters; a base class."""

    values: ParameterPoint
    """The values of all parameters."""

    @property
    def omega(self) -> float:
        """Forcing frequency."""
        return self.values.omega

    @property
    def clearance(self) -> Clearance:
        """Clearance of both stops, or of the right and of the left one."""
        return self.values.clearance

    @property
    def restitution(self) -> float:
        """Restitution of both stops, or of the only stop; NaN where they differ."""
        return self.values.restitution


def symmetric_stops(oscillator: Oscillator, values: ParameterPoint) -> bool:
    """Return whether the mirror image of every motion, half a period later, is a motion."""
    return values.stops(contact_equilibrium(oscillator), oscillator.is_half_wave_symmetric).symmetric


def _scaled(harmonic: Harmonic, factor: float) -> Harmonic:
    parts = (factor * part for part in (harmonic.constant, harmonic.rate, harmonic.quadratic))
    return Harmonic(harmonic.order, *parts)
