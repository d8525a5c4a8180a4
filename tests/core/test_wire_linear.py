"""The oscillator between its stops as the client computes it, against the core."""

from __future__ import annotations

import numpy as np
import pytest

from grazemap.wire import Oscillator as Request
from grazemap.wire.linear import steady_amplitude
from grazemap_core.model.harmonic_response import forced_response
from grazemap_core.model.oscillator import Oscillator


@pytest.mark.parametrize("seed", range(6))
def test_the_grazing_curve_is_that_of_the_core(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = int(rng.integers(1, 7))
    masses, stiffnesses = rng.uniform(0.5, 10.0, (2, size)).tolist()
    forcing = rng.uniform(-1.0, 1.0, size).tolist()
    damping = rng.uniform(0.01, 0.2, size).tolist() if seed % 2 else 0.05
    omega = rng.uniform(0.05, 3.0, 20)
    request = Request(masses=masses, stiffnesses=stiffnesses, damping=damping, forcing=forcing)
    core = Oscillator.create(masses, stiffnesses, damping, forcing, 0.8)
    expected = np.abs(forced_response(core, omega)[:, 0])
    np.testing.assert_allclose(steady_amplitude(request, omega), expected, rtol=1e-11)
