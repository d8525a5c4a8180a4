"""The impact core as the benchmarks call it: everything that depends on which of its kernels is used stands here.

The functions take the numbers of a `Work` or a `Start` and return arrays. Nothing is timed here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from benchmarks.ensemble import Trajectories, first_impacts
from benchmarks.work import Floats, Integers, Start
from grazemap_core.codes import RESOLVED
from grazemap_core.contact.forced import forced_structures
from grazemap_core.contact.trajectory_models import trajectory_models
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.kernels.lane_tables import LANES
from grazemap_core.maps.map_settings import RunSettings
from grazemap_core.maps.planes import Plane, PlaneRunner
from grazemap_core.maps.tolerances import LANE_DEGREE
from grazemap_core.model.oscillator import Oscillator

KERNEL = "lockstep"
"""Which of the core's kernels runs; goes into the result."""

DEGREE = LANE_DEGREE
"""Degree of the local series in which a contact is solved for."""

PIXEL_LANES = LANES
"""Copies of one pixel that are run together to time it: enough to fill the kernel and to hide the set-up."""

MOST_IMPACTS = 4000
"""Impacts of one trajectory that are asked for."""

LONGEST_PERIOD = 32
"""Longest motion that is looked for when a pixel is classified."""


UNNAMED = -1


class Classified(NamedTuple):
    """What became of the pixels of a map; every array has the shape (clearances, omegas).

    Attributes
    ----------
    motion : int
        A number for the name of the motion; UNNAMED where it was not recognised.
    halves, impacts : int
        Half periods run, and impacts followed one by one.
    """

    motion: Integers
    halves: Integers
    impacts: Integers


def cells_per_period(oscillator: Oscillator, omega: float) -> int:
    """Return the number of cells that the core cuts a forcing period into."""
    return forced_structures(trajectory_models(oscillator), np.array([omega]))[0].cells


def at_rest(oscillator: Oscillator, omega: float, clearances: Floats) -> Trajectories:
    """Return trajectories from rest, made ready as a kernel or an integrator is: what runs is what is timed."""
    return Trajectories(oscillator, omega, clearances, first=0)


def impact_times(oscillator: Oscillator, omega: float, clearance: float, periods: int) -> Floats:
    """Return the times of all impacts within so many forcing periods, from rest."""
    ensemble = first_impacts(oscillator, omega, np.array([clearance]), periods, first=MOST_IMPACTS)
    times: Floats = ensemble.half[0] * (np.pi / omega) + ensemble.time[0]
    return times[: ensemble.impacts[0]]


def first_contacts(oscillator: Oscillator, start: Start, clearances: Floats) -> Floats:
    """Return the time of the first contact within one forcing period, NaN if there is none, shape (clearances,)."""
    ensemble = first_impacts(oscillator, start.omega, clearances, 1, 1, start.displacement, start.velocity, start.phase)
    times: Floats = np.where(ensemble.half < 0, np.nan, ensemble.half * (np.pi / start.omega) + ensemble.time)[:, 0]
    return times


def map_of_fixed_length(oscillator: Oscillator, omegas: Floats, clearances: Floats, periods: int) -> Classified:
    """Run every pixel of a grid for so many forcing periods, whatever it does, then classify it."""
    return _map(oscillator, omegas, clearances, periods, early=False, linearised=False)


def map_as_preview(oscillator: Oscillator, omegas: Floats, clearances: Floats, periods: int) -> Classified:
    """Compute a preview as the service does: periodic motions, verified."""
    return _map(oscillator, omegas, clearances, periods, early=True, linearised=False)


def map_as_served(oscillator: Oscillator, omegas: Floats, clearances: Floats, periods: int) -> Classified:
    """Compute a map as the service does: motions verified, with multipliers and Lyapunov exponents."""
    return _map(oscillator, omegas, clearances, periods, early=True, linearised=True)


def _map(
    oscillator: Oscillator,
    omegas: Floats,
    clearances: Floats,
    periods: int,
    early: bool,
    linearised: bool,
) -> Classified:
    task = RunSettings(periods, LONGEST_PERIOD, early, linearised)
    codes, _ = PlaneRunner(Plane.of(oscillator, omegas, clearances), task).grid()
    codes = codes[..., 0]
    name = codes[[lane_state.PERIOD, lane_state.IMPACTS_RIGHT, lane_state.IMPACTS_LEFT, lane_state.SYMMETRIC]]
    number = np.ravel_multi_index(tuple(name + 2), (1 << 10, 1 << 20, 1 << 20, 4))
    motion = np.where(codes[lane_state.REASON] == RESOLVED, number, UNNAMED)
    return Classified(motion, codes[lane_state.HALVES_RUN], codes[lane_state.IMPACTS])
