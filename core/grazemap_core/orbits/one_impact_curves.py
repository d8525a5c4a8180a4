"""Curves of special one-impact motions in the plane of forcing frequency and clearance.

For every frequency the clearances at which the branch turns (SN), doubles its period or breaks its symmetry (PD, SB)
and touches a stop between its impacts (GR) are known in closed form. No point depends on its neighbours, so no part of
a curve is missed. Where round-off hides whether orbits of vanishing impact speed meet a stop, the orbits at the special
points are decided one by one (`explicit_curves`).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.explicit_curves import OneImpactCurve, SecondStop, SpecialOrbit, StopFamily
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.one_impact_branches import OneImpactBranch, one_impact_branches
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class OneImpactCurves:
    """The curves of one pattern of impacts."""

    omega: Floats
    """(n,) Forcing frequencies."""
    saddle_node: OneImpactCurve
    """SN: saddle-nodes."""
    doubling: OneImpactCurve
    """Period doubling (PD), or symmetry breaking (SB) for symmetric motions."""
    contact: OneImpactCurve
    """GR: where the branch stops being admissible."""


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
        for kind, point in _special_orbits(branch):
            curve = curves[kind]
            curve.clearance[i] = point.gap
            curve.impact_velocity[i] = point.speed
            curve.admissible[i] = point.admissible
            curve.stop[i] = point.stop
    return OneImpactCurves(
        omega=np.array([branch.omega for branch in branches]),
        saddle_node=curves["SN"],
        doubling=curves["SB" if symmetric else "PD"],
        contact=curves["GR"],
    )


def _special_orbits(branch: OneImpactBranch) -> Iterator[tuple[str, SpecialOrbit]]:
    """Yield the types and the orbits of the special points of a branch that follow its graze."""
    if branch.admissibility == "decided":
        for point in branch.special_points[1:]:
            orbit = SpecialOrbit(point.angle, point.impact_velocity, point.clearance, point.admissible, point.stop or 0)
            yield point.type, orbit
        return
    pattern, omega = branch.pattern, np.array([branch.omega])
    family = OrbitFamily.of(branch.oscillator, pattern.multiple, pattern.symmetric)
    of = StopFamily(family, branch.stop, SecondStop(0.0, 1.0))
    here = of.at(branch.omega, family.steady_at(omega)[0])
    for kind in of.types:
        yield from ((kind, orbit) for orbit in here.special(kind) if orbit.gap > 0.0)
