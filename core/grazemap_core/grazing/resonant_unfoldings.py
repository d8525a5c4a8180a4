"""What leaves the grazing curve at a resonant point: on which side, how steeply, and whether it is physical.

A resonant point flows in; out flows the leading order of the curve of saddle-nodes, period doublings or symmetry
breakings that begins there, and of the branches beside it (theory, "What leaves a resonant point").
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from grazemap_core.grazing.kernels.kicked_motion import FOUND, NEVER, contact_margin
from grazemap_core.grazing.one_impact_family import Pattern, kick_sums, sum_slopes
from grazemap_core.model.impulse_response import ImpulseResponse

Sign = Literal[-1, 1]
Order = Literal["transversal", "tangent"]


@dataclass(frozen=True)
class ResonantUnfolding:
    """The curve that leaves the grazing curve at a resonant point, and the orbits beside it.

    With x the signed distance from the point in omega, the curve is ``b = A(omega) + slope x + quadratic x^2``, on one
    side of the point only; A(omega) is the grazing curve itself, not its value at the point.

    Attributes
    ----------
    orbits_before, orbits_after : -1 or 1
        Orbits of vanishing impact speed have a clearance below (-1) or above (+1) that of the grazing curve, at omega
        just below and just above the point.
    curve_omega : -1 or 1
        The curve is at smaller (-1) or larger (+1) omega.
    curve_clearance : -1 or 1
        The curve is below (-1) or above (+1) the grazing curve.
    contact : {"transversal", "tangent"}
        Of the curve with the grazing curve. Saddle-nodes are tangent; period doubling and symmetry breaking are
        transversal, but tangent where their point is one with that of the saddle-nodes, as always for one mass.
    slope : float
        0 for a tangent curve.
    quadratic : float or None
        None for a transversal curve.
    velocity_slope : float
        Impact velocity on the curve is this times the distance in omega, > 0.
    transversality : float
        Omega times the derivative by omega of the sum that vanishes here, over the sum of its blocks' amplitudes; 0
        would be a degenerate point.
    admissible : bool or None
        Whether the orbits near the point have no contact with a stop but their impacts; None where leading order, or
        round-off, does not decide it.
    margin : float or None
        By how much, relative to the size of its terms, the least of the distances holds that decide it; None for
        symmetric motions of n = 1, which have none to hold.
    """

    orbits_before: Sign
    orbits_after: Sign
    curve_omega: Sign
    curve_clearance: Sign
    contact: Order
    slope: float
    quadratic: float | None
    velocity_slope: float
    transversality: float
    admissible: bool | None
    margin: float | None


def resonant_unfolding(
    response: ImpulseResponse, restitution: float, omega: float, amplitude: float, pattern: Pattern, saddle_node: bool
) -> ResonantUnfolding | None:
    """Return the unfolding of a resonant point, or None where round-off hides in which direction its sum vanishes.

    Parameters
    ----------
    response : ImpulseResponse
    restitution : float
    omega, amplitude : float
        The point on the grazing curve.
    pattern : Pattern
        Of the orbits.
    saddle_node : bool
        The sum at multiplier +1 vanishes here; otherwise that at -1 (PD, SB).
    """
    sums = kick_sums(response, pattern, omega)
    (same, same_roundoff, same_terms), (other, _, other_terms) = sum_slopes(response, pattern, omega)
    rebound = 1.0 + restitution
    # round-off of the sum's slope: that of the sum itself counts for a fraction of a period of its fastest term
    turning = pattern.spacing(omega) * float(max(response.frequency_squared)) ** 0.5
    vanishing, terms = (same, same_terms) if saddle_node else (other, other_terms)
    transversality = omega * vanishing / terms
    if not abs(transversality) > turning * same_roundoff / same_terms:
        return None
    d = (1.0 + rebound * sums.velocity) / omega
    c = rebound * sums.displacement
    c_slope = rebound * same

    # both sums at once: to round-off, and for one mass by the form of its response
    together = len(response.decay) == 1 or abs(sums.displacement) <= same_roundoff
    quadratic: float | None
    curve_clearance: Sign
    if saddle_node:
        velocity_slope = c_slope * amplitude / (d * d)
        slope, quadratic = 0.0, 0.5 * amplitude * (c_slope / d) ** 2
        curve_omega, curve_clearance = _sign(-c_slope), 1
    else:
        straight = 1.0 + rebound * sums.doubled_velocity
        velocity_slope = -rebound * other * (omega / straight) ** 2 * amplitude
        curve_omega = _sign(velocity_slope)
        if together:
            slope = 0.0
            quadratic = -((d * velocity_slope) ** 2 / (2.0 * amplitude) + c_slope * velocity_slope)
            curve_clearance = _sign(quadratic)
        else:
            slope, quadratic = -c * velocity_slope, None
            curve_clearance = _sign(slope * curve_omega)
    turns = saddle_node or together
    after = _sign(-c_slope) if turns else _sign(-c)
    before = _sign(c_slope) if turns else after

    margin, verdict = contact_margin(
        response.decay,
        response.discriminant,
        response.frequency_squared,
        sums.state,
        0.0 if turns else sums.displacement,
        omega,
        pattern.half_periods,
    )
    return ResonantUnfolding(
        orbits_before=before,
        orbits_after=after,
        curve_omega=curve_omega,
        curve_clearance=curve_clearance,
        contact="tangent" if turns else "transversal",
        slope=slope,
        quadratic=quadratic,
        velocity_slope=abs(velocity_slope),
        transversality=transversality,
        admissible=verdict == FOUND if verdict in (FOUND, NEVER) else None,
        margin=None if math.isinf(margin) else margin,
    )


def _sign(value: float) -> Sign:
    return 1 if value > 0.0 else -1
