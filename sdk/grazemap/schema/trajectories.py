"""The results of trajectories, from one state or from a list of them, and of bifurcation-diagrams."""

from __future__ import annotations

from grazemap.schema.common import CHANCE_TO_SETTLE, IMPACTS, MOTION, RESTS, SENSITIVE, STATE, STOPS, TRANSIENT_GROWTH
from grazemap.schema.fields import Record, ResultSchema, field
from grazemap.schema.observables import OUTPUT, observed_fields, output_record

_FIELDS = (
    field("time", "float", "Times of the samples, from the start of the record.", "time", "s"),
    field("displacement", "float", "Displacement of every mass.", "mass time", "m", null=True),
    field(
        "velocity", "float", "Velocity of every mass; at an impact, the one after it.", "mass time", "m/s", null=True
    ),
    field("impacts", IMPACTS, "Every contact with a stop.", prefix="impact_"),
    field("sticking", RESTS, "The rests on a stop.", prefix="sticking_"),
    field("undecided", "int", "Number of events, since the start of the transient, that round-off leaves undecided."),
    field("motion", MOTION, "The motion at the end; if it is unresolved, with the reason.", variable=None),
    field(
        "final",
        STATE,
        "The state at the end of the record, from which another trajectory can continue; null where there is none.",
        null=True,
        prefix="final_",
    ),
    *observed_fields((), OUTPUT),
)

TRAJECTORY = ResultSchema(
    "Trajectory", "One trajectory with every impact.", _FIELDS, process="trajectories", rows="time"
)
TRAJECTORIES = ResultSchema(
    "Trajectories",
    "One trajectory from each of many initial states.",
    (
        field(
            "trajectories",
            Record("TrajectoryRecord", TRAJECTORY.description, _FIELDS),
            "The trajectories, in the order of the states.",
            "trajectory",
        ),
    ),
    process="trajectories",
)

SECTION = Record(
    "Section",
    "The motion at one value of the parameter.",
    (
        field("displacement", "float", "Contact coordinate once per forcing period, at phase 0.", "point", "m"),
        field("velocity", "float", "Its velocity at the same times.", "point", "m/s"),
        field("impact_velocity", "float", "Velocity before every impact, signed.", "impact", "m/s"),
        field("impact_stop", "int", "Stop of every impact: +1 A, -1 C.", "impact", dtype="int8", values=STOPS),
        field(
            "motion",
            MOTION,
            "The motion that the trajectory settles to until 500 periods after those that are shown. It is verified if "
            "its orbit is verified and captures the trajectory, which is not sensitive.",
            variable="motion",
        ),
        SENSITIVE,
        TRANSIENT_GROWTH,
    ),
)
BIFURCATION_DIAGRAMS = ResultSchema(
    "BifurcationDiagram",
    "Settled motions along clearance or omega.",
    (
        field("parameter", "float", "Values of the parameter that varies, increasing.", "parameter"),
        field("sections", SECTION, "The sections, one for each value.", "parameter"),
        field(
            "chance_to_settle",
            CHANCE_TO_SETTLE,
            "The chance that a motion that is called chaotic settles within ten times the periods that were watched.",
            when="of diagrams with chaotic motions",
            variable=None,
        ),
        *observed_fields(("parameter",), output_record("OutputOfDiagram", ("parameter",))),
    ),
    process="bifurcation-diagrams",
)
