"""The mechanical system: a chain of masses, its links, its forcing and the impact law of its first mass.

Parameters are validated and stored as arrays. The core never rescales them: its tolerances are relative, so SI and
nondimensional descriptions of a system go through the same code and agree to round-off.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.model.chain import Chain
from grazemap_core.tolerances import LARGEST_NUMBER, SMALLEST_NUMBER

UNITS = ("nondimensional", "SI")


@dataclass(frozen=True, eq=False)
class Oscillator:
    """A chain of N masses: ``M x'' + C x' + K x = f sin(omega t + tau)`` while ``|x1| < clearance``, equation (3).

    Link i joins mass i to mass i + 1, the last one to ground. At a stop ``v1 -> -restitution v1``. Use
    `create`, which validates the parameters.

    Attributes
    ----------
    masses, stiffnesses : ndarray of shape (N,)
        ``m_i > 0`` and ``k_i > 0``.
    link_damping : ndarray of shape (N,)
        ``c_i >= 0``, the coefficient of link i in the damping matrix.
    gamma : float or None
        The coefficient of proportional damping, ``C = 2 gamma K``; None when the links were given one by one.
    forcing : ndarray of shape (N,)
        Amplitudes f.
    restitution : float
        R in [0, 1].
    units : {"nondimensional", "SI"}
        Used by `create` only; the stored numbers do not depend on it.
    """

    masses: Floats
    stiffnesses: Floats
    link_damping: Floats
    gamma: float | None
    forcing: Floats
    restitution: float
    units: str = "nondimensional"

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
        """Return an oscillator with validated parameters.

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
        force = _list("forcing", forcing, count)
        for name, values in (("masses", mass), ("stiffnesses", stiffness)):
            if not np.all(values > 0.0):
                raise ParameterError(name, "every number must be greater than 0")
        if not (math.isfinite(restitution) and 0.0 <= restitution <= 1.0):
            raise ParameterError("restitution", "must lie between 0 and 1")

        gamma: float | None = None
        if np.ndim(damping) == 0:
            gamma = float(damping)  # type: ignore[arg-type]
            if not (gamma == 0.0 or SMALLEST_NUMBER <= gamma <= LARGEST_NUMBER):
                raise ParameterError("damping", f"must be 0 or between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g}")
            links = 2.0 * gamma * stiffness
        else:
            given = _list("damping", damping, count)  # type: ignore[arg-type]
            if not np.all(given >= 0.0):
                raise ParameterError("damping", "every number must be 0 or greater")
            links = given if units == "SI" else 2.0 * given
        return cls(mass, stiffness, links, gamma, force, float(restitution), units)

    @property
    def size(self) -> int:
        """Number of masses N."""
        return len(self.masses)

    @cached_property
    def chain(self) -> Chain:
        """The whole chain, its first mass free."""
        return Chain(self.masses, self.stiffnesses, self.link_damping, self.gamma)

    @cached_property
    def held_chain(self) -> Chain | None:
        """The chain of masses 2 .. N while mass 1 rests on a stop, with link 1 to a wall; None for one mass."""
        if self.size == 1:
            return None
        return Chain(
            self.masses[1:].copy(),
            self.stiffnesses[1:].copy(),
            self.link_damping[1:].copy(),
            self.gamma,
            float(self.stiffnesses[0]),
            float(self.link_damping[0]),
        )

    @property
    def mass_matrix(self) -> Floats:
        """M, shape (N, N), diagonal."""
        return np.diag(self.masses)

    @property
    def stiffness_matrix(self) -> Floats:
        """K, shape (N, N), symmetric, tridiagonal and positive definite."""
        return _chain_matrix(self.stiffnesses)

    @property
    def damping_matrix(self) -> Floats:
        """C, shape (N, N), built from the links as K is."""
        return _chain_matrix(self.link_damping)


def _list(name: str, values: Sequence[float] | Floats, count: int | None) -> Floats:
    """Return the numbers as a new array of floats of shape (N,), or raise ParameterError."""
    array = np.array(values, dtype=np.float64)
    if array.ndim != 1 or array.size == 0:
        raise ParameterError(name, "must be a list of at least one number")
    if count is not None and array.size != count:
        raise ParameterError(name, f"has {array.size} numbers and masses has {count}")
    if not np.all(np.isfinite(array)):
        raise ParameterError(name, "every number must be finite")
    size = np.abs(array[array != 0.0])
    if np.any((size < SMALLEST_NUMBER) | (size > LARGEST_NUMBER)):
        raise ParameterError(
            name, f"every number must be 0 or between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g} in size"
        )
    # writable, because numba compiles every kernel a second time for read-only arrays
    return array


def _chain_matrix(links: Floats) -> Floats:
    """Return the tridiagonal matrix of a chain whose last link goes to ground."""
    diagonal = links + np.concatenate(([0.0], links[:-1]))
    return np.diag(diagonal) - np.diag(links[:-1], 1) - np.diag(links[:-1], -1)
