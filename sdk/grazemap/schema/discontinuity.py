"""The result of discontinuity-mappings."""

from __future__ import annotations

from grazemap.schema.common import CLEARANCE, OMEGA, STOPS
from grazemap.schema.fields import Record, ResultSchema, field
from grazemap.schema.grazing import XI

_ENTRY, _EACH, _ONWARD = "state_entry", "overshoot", "overshoot return"

GRAZING = Record(
    "Grazing",
    "The steady motion where it touches the stop; states are (x_1, v_1, ..., x_N, v_N, theta), equation (20).",
    (
        field("state", "float", "theta is the phase of the forcing, in (-pi, pi].", _ENTRY),
        field("vector_field", "float", "Of the motion there.", _ENTRY),
        field("acceleration", "float", "Of mass 1.", unit="m/s^2"),
        field(
            "beta",
            "float",
            "Of the mapping x + beta u + gamma u^2 + ..., u = sqrt(2 overshoot/|acceleration|), equation (27).",
            _ENTRY,
        ),
        field("gamma", "float", "Of the same.", _ENTRY),
    ),
)
NEXT_CONTACT = Record(
    "NextContact",
    "The next contact of the steady motion after its first impact, slightly below the grazing curve.",
    (
        field("order", "int", "Half periods later; 0: not within the returns that were asked for.", _EACH),
        field("stop", "int", "+1 A, -1 C, 0 none.", _EACH),
        field(
            "margin", "float", "Distance of the rule from its threshold, relative to the threshold.", _EACH, null=True
        ),
    ),
)
RETURNS = Record(
    "Returns",
    "The steady motion with the stops inside its amplitude by each overshoot, by the Poincare map and by simulation, "
    "half period by half period, as deviations from the grazing points of the two stops in turn.",
    (
        field("mapped", "float", "By the Poincare map, equation (26).", f"{_ONWARD} {_ENTRY}", null=True),
        field("simulated", "float", "By simulation.", f"{_ONWARD} {_ENTRY}", null=True),
        field(
            "mapped_overshoot",
            "float",
            "Distance of mass 1 beyond the stop; positive: there is an impact.",
            _ONWARD,
            "m",
            null=True,
        ),
        field("simulated_overshoot", "float", "The same of the simulation.", _ONWARD, "m", null=True),
        field(
            "error",
            "float",
            "Maximum difference of the two deviations, in units of clearance, omega times clearance, and radians.",
            _ONWARD,
            null=True,
        ),
    ),
)

DISCONTINUITY_MAPPINGS = ResultSchema(
    "DiscontinuityMapping",
    "The effect of an impact on motions that overshoot a grazing stop, and their later returns. Errors are maximum "
    "entries in units of clearance, omega times clearance, and radians.",
    (
        OMEGA,
        CLEARANCE.in_result(description="Of the grazing point."),
        field("stop", "int", "The stop that is grazed: +1 A, -1 C.", values=STOPS),
        field(
            "grazing",
            GRAZING,
            "The motion at the grazing point, and the coefficients of the mapping.",
            prefix="grazing_",
        ),
        field("overshoot", "float", "Displacement of mass 1 beyond the stop.", _EACH, "m"),
        field("largest_overshoot", "float", "End of the domain of the exact mapping.", unit="m"),
        field("state", "float", "The states that are mapped.", f"{_EACH} {_ENTRY}"),
        field("mapped", "float", "Their images under the mapping of the requested order.", f"{_EACH} {_ENTRY}"),
        field(
            "displacement",
            "float",
            "Image minus state, to full relative accuracy.",
            f"{_EACH} {_ENTRY}",
            variable="displacement",
        ),
        field("size", "float", "Size of the exact displacement.", _EACH),
        field("error", "float", "Error of x + beta u.", _EACH),
        field("error_of_second_order", "float", "Error of x + beta u + gamma u^2.", _EACH),
        field("fitted_order", "float", "Exponent of the overshoot in the first error: 1 in theory.", null=True),
        field("fitted_order_of_second", "float", "Exponent in the second: 3/2 in theory.", null=True),
        field(
            "jacobian",
            "float",
            "Of the half-period map from this stop to the other one, equation (46).",
            f"{_ENTRY} state_entry_before",
        ),
        field("jacobian_opposite", "float", "The same of the half-period map back.", f"{_ENTRY} state_entry_before"),
        XI.in_result(
            description="xi_m for m = 1 .. returns of a graze at this stop, equations (33)-(40): an impact "
            "recurs at the first m with (-1)^m stop xi_m < 0."
        ),
        field("first_recurrence", "int", "The first such m; 0: none."),
        field("recurrence_stop", "int", "The stop of that impact: +1 A, -1 C, 0 none."),
        field("next_contact", NEXT_CONTACT, "The next contact of the steady motion.", prefix="next_"),
        field("returns", RETURNS, "The same motion over half periods.", prefix="returns_"),
    ),
    process="discontinuity-mappings",
)
