"""Observables of periodic orbits from their impacts: the state between impacts is a sum over all earlier ones."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.forced import forced_structures
from grazemap_core.contact.kernels.runs import EVENT_COLUMNS, HALF, TIME
from grazemap_core.contact.stops import Clearance, stops_between
from grazemap_core.contact.trajectory_models import trajectory_models
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import PeriodicOrbit
from grazemap_core.orbits.simulated_orbits import SimulatedOrbit
from grazemap_core.simulation.kernels.observed_motion import observe_rows, write_orbit
from grazemap_core.simulation.observables import Observables, observed_outputs, of_record, whole_steady


class OrbitObserver:
    """Reads quantities off orbits of one structure, at any parameters."""

    def __init__(self, oscillator: Oscillator, wanted: Observables) -> None:
        """Compute the modes. Raises as `trajectory_models`."""
        self._models, self._wanted = trajectory_models(oscillator), wanted

    def figures(self, oscillator: Oscillator, omega: float, clearance: Clearance, impacts: ImpactSequence) -> Floats:
        """Return the figures (count,) of an orbit over its period.

        Parameters
        ----------
        oscillator : Oscillator
            With the same structure and contact; forces, bias and restitutions may differ.
        impacts : ImpactSequence
            Of an orbit, without virtual impacts.
        """
        models, whole = replace(self._models, oscillator=oscillator), impacts.whole
        (structure,) = forced_structures(models, np.array([omega]))
        problem = structure.kernels.free
        stops = stops_between(oscillator, clearance, problem.lasting_bound)
        outputs = observed_outputs(self._wanted, models, structure.kernels, whole_steady(oscillator, omega), whole=True)
        rows = np.empty((len(whole.stops), EVENT_COLUMNS + 2 * oscillator.size))
        impact_rows = np.stack([whole.stops.astype(np.float64), whole.phases, whole.velocities])
        write_orbit(problem, stops, impact_rows, 2.0 * math.pi * whole.period / omega, rows)
        totals, scratch = self._wanted.totals(), self._wanted.scratch(oscillator.size)
        end = (float(rows[0, HALF] + 2 * whole.period), float(rows[0, TIME]))
        observe_rows(problem, outputs, stops, rows, end, totals, scratch)
        return self._wanted.figures(totals.contacts, totals.outputs, omega, whole.period)


@in_own_period
def of_orbit(oscillator: Oscillator, orbit: PeriodicOrbit | SimulatedOrbit, wanted: Observables) -> Floats:
    """Return the figures (count,) of an orbit over its period; NaN where it has not converged or is not admissible."""
    if isinstance(orbit, SimulatedOrbit):
        models, period = trajectory_models(oscillator), orbit.motion.period
        assert period is not None  # it is a periodic motion
        return of_record(orbit.record, models, wanted, period)
    if not (orbit.converged and orbit.admissible):
        return wanted.nothing
    return OrbitObserver(oscillator, wanted).figures(oscillator, orbit.omega, orbit.clearance, orbit.impacts)
