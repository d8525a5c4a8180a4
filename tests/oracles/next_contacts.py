"""The next contact of the steady motion after its first impact, by following it."""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.steady_displacements import steady_response


def simulated_contact(oscillator: Oscillator, omega: float, distance: float, max_order: int) -> tuple[int, int]:
    """Half periods from the first impact of the steady motion, at A, to the next, and that one's stop; or zeros."""
    response = steady_response(oscillator, [omega])[0]
    phase = -math.atan2(response[0].imag, response[0].real)  # mass 1 in the middle, on its way to stop A
    turned = response * np.exp(1j * phase)
    clearance = abs(response[0]) * (1.0 - distance)
    half = math.pi / omega
    run = trajectory(
        oscillator, omega, clearance, turned.imag, omega * turned.real, phase, max_order // 2 + 2, times=[]
    )
    impacts = run.impacts
    assert set(impacts.kind.tolist()) <= {"impact"}
    assert impacts.stop[0] == 1
    passed = np.rint((impacts.time - impacts.time[0]) / half).astype(int)
    later = np.flatnonzero((passed > 0) & (passed <= max_order))
    return (int(passed[later[0]]), int(impacts.stop[later[0]])) if later.size else (0, 0)
