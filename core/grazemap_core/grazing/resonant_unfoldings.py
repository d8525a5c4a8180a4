"""Unfoldings of resonant points: the bifurcation curve that leaves the grazing curve there, to leading order.

The curve is one of saddle-nodes, period doublings or symmetry breakings; the branches of orbits beside it, and whether
they are admissible, are computed too (theory, "What leaves a resonant point").
"""

from __future__ import annotations

import math
from typing import Literal

from grazemap_core.grazing.kernels.periodic_impulses import ADMISSIBLE, NEVER, contact_margin
from grazemap_core.grazing.one_impact_family import PeriodicSums, sum_slopes
from grazemap_core.records import NamedTuple, dataclass

Sign = Literal[-1, 1]
Order = Literal["transversal", "tangent"]


@dataclass(frozen=True)
class ResonantUnfolding:
    """The curve that leaves the grazing curve at a resonant point, and the orbits beside it.

    With x the signed distance from the point in omega, the curve is ``b = A(omega) + slope x + quadratic x^2``, on one
    side of the point only; A(omega) is the grazing curve itself, not its value at the point.
    """

    orbits_before: Sign
    """Orbits of vanishing impact speed have a clearance below (-1) or above (+1) that of the grazing curve, at omega
    just below the point."""
    orbits_after: Sign
    """The side of the clearances, -1 or +1, at omega just above the point."""
    curve_omega: Sign
    """The curve lies at smaller (-1) or larger (+1) omega."""
    curve_clearance: Sign
    """The curve lies below (-1) or above (+1) the grazing curve."""
    contact: Order
    """Contact of the curve with the grazing curve. It is tangent for saddle-nodes and transversal for period doubling
    and symmetry breaking, unless their point coincides with that of the saddle-nodes, as always for one mass."""
    slope: float
    """0 for a tangent curve."""
    quadratic: float | None
    """None for a transversal curve."""
    velocity_slope: float
    """Impact velocity on the curve is this times the distance in omega, > 0."""
    transversality: float
    """Omega times the derivative with respect to omega of the sum that vanishes here, over the sum of the amplitudes of
    its blocks; a point with 0 would be degenerate."""
    admissible: bool | None
    """Whether the orbits near the point have no contact with a stop other than their impacts; None if the leading
    order, or round-off, does not decide it."""
    margin: float | None
    """Minimum of the distances that decide it, relative to the size of their terms; None for symmetric motions of n =
    1, for which there are none."""


def resonant_unfolding(
    sums: PeriodicSums,
    restitution: float,
    curvature: float,
    saddle_node: bool,
    one_stop: bool = False,
) -> ResonantUnfolding | None:
    """Return the unfolding of a resonant point, or None if round-off hides the sign of the derivative of its sum.

    Parameters
    ----------
    sums : PeriodicSums
        At the point on the grazing curve.
    restitution : float
    curvature : float
        Acceleration of the steady motion away from the stop at the graze, over omega^2: in one harmonic the amplitude.
    saddle_node : bool
        Whether the sum at multiplier +1 vanishes here; otherwise that at -1 does (PD, SB).
    one_stop : bool
        Whether the other stop is too far to be met: `admissible` then depends on returns after whole periods alone.
    """
    (same, same_roundoff, same_terms), (other, _, other_terms) = sum_slopes(sums)
    response, omega, rebound = sums.response, sums.omega, 1.0 + restitution
    # the round-off of the derivative is that of the sum times the phase of its fastest term over the spacing
    turning = sums.pattern.spacing(omega) * float(max(response.frequency_squared)) ** 0.5
    vanishing, terms = (same, same_terms) if saddle_node else (other, other_terms)
    if not (terms > 0.0 and same_terms > 0.0):
        return None
    transversality = omega * vanishing / terms
    if not abs(transversality) > turning * same_roundoff / same_terms:
        return None
    d = (1.0 + rebound * sums.velocity) / omega
    c = rebound * sums.displacement
    c_slope = rebound * same

    # whether both sums vanish: to round-off, and always for one mass
    together = len(response.decay) == 1 or abs(sums.displacement) <= same_roundoff
    if saddle_node:
        curve = _saddle_node_curve(c_slope, d, curvature)
    else:
        straight = 1.0 + rebound * sums.doubled_velocity
        velocity_slope = -rebound * other * (omega / straight) ** 2 * curvature
        curve = _doubling_curve(c, c_slope, d, velocity_slope, curvature, together)
    turns = saddle_node or together
    after = _sign(-c_slope) if turns else _sign(-c)
    before = _sign(c_slope) if turns else after

    margin, verdict = contact_margin(sums.impulses, 0.0 if turns else sums.displacement, one_stop)
    return ResonantUnfolding(
        orbits_before=before,
        orbits_after=after,
        curve_omega=curve.omega,
        curve_clearance=curve.clearance,
        contact="tangent" if turns else "transversal",
        slope=curve.slope,
        quadratic=curve.quadratic,
        velocity_slope=abs(curve.velocity_slope),
        transversality=transversality,
        admissible=verdict == ADMISSIBLE if verdict in (ADMISSIBLE, NEVER) else None,
        margin=None if math.isinf(margin) else margin,
    )


class _Curve(NamedTuple):
    """Sides and leading order of a bifurcation curve."""

    omega: Sign
    """As `ResonantUnfolding.curve_omega`."""
    clearance: Sign
    """As `ResonantUnfolding.curve_clearance`."""
    slope: float
    """As in `ResonantUnfolding`."""
    quadratic: float | None
    """As in `ResonantUnfolding`."""
    velocity_slope: float
    """As in `ResonantUnfolding`, but signed."""


def _saddle_node_curve(c_slope: float, d: float, curvature: float) -> _Curve:
    return _Curve(
        omega=_sign(-c_slope),
        clearance=1,
        slope=0.0,
        quadratic=0.5 * curvature * (c_slope / d) ** 2,
        velocity_slope=c_slope * curvature / (d * d),
    )


def _doubling_curve(
    c: float, c_slope: float, d: float, velocity_slope: float, curvature: float, together: bool
) -> _Curve:
    """Return the curve of period doublings or symmetry breakings; `together` if both sums vanish."""
    side = _sign(velocity_slope)
    if together:
        quadratic = -((d * velocity_slope) ** 2 / (2.0 * curvature) + c_slope * velocity_slope)
        return _Curve(side, _sign(quadratic), 0.0, quadratic, velocity_slope)
    slope = -c * velocity_slope
    return _Curve(side, _sign(slope * side), slope, None, velocity_slope)


def _sign(value: float) -> Sign:
    """Return the sign of a number, -1 for 0."""
    return 1 if value > 0.0 else -1
