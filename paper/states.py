"""States (x_1, v_1, ..., x_N, v_N, theta), as the discontinuity mapping has them, and trajectories from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from grazemap import Client, Oscillator
from grazemap.results import DiscontinuityMapping, Trajectory
from grazemap.wire import InitialState

Floats = NDArray[np.float64]
# Further than any motion of the page goes: there mass 1 moves as if there were no stops.
FAR = 10.0
TURN = 2 * np.pi


def initial(state: Floats) -> InitialState:
    """Return a state (x_1, v_1, ..., x_N, v_N, theta) as the start of a trajectory."""
    return InitialState(displacement=state[:-1:2].tolist(), velocity=state[1:-1:2].tolist(), phase=float(state[-1]))


def at(client: Client, oscillator: Oscillator, omega: float, clearance: float, state: Floats, times: Floats) -> Floats:
    """Return the states at increasing times on the trajectory from a state, shape (times, 2N + 1)."""
    path = client.trajectory(
        oscillator, omega=omega, clearance=clearance, initial=initial(state), times=times,
        periods=int(np.ceil(times[-1] * omega / TURN)) or 1, progress=False,
    )  # fmt: skip
    masses = [part for pair in zip(path.displacement, path.velocity, strict=True) for part in pair]
    return np.stack([*masses, state[-1] + omega * path.time], axis=1)


def turn(client: Client, oscillator: Oscillator, omega: float, state: Floats) -> tuple[float, Floats]:
    """Return the time at which mass 1, moving outwards, first turns back where there are no stops, and its state."""
    low, high = 0.0, np.pi / omega
    for _ in range(3):  # each grid is one step of the one before
        times = np.linspace(low, high, 2001)
        velocity = at(client, oscillator, omega, FAR, state, times)[:, 1]
        k = int(np.argmax(velocity <= 0.0))
        low, high = times[k - 1], times[k]
    fraction = velocity[k - 1] / (velocity[k - 1] - velocity[k])
    time = float(low + fraction * (high - low))
    return time, at(client, oscillator, omega, FAR, state, np.array([time]))[0]


def distance(state: Floats, other: Floats, clearance: float, omega: float) -> float:
    """Return the largest difference of two states in units of clearance, omega times clearance, and radians."""
    count = (len(state) - 1) // 2
    scale = np.array([clearance, omega * clearance] * count + [1.0])
    return float(np.max(np.abs(state - other) / scale))


def graze(client: Client, oscillator: Oscillator, omega: float) -> DiscontinuityMapping:
    """Return what the service says about the graze of stop A at a frequency."""
    return client.discontinuity_mapping(oscillator, omega=omega, overshoot=[1e-3], progress=False)


def closest(path: Trajectory) -> float:
    """Return how far mass 1 stays from the stops on the samples of a trajectory."""
    return float(path.meta["request"]["clearance"]) - float(np.max(np.abs(path.displacement[0])))
