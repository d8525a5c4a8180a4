"""The results of grazing-curves and codimension-two-points."""

from __future__ import annotations

from grazemap.schema.common import CLEARANCE, OMEGA
from grazemap.schema.fields import Field, Record, ResultSchema, field

_UNLIKE = "of stops that are not alike"
_RECURRENCE, _RESONANT, _SIMPLE = "of recurrences", "of resonant points", "of simple resonant points"

FAMILY = Record(
    "Family",
    "One of the paper's families of double grazing motions, equation (42).",
    (field("case", "int", "The paper's case, 1 to 4."), field("n", "int", "The paper's n.")),
)
UNFOLDING = Record(
    "Unfolding",
    "The curve that leaves the grazing curve at a resonant point: b = A(omega) + slope x + quadratic x^2, to leading "
    "order in the distance x from the point in omega.",
    (
        field(
            "orbits_before",
            "int",
            "Whether motions of vanishing impact velocity are below (-1) or above (+1) the grazing curve, at omega "
            "below the point.",
        ),
        field("orbits_after", "int", "The same at omega above the point."),
        field("curve_omega", "int", "Whether the curve is at smaller (-1) or larger (+1) omega."),
        field("curve_clearance", "int", "Whether the curve is below (-1) or above (+1) the grazing curve."),
        field("contact", "str", "Contact of the curve with the grazing curve.", values=("transversal", "tangent")),
        field("slope", "float", "Slope of the difference from the grazing curve; 0 where the contact is tangent."),
        field("quadratic", "float", "Coefficient of x^2 in this difference.", when="where the contact is tangent"),
        field("velocity_slope", "float", "Impact velocity on the curve divided by |x|."),
        field("transversality", "float", "Relative derivative of the sum that vanishes at the point; 0: degenerate."),
        field(
            "admissible",
            "bool",
            "Whether the motions near the point have no contact other than their impacts.",
            when="where that is decided",
        ),
        field(
            "margin",
            "float",
            "Minimum of the distances that decide `admissible`, relative to the size of their terms.",
            when="where that is decided",
        ),
    ),
)
_AT_CORNER = "d A/d omega of this maximum: that of the grazing curve at omega {} the point."
CORNER = Record(
    "Corner",
    "Two maxima of the steady motion that are equal, where the grazing curve has a kink.",
    (
        field(
            "phase_before",
            "float",
            "omega t, in (-pi/p, pi/p], of the maximum that is the larger one at omega below the point.",
            unit="rad",
        ),
        field("phase_after", "float", "The same at omega above the point.", unit="rad"),
        field("slope_before", "float", _AT_CORNER.format("below"), unit="m s/rad"),
        field("slope_after", "float", _AT_CORNER.format("above"), unit="m s/rad"),
        field(
            "recurrence_before",
            "int",
            "Number of the contact at which an impact first recurs after a graze at the first maximum; 0: none within "
            "max_order half periods. The contacts are those of the steady motion at the point, in the order of time.",
        ),
        field("recurrence_after", "int", "The same after a graze at the second maximum."),
    ),
)
POINT = Record(
    "CodimensionTwoPoint",
    "One codimension-two point of the grazing curve.",
    (
        field(
            "kind",
            "str",
            "recurrence: a zero of Phi_12(order T/2), equations (45), (57), (58); resonant: a zero of the "
            "periodic sum H(1) or H(-1); double-graze: the steady motion touches both stops, which are not alike; "
            "corner: two maxima of the steady motion are equal.",
            values=("recurrence", "resonant", "double-graze", "corner"),
        ),
        OMEGA.in_result(coordinate=True),
        CLEARANCE,
        field("order", "int", "Number of half periods of the forcing after which the graze recurs.", when=_RECURRENCE),
        field("active", "bool", "Whether no smaller order recurs at the point.", when=_RECURRENCE),
        field(
            "families",
            FAMILY,
            "The paper's families of this order.",
            "family",
            when="of recurrences of equal stops",
            prefix="family_",
        ),
        field(
            "multiple", "int", "The period of the motions in forcing periods.", unit="forcing periods", when=_RESONANT
        ),
        field("symmetric", "bool", "Whether these motions are their own mirror image.", when=_RESONANT),
        field(
            "bifurcation",
            "str",
            "Type of the curve that leaves the point: saddle-node, period doubling, symmetry breaking.",
            when=_RESONANT,
            values=("SN", "PD", "SB"),
        ),
        field(
            "residual",
            "float",
            "Modulus of the function at its zero divided by the sum of its amplitudes.",
            when="where it was computed",
        ),
        field(
            "status",
            "str",
            "near-double: two zeros too close to be separated, or an extremum close to zero.",
            when="where it was computed",
            values=("simple", "near-double"),
        ),
        field(
            "omega_error",
            "float",
            "Error of omega due to the round-off of the model.",
            unit="rad/s",
            when="where it was computed",
        ),
        field("stop", "int", "The stop that is grazed: +1 right, -1 left.", when=_UNLIKE, values=(1, -1)),
        field(
            "amplitude_slope",
            "float",
            "d A/d omega of the steady motion.",
            unit="m s/rad",
            when="of stops that are not alike, but for corners",
        ),
        field(
            "margin",
            "float",
            "Gap of the other stop minus the amplitude toward it; the graze is virtual where it is negative.",
            unit="m",
            when="of stops that are not alike, if there is another one",
        ),
        field("unfolding", UNFOLDING, "The curve that leaves the grazing curve.", when=_SIMPLE, prefix="unfolding_"),
        field("corner", CORNER, "The two maxima.", when="of simple corners", prefix="corner_"),
    ),
)


def _of_stop(name: str) -> tuple[Field, ...]:
    when = f"if the clearance of the {name} stop varies"
    return (
        CLEARANCE.in_result(
            name=f"clearance_{name}",
            dims=("omega",),
            when=when,
            description=f"Clearance of the {name} stop at which the steady motion touches it.",
        ),
        field(f"phase_{name}", "float", "omega t at the contact, in (-pi/p, pi/p].", "omega", "rad", when=when),
        field(
            f"margin_{name}",
            "float",
            "Gap of the other stop minus the amplitude toward it; null if there is none.",
            "omega",
            "m",
            null=True,
            when=when,
        ),
        field(
            f"virtual_{name}",
            "bool",
            "Whether the steady motion meets the other stop first, so that it does not reach this graze.",
            "omega",
            when=when,
        ),
        field(
            f"first_recurrence_{name}",
            "int",
            "Number of half periods, even, after which an impact on this stop first recurs; 0: none up to max_order.",
            "omega",
            when=when,
        ),
    )


STOP_GRAZING_CURVES = ResultSchema(
    "StopGrazingCurves",
    "The grazes of stops that are not alike: of one of them, with the other one fixed or absent, or of both at one "
    "clearance, where a bias moves the equilibrium or the forces have even and odd harmonics.",
    (
        field("contact_equilibrium", "float", "The contact coordinate at the static equilibrium.", unit="m"),
        OMEGA.in_result(dims=("omega",)),
        *_of_stop("right"),
        *_of_stop("left"),
        field(
            "points", POINT, "The codimension-two points inside the range, in increasing omega.", "point", variable=None
        ),
    ),
    process="grazing-curves",
    rows="omega",
)
XI = field("xi", "float", "xi_m for m = 1, 2, ..., equations (33)-(40).", "order")

GRAZING_CURVES = ResultSchema(
    "GrazingCurve",
    "The curve clearance = A(omega) on which the steady motion touches both stops, equations (16)-(19).",
    (
        OMEGA.in_result(dims=("omega",)),
        CLEARANCE.in_result(dims=("omega",), description="A(omega), where the steady motion touches both stops."),
        field("phase", "float", "omega t at the contact with stop A, in (-pi/p, pi/p].", "omega", "rad"),
        field(
            "first_recurrence",
            "int",
            "Number of half periods after which an impact first recurs; 0: none up to max_order.",
            "omega",
        ),
        field("recurrence_stop", "int", "The stop of that recurrence: +1 A, -1 C, 0 none.", "omega"),
        field(
            "points", POINT, "The codimension-two points inside the range, in increasing omega.", "point", variable=None
        ),
        XI.in_result(
            dims=("omega", "order"),
            when="with sequence",
            description="xi_m for m = 1 .. max_order of a graze at A, equations (33)-(40): an impact recurs at the "
            "first m with (-1)^m xi_m < 0.",
        ),
    ),
    process="grazing-curves",
    rows="omega",
)
CODIMENSION_TWO_POINTS = ResultSchema(
    "CodimensionTwoPoints",
    "Every codimension-two point of the grazing curve over an interval of omega.",
    (field("points", POINT, "The points, in increasing omega.", "point"),),
    process="codimension-two-points",
)
