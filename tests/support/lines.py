"""Lines of one parameter for bifurcation diagrams, and columns of maps with any clearances of each stop."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grazemap_core.arrays import Floats
from grazemap_core.contact.stops import Clearance
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.maps.map_settings import DEFAULT_SETTINGS, AtRest, RunSettings
from grazemap_core.maps.planes import Axis, ParameterLine
from grazemap_core.maps.runner import Runner
from grazemap_core.maps.unfolding import named_arrays
from grazemap_core.model.oscillator import Oscillator


def line(oscillator: Oscillator, vary: str, values: ArrayLike, fixed: Clearance) -> ParameterLine:
    """Return the values of omega, or of the clearance of both stops; the other one is fixed."""
    omega, clearance = (1.0, fixed) if vary == "omega" else (fixed, 1.0)
    assert isinstance(omega, float)
    at = ParameterPoint.of(oscillator, omega, clearance)
    return ParameterLine(oscillator, at, Axis(vary, np.array(values, dtype=np.float64)))


def column(oscillator: Oscillator, omega: float, clearances: Floats, max_periods: int) -> dict[str, NDArray[Any]]:
    """Return the map (n, 1) at one frequency, of clearances (n,) of both stops or (n, 2) of each, side by side."""
    task = RunSettings(max_periods, 32)
    runner = Runner(oscillator, task)
    results = runner.run(runner.at(omega), clearances, AtRest())
    codes, figures = (np.moveaxis(part, 2, 0)[:, :, None] for part in results)
    return named_arrays(codes, figures, DEFAULT_SETTINGS, mirrors=True)
