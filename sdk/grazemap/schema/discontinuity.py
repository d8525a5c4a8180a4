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
        field("state", "float", "The state; theta is the phase of the forcing, in (-pi/p, pi/p].", _ENTRY),
        field("vector_field", "float", "Vector field at the state.", _ENTRY),
        field("acceleration", "float", "Acceleration of the contact coordinate.", unit="m/s^2"),
        field(
            "beta",
            "float",
            "Coefficient in x + beta u + gamma u^2 + ..., u = sqrt(2 overshoot/|acceleration|), equation (27).",
            _ENTRY,
        ),
        field("gamma", "float", "Coefficient of the same mapping.", _ENTRY),
    ),
)
NEXT_CONTACT = Record(
    "NextContact",
    "The next contact of the steady motion after its first impact, slightly below the grazing curve.",
    (
        field("order", "int", "Returns until that contact; 0: none within the requested ones.", _EACH),
        field("stop", "int", "Stop of that contact: +1 A, -1 C, 0 none.", _EACH),
        field("margin", "float", "Distance of the order from its threshold, relative to the latter.", _EACH, null=True),
    ),
)
RETURNS = Record(
    "Returns",
    "The motion with the stops closer than the steady amplitude by each overshoot, by the Poincare map and by "
    "simulation, as deviations from the grazing point at every return: half periods of the forces, alternately at the "
    "two stops, where both are grazed at once, else whole ones.",
    (
        field("mapped", "float", "Deviations by the Poincare map, equation (26).", f"{_ONWARD} {_ENTRY}", null=True),
        field("simulated", "float", "Deviations by simulation.", f"{_ONWARD} {_ENTRY}", null=True),
        field(
            "mapped_overshoot",
            "float",
            "Distance of the contact beyond the stop; positive: there is an impact.",
            _ONWARD,
            "m",
            null=True,
        ),
        field("simulated_overshoot", "float", "The same for the simulation.", _ONWARD, "m", null=True),
        field(
            "error",
            "float",
            "Maximum difference of the deviations, in units of amplitude, p omega times it, and radians of p omega t.",
            _ONWARD,
            null=True,
        ),
    ),
)

DISCONTINUITY_MAPPINGS = ResultSchema(
    "DiscontinuityMapping",
    "The effect of an impact on motions that overshoot a grazing stop, and their later returns. Errors are maximum "
    "entries in units of the steady amplitude, p omega times the amplitude, and radians of p omega t.",
    (
        OMEGA,
        CLEARANCE.in_result(description="Clearance of the grazing point."),
        field("stop", "int", "The stop that is grazed: +1 A, -1 C.", values=STOPS),
        field(
            "grazing",
            GRAZING,
            "The motion at the grazing point, and the coefficients of the mapping.",
            prefix="grazing_",
        ),
        field("overshoot", "float", "Displacement of the contact beyond the stop.", _EACH, "m"),
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
        field("fitted_order", "float", "Exponent of the overshoot in `error`: 1 in theory.", null=True),
        field("fitted_order_of_second", "float", "The same for `error_of_second_order`: 3/2 in theory.", null=True),
        field(
            "jacobian",
            "float",
            "Jacobian of the map from this return to the next one, equation (46).",
            f"{_ENTRY} state_entry_before",
        ),
        field(
            "jacobian_opposite",
            "float",
            "Jacobian of the map from there to the return after it, at the other stop if both are grazed at once.",
            f"{_ENTRY} state_entry_before",
        ),
        XI.in_result(
            description="xi_m for m = 1 .. returns of a graze at this stop, equations (33)-(40): an impact "
            "recurs at the first m with (-1)^m stop xi_m < 0, or stop xi_m < 0 after whole periods."
        ),
        field("first_recurrence", "int", "The first m at which an impact recurs; 0: none."),
        field("recurrence_stop", "int", "The stop of that impact: +1 A, -1 C, 0 none."),
        field("next_contact", NEXT_CONTACT, "The next contact of the steady motion.", prefix="next_"),
        field(
            "margin",
            "float",
            "Gap of the other stop minus the amplitude toward it.",
            unit="m",
            when="of stops that are not alike, if there is another one",
        ),
        field("returns", RETURNS, "The later returns of the motion.", prefix="returns_"),
    ),
    process="discontinuity-mappings",
    rows="overshoot",
)
