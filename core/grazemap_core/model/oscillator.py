"""The mechanical system: a linear structure, its forces, its contact coordinate and the impact law.

Parameters are validated and stored as arrays. The core never rescales them: its tolerances are relative, so SI and
nondimensional descriptions of a system go through the same code and agree to round-off.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.model.chain import Chain
from grazemap_core.model.drive import Harmonic, force, harmonics
from grazemap_core.model.structure import Structure
from grazemap_core.records import dataclass
from grazemap_core.tolerances import LARGEST_NUMBER, SMALLEST_NUMBER

UNITS = ("nondimensional", "SI")


@dataclass(frozen=True, eq=False)
class Variants:
    """The parameters of the structure of an oscillator that may vary."""

    values: Mapping[str, float]
    """Their names and values."""
    create: Callable[[Mapping[str, float]], Oscillator]
    """Returns the oscillator with other values of all of them."""


@dataclass(frozen=True, eq=False)
class Oscillator:
    """A linear structure that is driven, and whose contact coordinate ``q = h^T x`` moves between stops.

    ``M x'' + C x' + K x = forces + bias`` while ``-c_L < q < c_R``, and ``q' -> -restitution q'`` at a stop (theory,
    "Any linear structure"). Use `create` for a chain of masses, `of_structure` for others; both validate parameters.
    """

    structure: Structure
    """Masses, damping and stiffness."""
    contact: Floats
    """(N,) The contact row h."""
    drive: tuple[Harmonic, ...]
    """The harmonic forces, by increasing order."""
    restitution: float
    """R in [0, 1], of the right stop, or of both."""
    bias: Floats
    """(N,) Static forces."""
    units: str = "nondimensional"
    """Either "nondimensional" or "SI": what the dampings of links were, whose decimals stand in certificates."""
    restitution_left: float | None = None
    """R of the left stop, where it is another one."""
    variants: Variants | None = None
    """The parameters of the structure that may vary."""

    @classmethod
    def create(
        cls,
        masses: Sequence[float] | Floats,
        stiffnesses: Sequence[float] | Floats,
        damping: float | Sequence[float] | Floats,
        forcing: Sequence[float] | Floats,
        restitution: float,
        units: str = "nondimensional",
    ) -> Oscillator:
        """Return a chain of N masses whose first one hits the stops, with one harmonic force, equation (3).

        Link i joins mass i to mass i + 1, the last one to ground.

        Parameters
        ----------
        masses, stiffnesses : N numbers each, > 0
            kg and N/m in SI.
        damping : number >= 0, or N numbers >= 0
            One number is gamma, ``C = 2 gamma K`` (seconds in SI). A list holds zeta_i, link i having the coefficient
            ``2 zeta_i`` (nondimensional), or the coefficients c_i themselves (SI, N s/m).
        forcing : N numbers
            Amplitudes; N in SI.
        restitution : number in [0, 1]
        units : {"nondimensional", "SI"}

        Raises
        ------
        ParameterError
            A number is out of its range or not finite, or the lists differ in length.
        """
        if units not in UNITS:
            raise ParameterError("units", f"must be one of {', '.join(UNITS)}")
        mass = _list("masses", masses, count=None)
        count = len(mass)
        stiffness = _list("stiffnesses", stiffnesses, count)
        amplitudes = _list("forcing", forcing, count)
        for name, values in (("masses", mass), ("stiffnesses", stiffness)):
            if not np.all(values > 0.0):
                raise ParameterError(name, "every number must be greater than 0")
        _check_restitution(restitution)

        gamma: float | None = None
        if np.ndim(damping) == 0:
            gamma = float(damping)  # type: ignore[arg-type]
            if not (gamma == 0.0 or SMALLEST_NUMBER <= gamma <= LARGEST_NUMBER):
                raise ParameterError("damping", f"must be 0 or between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g}")
            links = 2.0 * gamma * stiffness
        else:
            numbers = _list("damping", damping, count)  # type: ignore[arg-type]
            if not np.all(numbers >= 0.0):
                raise ParameterError("damping", "every number must be 0 or greater")
            links = numbers if units == "SI" else 2.0 * numbers
        contact = np.zeros(count)
        contact[0] = 1.0
        chain = Chain(mass, stiffness, links, gamma)
        return cls(chain, contact, harmonics([force(1, amplitudes)]), float(restitution), np.zeros(count), units)

    @classmethod
    def of_structure(
        cls,
        structure: Structure,
        contact: Sequence[float] | Floats,
        drive: Iterable[Harmonic],
        restitution: float,
        bias: Sequence[float] | Floats | None = None,
        restitution_left: float | None = None,
        units: str = "nondimensional",
    ) -> Oscillator:
        """Return an oscillator of any linear structure and contact row; `units` are those of `create`.

        Raises
        ------
        ParameterError
            A number is out of its range, a list has not N numbers, or the contact row is zero.
        """
        count = structure.size
        row = _list("contact", contact, count)
        if not np.any(row):
            raise ParameterError("contact", "is a row of zeros, so nothing ever touches a stop")
        for number in (restitution, restitution_left):
            if number is not None:
                _check_restitution(number)
        static = np.zeros(count) if bias is None else _list("bias", bias, count)
        left = None if restitution_left is None else float(restitution_left)
        return cls(structure, row, harmonics(drive), float(restitution), static, units, left)

    def with_structure(self, values: Mapping[str, float]) -> Oscillator:
        """Return the oscillator with other values of parameters of its structure; all else is as it was created.

        Raises
        ------
        ParameterError
            A parameter is not one of those that may vary.
        """
        known = {} if self.variants is None else self.variants.values
        for name in values:
            if name not in known:
                raise ParameterError(name, "is not a parameter that may vary here")
        if self.variants is None or all(known[name] == value for name, value in values.items()):
            return self
        wanted = {**known, **values}
        return replace(self.variants.create(wanted), variants=replace(self.variants, values=wanted))

    def restitution_of(self, stop: int) -> float:
        """Return R of the right stop (+1) or of the left one (-1)."""
        return self.restitution if stop > 0 or self.restitution_left is None else self.restitution_left

    @property
    def size(self) -> int:
        """Number of degrees of freedom N."""
        return self.structure.size

    @property
    def chain(self) -> Chain:
        """The structure, if it is a chain of masses. Raises TypeError."""
        if not isinstance(self.structure, Chain):
            raise TypeError("the structure is not a chain")
        return self.structure

    @property
    def masses(self) -> Floats:
        """``m_i > 0`` of a chain, shape (N,)."""
        return self.chain.masses

    @property
    def stiffnesses(self) -> Floats:
        """``k_i > 0`` of a chain, shape (N,)."""
        return self.chain.stiffnesses

    @property
    def link_damping(self) -> Floats:
        """``c_i >= 0`` of a chain, the coefficient of link i in the damping matrix, shape (N,)."""
        return self.chain.link_damping

    @property
    def gamma(self) -> float | None:
        """The coefficient of proportional damping of a chain, ``C = 2 gamma K``, or None."""
        return self.chain.gamma

    @property
    def forcing(self) -> Floats:
        """Amplitudes f of forces ``f sin(omega t)``, shape (N,). Raises TypeError if the drive is another one."""
        if not self.drive:
            return np.zeros(self.size)
        harmonic = self.drive[0]
        if len(self.drive) > 1 or harmonic.order != 1 or np.any(harmonic.rate) or np.any(harmonic.quadratic):
            raise TypeError("the forces are not one harmonic of constant amplitude")
        if np.any(harmonic.constant.imag):
            raise TypeError("the forces differ in phase")
        return np.ascontiguousarray(harmonic.constant.real)

    @cached_property
    def jump(self) -> Floats:
        """The direction ``a = m_c M^-1 h`` of the change of velocity by an impulse along the stop, ``h^T a = 1``."""
        response = self.structure.solve_mass(self.contact)
        return np.asarray(response / (self.contact @ response))

    @cached_property
    def common_divisor(self) -> int:
        """The greatest common divisor p of the orders of the forces, or 1; their period is 2 pi/(p omega)."""
        return math.gcd(*(harmonic.order for harmonic in self.drive)) or 1

    @cached_property
    def is_half_wave_symmetric(self) -> bool:
        """Whether the forces change their sign after half of their period: all orders are odd multiples of p."""
        return all(harmonic.order // self.common_divisor % 2 == 1 for harmonic in self.drive)

    @cached_property
    def at_own_period(self) -> tuple[Oscillator, int]:
        """The oscillator with all orders divided by p, and p: its forces at p omega are these at omega."""
        times = self.common_divisor
        if times == 1:
            return self, 1
        variants = self.variants
        if variants is not None:
            create = variants.create
            variants = replace(variants, create=lambda values: create(values)._over(times))
        return replace(self._over(times), variants=variants), times

    def _over(self, divisor: int) -> Oscillator:
        """Return the oscillator with all orders divided by a common divisor."""
        return replace(self, drive=tuple(replace(harmonic, order=harmonic.order // divisor) for harmonic in self.drive))

    @cached_property
    def forces(self) -> tuple[Harmonic, ...]:
        """The harmonic forces, or one of the order 1 that is zero."""
        return self.drive or (force(1, np.zeros(self.size)),)

    def with_contact(self, values: Floats, place: float) -> Floats:
        """Return displacements, or velocities, (N,), moved in the direction of the jump so that ``h^T x = place``.

        Where the contact is a single displacement, it alone is set, exactly.
        """
        (named,) = np.nonzero(self.contact)
        if len(named) > 1:
            return values + self.jump * (place - math.fsum(self.contact * values))
        moved = values.copy()
        moved[named] = place / self.contact[named]
        return moved

    def between(self, displacement: Floats, clearances: tuple[float, float]) -> Floats:
        """Return displacements (N,) with the contact moved onto the stop, right or left, that it is beyond."""
        place, (right, left) = math.fsum(self.contact * displacement), clearances
        inside = min(max(place, -left), right)
        return displacement if inside == place else self.with_contact(displacement, inside)

    @property
    def effective_mass(self) -> float:
        """``m_c = 1/(h^T M^-1 h)``: the mass that an impulse along the stop meets."""
        return self.structure.effective_mass(self.contact)

    @property
    def mass_matrix(self) -> Floats:
        """M, shape (N, N)."""
        return self.structure.mass_matrix

    @property
    def stiffness_matrix(self) -> Floats:
        """K, shape (N, N)."""
        return self.structure.stiffness_matrix

    @property
    def damping_matrix(self) -> Floats:
        """C, shape (N, N)."""
        return self.structure.damping_matrix


def _check_restitution(restitution: float) -> None:
    if not (math.isfinite(restitution) and 0.0 <= restitution <= 1.0):
        raise ParameterError("restitution", "must lie between 0 and 1")


def _list(name: str, values: Sequence[float] | Floats, count: int | None) -> Floats:
    """Return the numbers as a new array of floats of shape (N,), or raise ParameterError."""
    array = np.array(values, dtype=np.float64)
    if array.ndim != 1 or array.size == 0:
        raise ParameterError(name, "must be a list of at least one number")
    if count is not None and array.size != count:
        raise ParameterError(name, f"has {array.size} numbers; the structure has {count} degrees of freedom")
    if not np.all(np.isfinite(array)):
        raise ParameterError(name, "every number must be finite")
    size = np.abs(array[array != 0.0])
    if np.any((size < SMALLEST_NUMBER) | (size > LARGEST_NUMBER)):
        raise ParameterError(
            name, f"every number must be 0 or between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g} in size"
        )
    # writable, because numba compiles every kernel a second time for read-only arrays
    return array
