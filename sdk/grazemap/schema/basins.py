"""The result of basins."""

from __future__ import annotations

from grazemap.schema.common import CHANCE_TO_SETTLE, KINDS, NAME, SENSITIVE, SINCE, TRANSIENT_GROWTH, VERIFIED
from grazemap.schema.fields import Record, ResultSchema, deprecated, field

_PLANE, _KNOWN = "vertical horizontal", "of periodic motions"
_CAPTURED = VERIFIED.in_result(
    description="The state leads to an orbit that is verified and captures the trajectory, which is not sensitive.",
    when=SINCE,
)
_VERIFIED = VERIFIED.in_result(description="Whether a periodic motion is verified for every state that leads to it.")

ATTRACTOR = Record(
    "Attractor",
    "A motion that initial states lead to; those that are not periodic are distinguished by their kind only.",
    (
        field("kind", "str", "The kind of the motion.", values=KINDS[:-1]),
        field("label", "str", "The name n-p_r-q_l as plain text.", when=_KNOWN),
        *NAME,
        field(
            "mean_position",
            "float",
            "Mean displacement of mass 1 from the steady motion at the initial phase of the forcing, divided by the "
            "clearance.",
            when=_KNOWN,
        ),
        field("mean_velocity", "float", "The same for the velocity, over omega times the clearance.", when=_KNOWN),
        field("multiplier", "float", "Largest modulus of the multipliers over one period.", when=_KNOWN),
        field("lyapunov", "float", "Largest Lyapunov exponent per forcing period.", when="where it is known"),
        _VERIFIED,
        deprecated("certified", _VERIFIED),
        field("states", "int", "Initial states that lead to it."),
        field("share", "float", "Fraction of all initial states."),
    ),
)
BASINS = ResultSchema(
    "Basins",
    "The motion that every initial state of a rectangle leads to, at one point of the plane of omega and clearance.",
    (
        field("horizontal", "float", "Values of the first initial coordinate.", "horizontal"),
        field("vertical", "float", "Values of the second initial coordinate.", "vertical"),
        field("label", "int", "Position in `attractors`; -1 where the motion is unresolved.", _PLANE, dtype="int16"),
        field("attractors", ATTRACTOR, "The motions found, the most frequent first.", "attractor", prefix="attractor_"),
        field(
            "settled_after",
            "int",
            "Forcing periods after which the trajectory had settled; -1 where the motion is not periodic.",
            _PLANE,
            "forcing periods",
            dtype="int32",
        ),
        field("lyapunov", "float", "Largest Lyapunov exponent per forcing period.", _PLANE, null=True),
        *(one.in_result(dims=("vertical", "horizontal")) for one in (_CAPTURED, SENSITIVE, TRANSIENT_GROWTH)),
        field(
            "reason",
            "int",
            "Why a state is unresolved, or leads to a periodic motion that is not verified.",
            _PLANE,
            dtype="int8",
            index_of="reasons",
        ),
        field("reasons", "str", "The reasons.", "reason", texts=True, variable=None),
        field(
            "chance_to_settle",
            CHANCE_TO_SETTLE,
            "The chance that a motion that is called chaotic settles within ten times the periods that were watched.",
            when="where states lead to chaos",
            variable=None,
        ),
    ),
    process="basins",
    derived=(
        field("motion", "str", "The name of the motion, or its kind.", _PLANE),
        field("attractor_motion", "str", "The name of the attractor, or its kind.", "attractor"),
    ),
)
