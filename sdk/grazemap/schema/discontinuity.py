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
    "Where the steady motion hits a stop again after its first impact, by the rule for stops just inside it.",
    (
        field("order", "int", "Half periods later; 0: not within the returns that were asked for.", _EACH),
        field("stop", "int", "+1 A, -1 C, 0 none.", _EACH),
        field(
            "margin", "float", "How far the rule is from another answer, relative to its threshold.", _EACH, null=True
        ),
    ),
)
RETURNS = Record(
    "Returns",
    "The steady motion when the stops stand each overshoot inside its amplitude, over half periods, by the Poincare "
    "map and by simulation, as deviations from the grazing points of the two stops in turn.",
    (
        field("mapped", "float", "By the Poincare map, equation (26).", f"{_ONWARD} {_ENTRY}", null=True),
        field("simulated", "float", "By simulation.", f"{_ONWARD} {_ENTRY}", null=True),
        field(
            "mapped_overshoot",
            "float",
            "How far mass 1 is beyond the stop; positive: an impact.",
            _ONWARD,
            "m",
            null=True,
        ),
        field("simulated_overshoot", "float", "The same of the simulation.", _ONWARD, "m", null=True),
        field(
            "error",
            "float",
            "Largest difference of the two deviations, in units of clearance, omega times clearance, and radians.",
            _ONWARD,
            null=True,
        ),
    ),
)

DISCONTINUITY_MAPPINGS = ResultSchema(
    "DiscontinuityMapping",
    "What an impact does to motions that overshoot a grazing stop, and what the motion does next. Errors are largest "
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
        field("overshoot", "float", "How far mass 1 is taken beyond the stop.", _EACH, "m"),
        field("largest_overshoot", "float", "End of the domain of the exact mapping.", unit="m"),
        field("state", "float", "The states that are mapped.", f"{_EACH} {_ENTRY}"),
        field("mapped", "float", "What they are mapped to, by the order that was asked for.", f"{_EACH} {_ENTRY}"),
        field(
            "displacement", "float", "The difference, to all its digits.", f"{_EACH} {_ENTRY}", variable="displacement"
        ),
        field("size", "float", "Of the exact displacement.", _EACH),
        field("error", "float", "Of x + beta u.", _EACH),
        field("error_of_second_order", "float", "Of x + beta u + gamma u^2.", _EACH),
        field("fitted_order", "float", "Exponent of the overshoot in the first error: 1 in theory.", null=True),
        field("fitted_order_of_second", "float", "Exponent in the second: 3/2 in theory.", null=True),
        field(
            "jacobian",
            "float",
            "Of the half-period map from this stop to the other one, equation (46).",
            f"{_ENTRY} state_entry_before",
        ),
        field("jacobian_opposite", "float", "Of the one back.", f"{_ENTRY} state_entry_before"),
        XI.in_result(
            description="xi_m for m = 1 .. returns of a graze at this stop, equations (33)-(40): an impact "
            "recurs at the first m with (-1)^m stop xi_m < 0."
        ),
        field("first_recurrence", "int", "That m; 0: none."),
        field("recurrence_stop", "int", "The stop of that impact: +1 A, -1 C, 0 none."),
        field("next_contact", NEXT_CONTACT, "Of the steady motion, where it hits again.", prefix="next_"),
        field("returns", RETURNS, "The same motion over half periods.", prefix="returns_"),
    ),
    process="discontinuity-mappings",
)
