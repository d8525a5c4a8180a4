"""The results of trajectories, from one state or from a list of them, and of bifurcation-diagrams."""

from __future__ import annotations

from grazemap.schema.common import IMPACTS, MOTION, RESTS, STATE, STOPS
from grazemap.schema.fields import Record, ResultSchema, field

_FIELDS = (
    field("time", "float", "Times of the samples, from the start of the record.", "time", "s"),
    field("displacement", "float", "Of every mass.", "mass time", "m", null=True),
    field(
        "velocity", "float", "Of every mass; at the time of an impact, the one after it.", "mass time", "m/s", null=True
    ),
    field("impacts", IMPACTS, "Every contact with a stop.", prefix="impact_"),
    field("sticking", RESTS, "The rests on a stop.", prefix="sticking_"),
    field("undecided", "int", "Number of events that round-off leaves undecided, from the start of the transient on."),
    field("motion", MOTION, "The motion at the end, or unresolved and the reason.", variable=None),
    field(
        "final",
        STATE,
        "The state at the end of the record, from which a trajectory continues this one; null where there is no such "
        "state.",
        null=True,
        prefix="final_",
    ),
)

TRAJECTORY = ResultSchema("Trajectory", "One trajectory with every impact.", _FIELDS, process="trajectories")
TRAJECTORIES = ResultSchema(
    "Trajectories",
    "One trajectory from each of many initial states.",
    (
        field(
            "trajectories",
            Record("TrajectoryRecord", TRAJECTORY.description, _FIELDS),
            "In the order of the states.",
            "trajectory",
        ),
    ),
    process="trajectories",
)

SECTION = Record(
    "Section",
    "The motion at one value of the parameter.",
    (
        field(
            "displacement", "float", "Of mass 1 once a forcing period, where the forcing's phase is 0.", "point", "m"
        ),
        field("velocity", "float", "Of mass 1 at the same times.", "point", "m/s"),
        field("impact_velocity", "float", "Of every impact, signed, before it.", "impact", "m/s"),
        field("impact_stop", "int", "Of every impact: +1 A, -1 C.", "impact", dtype="int8", values=STOPS),
        field(
            "motion",
            MOTION,
            "The motion; where it has not closed, the growth of small changes over 500 more periods "
            "names it, or leaves it unresolved.",
            variable="motion",
        ),
    ),
)
BIFURCATION_DIAGRAMS = ResultSchema(
    "BifurcationDiagram",
    "Settled motions along clearance or omega.",
    (
        field("parameter", "float", "Values of the parameter that varies, increasing.", "parameter"),
        field("sections", SECTION, "One for each value.", "parameter"),
    ),
    process="bifurcation-diagrams",
)
