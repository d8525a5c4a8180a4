"""What all orbits of a family share: derivatives of the steady motion, near resonances too."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.family import OrbitFamily


@pytest.mark.parametrize("gamma", [0.05, 1e-6, 1e-9])
@pytest.mark.parametrize("detuning", [0.0, 1e-9, 3e-8, 1e-3])
@pytest.mark.parametrize("size", [1, 3])
def test_the_derivative_of_the_steady_motion_over_omega_is_exact_near_a_resonance(
    gamma: float, detuning: float, size: int
) -> None:
    masses, springs = [1.0, 10.0, 10.0][:size], [1.0, 5.0, 5.0][:size]
    oscillator = Oscillator.create(masses, springs, gamma, [1.0, 0.0, 0.0][:size], 0.8)
    squares = np.linalg.eigvals(np.linalg.solve(oscillator.mass_matrix, oscillator.stiffness_matrix))
    omega = float(np.sqrt(np.min(squares.real)) * (1.0 + detuning))
    family = OrbitFamily.of(oscillator, 1, False).at(omega)
    length = family.steady_size
    derivative = complex(*family.problem(length).steady_by_omega[0]) * length
    with mpmath.workdps(50):
        matrices = [mpmath.matrix(matrix.tolist()) for matrix in (oscillator.mass_matrix, oscillator.stiffness_matrix)]
        links = [2 * mpmath.mpf(gamma) * mpmath.mpf(k) for k in springs]
        damping = mpmath.zeros(size)
        for i, link in enumerate(links):
            damping[i, i] += link
            if i + 1 < size:
                damping[i + 1, i + 1] += link
                damping[i, i + 1] -= link
                damping[i + 1, i] -= link

        def contact(w):
            dynamic = matrices[1] - w**2 * matrices[0] + mpmath.mpc(0, 1) * w * damping
            return mpmath.lu_solve(dynamic, mpmath.matrix([1] + [0] * (size - 1)))[0]

        exact = complex(mpmath.diff(contact, mpmath.mpf(omega), h=mpmath.mpf(10) ** -25 * gamma))
    assert abs(derivative - exact) < 1e-14 * abs(exact)
