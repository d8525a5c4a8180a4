"""The static equilibrium of a structure under its bias, and the gaps of the stops from it."""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.model.chain import Chain
from grazemap_core.model.kernels.steady_response import steady_amplitudes
from grazemap_core.model.matrices import elements_of
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.tolerances import FREE_MODE


def equilibrium(oscillator: Oscillator) -> Floats:
    """Return the displacements x_e with ``K x_e = bias``, shape (N,).

    Where K is singular they are those without a part in the free modes.

    Raises
    ------
    ParameterError
        The bias pushes along a free mode, so there is no equilibrium.
    """
    bias, structure = oscillator.bias, oscillator.structure
    if not np.any(bias):
        return np.zeros(oscillator.size)
    if isinstance(structure, Chain):
        # link i carries the sum of the forces on masses 1 .. i
        elongation = np.cumsum(bias) / structure.stiffnesses
        return np.cumsum(elongation[::-1])[::-1]
    return static_displacements(structure.stiffness_matrix, bias, "bias")


def static_displacements(stiffness: Floats, forces: Floats, name: str) -> Floats:
    """Return the displacements x with ``K x = forces``, shape (N,); `name` is that of the forces in an error.

    Where K is singular they are those without a part in the free modes.

    Raises
    ------
    ParameterError
        The forces push along a free mode, or K is so nearly singular that no solution is resolved.
    """
    if not np.any(forces):
        return np.zeros_like(forces)
    left, singular, right = np.linalg.svd(stiffness)
    free = singular <= FREE_MODE * len(forces) * singular[0]
    if not np.any(free):
        zero, none = np.zeros_like(stiffness), np.zeros_like(forces)
        elements = elements_of(zero, zero, stiffness)
        static, _, exists = steady_amplitudes(elements, np.zeros(1), forces[None].astype(np.complex128), none)
        if not exists[0]:
            raise ParameterError(name, "pushes along a mode that is nearly free, so the equilibrium is unresolved")
        return np.ascontiguousarray(static[0].real)
    if np.max(np.abs(left[:, free].T @ forces)) > FREE_MODE * len(forces) * np.max(np.abs(forces)):
        raise ParameterError(name, "pushes along a free mode, so there is no equilibrium")
    inverse = np.where(free, 0.0, 1.0 / np.where(free, 1.0, singular))
    return np.asarray(right.T @ (inverse * (left.T @ forces)))


def contact_equilibrium(oscillator: Oscillator) -> float:
    """Return q_e, the contact coordinate at the static equilibrium."""
    return float(oscillator.contact @ equilibrium(oscillator))


def effective_gaps(oscillator: Oscillator, right: float | None, left: float | None) -> tuple[float, float]:
    """Return the gaps ``c_R - q_e`` and ``c_L + q_e`` of the stops from the equilibrium; infinite for an absent stop.

    A negative gap is that of a preloaded stop.

    Raises
    ------
    ParameterError
        The equilibrium lies beyond both stops.
    """
    place = contact_equilibrium(oscillator)
    gaps = (np.inf if right is None else right - place, np.inf if left is None else left + place)
    if gaps[0] + gaps[1] <= 0.0:
        raise ParameterError("clearance", "the sum of the two must be greater than 0")
    return gaps
