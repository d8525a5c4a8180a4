"""Compiling every kernel once, so that processes forked afterwards inherit machine code and never compile."""

from __future__ import annotations

import time

import numpy as np

from grazemap_core.codim2 import codimension_two_points
from grazemap_core.grazing import grazing_curve
from grazemap_core.oscillator import Oscillator
from grazemap_core.trajectory import trajectory
from grazemap_core.unfolding import unfolding_map_tile


def warm_up() -> float:
    """Run every public computation on a small case of each kind of damping. Returns the seconds it took."""
    began = time.perf_counter()
    omega = np.array([0.28, 0.29])
    for damping in (0.05, [0.05, 0.05, 0.05]):
        oscillator = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], damping, [1.0, 0.0, 0.0], 0.8)
        grazing_curve(oscillator, omega, max_order=2)
        codimension_two_points(oscillator, 0.25, 0.35, max_order=2, max_multiple=1)
        trajectory(oscillator, 0.29, 1.6, periods=2, samples_per_period=4).at(omega)
        unfolding_map_tile(oscillator, omega, np.array([1.6]), max_periods=4, max_period=2)
    return time.perf_counter() - began
