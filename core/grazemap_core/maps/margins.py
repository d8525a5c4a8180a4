"""How far the stops are from the steady motion at the points of a plane: zero on the grazing curves."""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.errors import CoreError
from grazemap_core.grazing.steady_maxima import steady_motion
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.runner import Conditions
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import NamedTuple


class SteadyContact(NamedTuple):
    """Where the steady motion is at k points."""

    conditions: Conditions
    """The conditions of the points."""
    place: Floats
    """(k,) Contact coordinate at the static equilibrium, with the bias of the factor 1."""
    amplitude: Floats
    """(k, 2) Largest displacements from there toward the right and the left stop, with forces of the factor 1; NaN
    where there is no steady motion."""

    def margins(self) -> Floats:
        """Return the gaps of the right and of the left stop from the steady motion (k, 2); infinite if absent."""
        conditions, margins = self.conditions, self.conditions.clearance.copy()
        place, amplitude = conditions.bias * self.place, conditions.forcing[:, None] * self.amplitude
        margins[:, 0] -= place + amplitude[:, 0]
        margins[:, 1] -= amplitude[:, 1] - place
        return margins


def steady_on(plane: Plane) -> SteadyContact:
    """Return the steady motion at all points of a plane, column by column."""
    rows, columns = plane.grid
    place, amplitude = np.empty(len(rows)), np.empty((len(rows), 2))
    for group in plane.groups(rows, columns, ()):
        oscillator = plane.structure(int(rows[group[0]]), int(columns[group[0]]))
        omegas, which = np.unique(plane.values("omega", rows[group], columns[group]), return_inverse=True)
        place[group] = contact_equilibrium(oscillator)
        amplitude[group] = _amplitudes(oscillator, omegas)[which]
    return SteadyContact(plane.conditions(rows, columns), place, amplitude)


def grazing_margins(plane: Plane) -> tuple[Floats, Floats]:
    """Return the gap of the right, and of the left stop from the steady motion, shapes (n, m), [vertical, horizontal].

    The gap from the equilibrium, minus the largest displacement toward the stop (theory, "Other planes"). The steady
    motion exists where neither is negative. Infinite for an absent stop; NaN where there is no steady motion.
    """
    margins = steady_on(plane).margins()
    of_map = margins.T.reshape(2, plane.shape[1], plane.shape[0]).transpose(0, 2, 1)
    return np.ascontiguousarray(of_map[0]), np.ascontiguousarray(of_map[1])


def _amplitudes(oscillator: Oscillator, omega: Floats) -> Floats:
    """Return the largest displacements toward the right and the left stop, (n, 2); NaN without a steady motion."""
    if not oscillator.drive:
        return np.zeros((len(omega), 2))
    own, times = oscillator.at_own_period
    try:
        motion = steady_motion(own, times * omega)
        return np.stack([motion.toward(stop).amplitude for stop in (1, -1)], axis=1)
    except CoreError:
        if len(omega) == 1:
            return np.full((1, 2), np.nan)
        return np.concatenate([_amplitudes(oscillator, omega[[k]]) for k in range(len(omega))])
