"""The results of periodic-orbits and orbit-branches."""

from __future__ import annotations

from grazemap.schema.common import (
    ADMISSIBLE,
    BIFURCATIONS,
    CLEARANCE,
    EVIDENCE,
    MOTION,
    OMEGA,
    RESTS,
    STATE,
    VERIFIED,
)
from grazemap.schema.fields import Record, Request, ResultSchema, deprecated, field
from grazemap.schema.observables import OUTPUT, observed_fields, output_record

_REST_STOP = RESTS["stop"].in_result(dtype="int64")
_RESTS = Record(RESTS.name, RESTS.description, (*RESTS.fields[:-1], _REST_STOP))
_PHASES = "Phases omega t of the impacts, with the forcing f sin(omega t)."
_VELOCITIES = "Velocities of the contact before each impact, signed."
_EXCESS = "Maximum distance of the contact beyond a stop between the impacts; negative: it stays inside."
RESTITUTION = field("restitution", "float", "Speed after an impact divided by the speed before it.", null=True)
_CLEARANCE = CLEARANCE.in_result(
    description="Distance of each stop from the middle; null where the stops differ.", null=True
)
_UNLIKE = "where the stops differ or one is absent"
_OF_EACH = (
    field("clearance_right", "float", "Distance of the right stop from q = 0; null: absent.", unit="m", when=_UNLIKE),
    field("clearance_left", "float", "Distance of the left stop from q = 0; null: absent.", unit="m", when=_UNLIKE),
)
_GENERAL = "where the stops differ, or one of these varies"
_VARIED = (
    *(one.in_result(when=_GENERAL, null=True) for one in _OF_EACH),
    field("restitution_right", "float", "Restitution of the right stop.", when=_GENERAL),
    field("restitution_left", "float", "Restitution of the left stop.", when=_GENERAL),
    field("bias", "float", "Factor of the bias of the request.", when=_GENERAL),
    field("forcing", "float", "Factor of the forces of the request.", when=_GENERAL),
)

PERIODIC_ORBITS = ResultSchema(
    "PeriodicOrbit",
    "A periodic motion with impacts; where `converged` is false, `reason` says why there is none.",
    (
        OMEGA,
        _CLEARANCE,
        *(one.in_result(null=True) for one in _OF_EACH),
        field("converged", "bool", "Whether an orbit was found."),
        field(
            "found_by",
            "str",
            "equations: solved for by Newton's method; simulation: simulated until it closes, because the contact "
            "rests on a stop.",
            values=("equations", "simulation"),
        ),
        field("reason", "str", "Why no orbit was found, or why it is not verified.", null=True),
        field("period", "int", "The period, as requested or found.", unit="forcing periods"),
        field("stops", "int", "Stops of the impacts in order: +1 A, -1 C.", "impact", variable="impact_stops"),
        field("phases", "float", _PHASES, "impact", "rad", variable="impact_phases"),
        field("times", "float", "The times of the impacts, from phase 0 on.", "impact", "s", variable="impact_times"),
        field("velocities", "float", _VELOCITIES, "impact", "m/s", variable="impact_velocity"),
        field(
            "sticking", _RESTS, "Rests on a stop in a period from phase 0 on; only of a simulation.", prefix="sticking_"
        ),
        field(
            "residual",
            "float",
            "Relative residual of the equations of the impacts; for a simulation, the distance between the start and "
            "the state a period later, divided by the clearance.",
            null=True,
        ),
        field("kantorovich", "float", "Newton-Kantorovich number; isolated if at most 1/2.", null=True),
        field(
            "radius",
            "float",
            "Radius within which exactly one orbit lies; phases p omega t in radians, velocities relative.",
            null=True,
        ),
        *EVIDENCE,
        deprecated("certified", VERIFIED),
        field("multipliers", "complex", "Floquet multipliers, by decreasing modulus.", "multiplier", null=True),
        field("physical", "bool", "Whether every impact velocity is directed towards its stop."),
        field(
            "contacts",
            "str",
            "Number of contacts with a stop other than the impacts.",
            values=("none", "some", "undecided", "not searched"),
        ),
        field("excess", "float", _EXCESS, unit="m", null=True),
        field("excess_phase", "float", "Phase of this maximum.", unit="rad", null=True),
        field("excess_stop", "int", "Stop of this maximum: +1 A, -1 C, 0 none."),
        field("start", STATE, "The state at phase 0; a trajectory from there follows the orbit.", prefix="start_"),
        field("motion", MOTION, "Its name.", variable="label"),
        *observed_fields((), OUTPUT),
    ),
    process="periodic-orbits",
    rows="impact",
)

BEYOND = Record(
    "Beyond",
    "An orbit near a special point, on another branch through this point.",
    (
        ADMISSIBLE,
        field(
            "request",
            Request("periodic-orbits"),
            "Its request: post it unchanged to `/v1/periodic-orbits`, or with `vary` and `range` to "
            "`/v1/orbit-branches`.",
        ),
    ),
)
_OF_GRAZE = "of grazes"
SPECIAL_POINT = Record(
    "SpecialPoint",
    "A special point of a branch.",
    (
        field(
            "type",
            "str",
            "Saddle-node, period doubling, symmetry breaking, Neimark-Sacker or graze.",
            values=BIFURCATIONS,
        ),
        field("parameter", "float", "Value of the parameter that varies.", variable=None),
        _CLEARANCE,
        OMEGA,
        RESTITUTION,
        *_VARIED,
        field("status", "str", "Whether it was solved for to round-off (converged).", values=("converged", "guess")),
        field("reason", "str", "Why it was not.", when="of guesses", variable=None),
        ADMISSIBLE.in_result(
            description="Whether the orbit there is admissible; for a graze, whether the orbits on one side are."
        ),
        field("segment", "int", "The special point lies between this point of the branch and the next."),
        field("phases", "float", _PHASES, "impact", "rad", variable=None),
        field("velocities", "float", _VELOCITIES, "impact", "m/s", variable=None),
        field("stop", "int", "The stop that is grazed: +1 A, -1 C.", when=_OF_GRAZE),
        field("phase", "float", "Forcing phase of the graze.", unit="rad", when=_OF_GRAZE),
        field("impact", "int", "Number of the impact that vanishes.", when="of grazes where an impact vanishes"),
        field(
            "beyond",
            BEYOND,
            "Orbits of other branches: with twice the period at a PD, without the symmetry at an SB, with one impact "
            "more or less at a GR.",
            "beyond",
            variable=None,
        ),
    ),
)
ORBIT_BRANCHES = ResultSchema(
    "OrbitBranch",
    "A branch of periodic motions over a parameter, in the order of the branch.",
    (
        field("parameter", "float", "The parameter that varies.", "point", coordinate=True),
        OMEGA.in_result(dims=("point",)),
        _CLEARANCE.in_result(dims=("point",)),
        RESTITUTION.in_result(dims=("point",)),
        *(one.in_result(dims=("point",)) for one in _VARIED),
        field("stops", "int", "Stops of the impacts in order: +1 A, -1 C.", "impact"),
        field("period", "int", "Period of the orbits.", unit="forcing periods", variable=None),
        field(
            "symmetric",
            "bool",
            "Whether the second half of the period is the mirror image of the first.",
            variable=None,
        ),
        field("phases", "float", _PHASES + " They are continuous along the branch.", "point impact", "rad"),
        field("velocities", "float", _VELOCITIES + " Away from the stop: a virtual impact.", "point impact", "m/s"),
        field("multipliers", "complex", "Floquet multipliers, by decreasing modulus.", "point multiplier", null=True),
        *(one.in_result(dims=("point",)) for one in EVIDENCE),
        deprecated("certified", VERIFIED.in_result(dims=("point",))),
        field("excess", "float", _EXCESS, "point", "m", null=True),
        field("residual", "float", "Relative residual of the equations of the impacts.", "point", null=True),
        field(
            "special_points",
            SPECIAL_POINT,
            "The points SN, PD, SB, NS and GR, in the order of the branch.",
            "special",
            prefix="special_",
        ),
        field(
            "ends",
            "str",
            "Why the branch is not followed beyond its first and its last point. Its motions may end before, at a GR.",
            "end",
            texts=True,
            variable=None,
        ),
        field("reason", "str", "Why there are no points.", null=True, variable=None),
        *observed_fields(("point",), output_record("OutputOfBranch", ("point",))),
    ),
    process="orbit-branches",
    rows="point",
)
