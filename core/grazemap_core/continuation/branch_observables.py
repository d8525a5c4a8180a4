"""Observables along a branch of periodic orbits."""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.continuation.branches import OrbitBranch
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.orbit_observables import OrbitObserver
from grazemap_core.simulation.observables import Observables


@in_own_period
def of_branch(oscillator: Oscillator, branch: OrbitBranch, wanted: Observables) -> Floats:
    """Return the values (m, count) of the wanted observables, each over its orbit's period.

    NaN for orbits that are not admissible.

    Parameters
    ----------
    oscillator : Oscillator
        The oscillator of the branch, where the factors of bias and forces are 1.
    """
    observer, structure = OrbitObserver(oscillator, wanted), ParameterPoint.of(oscillator, 1.0, 1.0).structure
    figures = np.full((len(branch.points), wanted.count), np.nan)
    for i in np.flatnonzero(branch.admissible).tolist():
        impacts = ImpactSequence(branch.period, branch.stops, branch.phases[i], branch.velocities[i], branch.symmetric)
        values = branch.points[i]
        applied = values.applied(oscillator)
        if values.structure != structure:  # an observer has the modes of a structure
            observer, structure = OrbitObserver(applied, wanted), values.structure
        figures[i] = observer.figures(applied, values.omega, values.clearance, impacts)
    return figures
