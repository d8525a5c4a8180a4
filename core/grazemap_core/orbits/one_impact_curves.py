"""Curves of special one-impact motions in the plane of forcing frequency and clearance.

For every frequency the clearances at which the branch turns (SN), doubles its period or breaks its symmetry (PD, SB)
and touches a stop between its impacts (GR) are known in closed form. No point depends on its neighbours, so no part of
a curve is missed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.one_impact_branches import one_impact_branches


@dataclass(frozen=True, eq=False)
class OneImpactCurve:
    """One type of special point over all frequencies; NaN, and False, where there is none.

    Attributes
    ----------
    clearance : ndarray of shape (n,)
        Gap of the stop that is struck; between symmetric stops its clearance. Of curves over a parameter its values.
    impact_velocity : ndarray of shape (n,)
    admissible : ndarray of bool, shape (n,)
        The orbit has no contact with a stop other than its impacts.
    stop : ndarray of int, shape (n,)
        GR only, else 0: +1 where the further contact is with the stop that is struck (first), -1 with the other one.
    """

    clearance: Floats
    impact_velocity: Floats
    admissible: Booleans
    stop: Integers

    def moved(self, offset: float) -> OneImpactCurve:
        """Return the curve with clearances that are larger by an offset."""
        return replace(self, clearance=self.clearance + offset)


@dataclass(frozen=True, eq=False)
class OneImpactCurves:
    """The curves of one pattern of impacts.

    Attributes
    ----------
    omega : ndarray of shape (n,)
    saddle_node : OneImpactCurve
    doubling : OneImpactCurve
        Period doubling (PD), or symmetry breaking (SB) for symmetric motions.
    contact : OneImpactCurve
        GR: where the branch stops being admissible.
    """

    omega: Floats
    saddle_node: OneImpactCurve
    doubling: OneImpactCurve
    contact: OneImpactCurve


def one_impact_curves(
    oscillator: Oscillator,
    omega: ArrayLike,
    multiple: int = 1,
    symmetric: bool = False,
) -> OneImpactCurves:
    """Return the curves SN, PD (or SB) and GR of motions with one impact in n periods, or one on each stop.

    The stops are symmetric, and the forces have one harmonic.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega : array_like of shape (n,)
        Forcing frequencies > 0 (rad/s in SI).
    multiple : int
        n >= 1, odd for symmetric motions.
    symmetric : bool

    Raises
    ------
    ParameterError
        Nothing is forced, or a number is out of range.
    SteadyMotionError
        A mode is undamped.
    ConditioningError
        The modal model is ill-conditioned.
    """
    branches = list(one_impact_branches(oscillator, omega, multiple, symmetric))
    size = len(branches)

    def empty() -> OneImpactCurve:
        return OneImpactCurve(
            np.full(size, np.nan), np.full(size, np.nan), np.zeros(size, dtype=np.bool_), np.zeros(size, dtype=np.int64)
        )

    curves = {"SN": empty(), "PD": empty(), "SB": empty(), "GR": empty()}
    for i, branch in enumerate(branches):
        for point in branch.special_points[1:]:
            curve = curves[point.type]
            curve.clearance[i] = point.clearance
            curve.impact_velocity[i] = point.impact_velocity
            curve.admissible[i] = point.admissible
            curve.stop[i] = point.stop or 0
    return OneImpactCurves(
        omega=np.array([branch.omega for branch in branches]),
        saddle_node=curves["SN"],
        doubling=curves["SB" if symmetric else "PD"],
        contact=curves["GR"],
    )
