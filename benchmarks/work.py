"""The work that every tool is given: which oscillator, which lanes, how long, and from where.

The reference work is the default oscillator at omega = 0.29, clearance 1.60, from rest, for 200 forcing periods.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grazemap_core.model.oscillator import Oscillator

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

OMEGA = 0.29
CLEARANCE = 1.60
PERIODS = 200
LANE_STEP = 5e-4
"""Difference of clearance between neighbouring lanes: all settle to the same motion, none hits with its neighbour."""
LANE_CYCLE = 128
"""After so many lanes the clearances begin again, so that any number of lanes has the same motion throughout."""

SIZE_OMEGA = 0.45
IMPACTING = 0.7
FREE = 10.0
"""Chains of 1 to 8 masses hit about four times per period at this frequency and relative clearance, and none chatters;
at omega = 0.29 mass 1 of the longer ones hardly moves in the steady motion and chatters in the transient. With the
other clearance there are no impacts."""

MAP_OMEGA = (0.26, 0.32)
MAP_CLEARANCE = (1.2, 2.1)


@dataclass(frozen=True, eq=False)
class Work:
    """Trajectories from rest, forcing phase 0, one per clearance.

    Attributes
    ----------
    clearances : (lanes,)
    periods : int
        Forcing periods of every lane.
    """

    oscillator: Oscillator
    omega: float
    clearances: Floats
    periods: int

    @property
    def lane_periods(self) -> int:
        """Forcing periods of all lanes together."""
        return len(self.clearances) * self.periods


@dataclass(frozen=True, eq=False)
class Start:
    """A state at t = 0 on a steady motion in which mass 1 is ``amplitude sin(omega t)``.

    Attributes
    ----------
    displacement, velocity : (N,)
    phase : float
        Forcing phase at t = 0.
    """

    omega: float
    amplitude: float
    displacement: Floats
    velocity: Floats
    phase: float


def chain(masses: int) -> Oscillator:
    """Return the default oscillator with its middle mass repeated: three masses are the paper's."""
    others = masses - 1
    return Oscillator.create(
        [1.0] + [10.0] * others, [1.0] + [5.0] * others, 0.05, [1.0] + [0.0] * others, restitution=0.8
    )


def reference_work(lanes: int, periods: int = PERIODS, alike: bool = False) -> Work:
    """Return the reference work on so many lanes; lane 0 is the reference trajectory itself, and all are if `alike`."""
    steps = np.zeros(lanes) if alike else (np.arange(lanes) % LANE_CYCLE).astype(np.float64)
    return Work(chain(3), OMEGA, np.asarray(CLEARANCE + LANE_STEP * steps), periods)


def work_of_size(masses: int, relative_clearance: float, lanes: int, periods: int = PERIODS) -> Work:
    """Return work on a chain of so many masses; the clearance is relative to the amplitude of the steady motion."""
    oscillator = chain(masses)
    clearance = relative_clearance * abs(steady_motion(oscillator, SIZE_OMEGA)[0])
    steps = (np.arange(lanes) % LANE_CYCLE).astype(np.float64)
    return Work(oscillator, SIZE_OMEGA, np.asarray(clearance * (1.0 + LANE_STEP * steps)), periods)


def steady_motion(oscillator: Oscillator, omega: float) -> NDArray[np.complex128]:
    """Return the complex amplitudes of the motion without stops, shape (N,), solved from M, C and K."""
    stiffness = oscillator.stiffness_matrix - omega**2 * oscillator.mass_matrix
    solved = np.linalg.solve(stiffness + 1j * omega * oscillator.damping_matrix, oscillator.forcing.astype(complex))
    return np.asarray(solved, dtype=np.complex128)


def start_on_steady_motion(oscillator: Oscillator, omega: float) -> Start:
    """Return the start in the middle, mass 1 moving toward the right stop, on the steady motion."""
    response = steady_motion(oscillator, omega)
    phase = -float(np.angle(response[0]))
    turned = response * np.exp(1j * phase)
    return Start(omega, float(abs(response[0])), turned.imag.copy(), omega * turned.real, phase)
