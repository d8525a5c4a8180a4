"""The structure while its contact rests on a stop: a constraint, and what is left of the equations of motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.model.chain import Chain
from grazemap_core.model.equilibrium import static_displacements
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.structure import Structure
from grazemap_core.numerics.kernels.double_double import exact, transformed
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class HeldStructure:
    """An oscillator whose contact coordinate ``q = h^T y`` is held (theory, "Any linear structure").

    Displacements from the static equilibrium are ``y = q profile + Z w``, where the n = N - 1 columns of Z have
    ``h^T Z = 0``. The rows w are the displacements of all coordinates but one.
    """

    structure: Structure | None
    """The structure of w: matrices ``Z^T M Z`` and so on. None for one degree of freedom."""
    basis: Floats
    """(N, n) Z."""
    others: Integers
    """(n,) The coordinates that w names."""
    profile: Floats
    """(N,) Displacements at the equilibrium with q = 1."""
    static_stiffness: float
    """``a^T K profile``: the force on the held contact, per unit of q, with a the direction of the jump."""
    stiffness_row: Floats
    """(n,) ``a^T K Z``: force on the held contact by w."""
    damping_row: Floats
    """(n,) ``a^T C Z``: force on the held contact by the velocity of w."""
    viscous_term: float
    """``h^T M^-1 C a``."""


def held_structure(oscillator: Oscillator) -> HeldStructure:
    """Return the structure with its contact held.

    Raises
    ------
    ParameterError
        The stiffness matrix of the constrained structure is singular, and the contact pushes along its free mode.
    """
    contact, structure = oscillator.contact, oscillator.structure
    pivot = int(np.argmax(np.abs(contact)))
    others = np.delete(np.arange(oscillator.size), pivot)
    if isinstance(structure, Chain) and not np.any(contact[1:]):
        return _of_chain(structure, float(contact[0]), others)
    basis = np.eye(oscillator.size)[:, others]
    basis[pivot] = -contact[others] / contact[pivot]
    jump = oscillator.jump
    stiffness, damping = structure.stiffness_matrix, structure.damping_matrix
    stiffness_row = transformed(basis.T, transformed(stiffness.T, exact(jump[:, None]))).rounded[:, 0]
    damping_row = transformed(basis.T, transformed(damping.T, exact(jump[:, None]))).rounded[:, 0]
    profile, constrained = jump, None
    if len(others) > 0:
        mass = _congruent(basis, structure.mass_matrix)
        held_stiffness = _congruent(basis, stiffness)
        if np.array_equal(stiffness, stiffness.T):
            held_stiffness = 0.5 * (held_stiffness + held_stiffness.T)
        constrained = Matrices(0.5 * (mass + mass.T), _congruent(basis, damping), held_stiffness)
        pushed = transformed(basis.T, transformed(stiffness, exact(jump[:, None]))).rounded[:, 0]
        profile = jump - basis @ static_displacements(constrained.stiffness, pushed, "contact")
    return HeldStructure(
        constrained,
        basis,
        others,
        profile,
        float(jump @ transformed(stiffness, exact(profile[:, None])).rounded[:, 0]),
        stiffness_row,
        damping_row,
        float(jump @ damping @ jump) / oscillator.effective_mass,
    )


def _of_chain(chain: Chain, weight: float, others: Integers) -> HeldStructure:
    """Return the chain of masses 2 .. N with link 1 to a wall, for a contact ``q = weight x_1``."""
    count = chain.size
    compliance = 1.0 / chain.stiffnesses
    stiffness_row, damping_row = np.zeros(count - 1), np.zeros(count - 1)
    stiffness_row[:1], damping_row[:1] = -chain.stiffnesses[0] / weight, -chain.link_damping[0] / weight
    return HeldStructure(
        structure=None
        if count == 1
        else replace(
            chain,
            masses=chain.masses[1:].copy(),
            stiffnesses=chain.stiffnesses[1:].copy(),
            link_damping=chain.link_damping[1:].copy(),
            wall_stiffness=float(chain.stiffnesses[0]),
            wall_damping=float(chain.link_damping[0]),
        ),
        basis=np.eye(count)[:, 1:],
        others=others,
        # the springs are in series, so the force is the same in all links
        profile=np.concatenate([[1.0], np.cumsum(compliance[::-1])[::-1][1:] / np.sum(compliance)]) / weight,
        static_stiffness=float(1.0 / np.sum(compliance)) / weight**2,
        stiffness_row=stiffness_row,
        damping_row=damping_row,
        viscous_term=float(chain.link_damping[0] / chain.masses[0]),
    )


def _congruent(basis: Floats, matrix: Floats) -> Floats:
    """Return ``Z^T A Z``, rounded once or twice."""
    return transformed(basis.T, transformed(matrix, exact(basis))).rounded
