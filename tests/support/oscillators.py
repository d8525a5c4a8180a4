"""The oscillators that many tests have in common."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator, Variants

DEFAULT = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.8)
"""The chain of three masses that clients have unless they describe another one."""


def one_mass(damping: float, restitution: float) -> Oscillator:
    """Return x'' + damping x' + x = cos(omega t) with a stop on the right."""
    unit = np.ones((1, 1))
    drive = [force(1, np.array([1.0]), np.array([0.5 * math.pi]))]
    return Oscillator.of_structure(Matrices.create(unit, unit, damping * unit), [1.0], drive, restitution)


COCO = one_mass(0.1, 0.8)
"""The impact oscillator of Recipes for Continuation and of the printed figures."""


def varied(values: Mapping[str, float]) -> Oscillator:
    """Return the default chain with a factor of its damping, or another first mass."""
    masses, damping = [values.get("masses[1]", 1.0), 10.0, 10.0], 0.05 * values.get("damping", 1.0)
    return Oscillator.create(masses, DEFAULT.stiffnesses, damping, [1.0, 0.0, 0.0], 0.8)


VARYING = replace(DEFAULT, variants=Variants({"damping": 1.0, "masses[1]": 1.0}, varied))
"""The default chain, whose damping and first mass may vary."""


def biased(harmonics: bool = False) -> Oscillator:
    """Return the default chain with a bias and two restitutions, whose damping may vary, with a second harmonic too."""
    drive = [force(1, np.array([1.0, 0.0, 0.0]))]
    drive += [force(2, np.array([0.1, 0.0, 0.05]))] if harmonics else []
    made = Oscillator.of_structure(DEFAULT.structure, [1.0, 0.0, 0.0], drive, 0.8, [0.02, 0.0, 0.01], 0.7)
    damped = Variants({"damping": 1.0}, lambda values: replace(made, structure=varied(values).structure))
    return replace(made, variants=damped)


def first_order(oscillator: Oscillator) -> Floats:
    """Return the matrix (2N, 2N) of the free motion of a chain as a system of first order, (x, v)' = A (x, v)."""
    zero, unit, mass = np.zeros((oscillator.size,) * 2), np.eye(oscillator.size), oscillator.masses[:, None]
    return np.block([[zero, unit], [-oscillator.stiffness_matrix / mass, -oscillator.damping_matrix / mass]])
