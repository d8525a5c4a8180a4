"""The results of basins and of basin-fractions."""

from __future__ import annotations

from grazemap.schema.common import CHANCE_TO_SETTLE, KINDS, NAME, SENSITIVE, SINCE, TRANSIENT_GROWTH, VERIFIED
from grazemap.schema.fields import Record, ResultSchema, deprecated, field

_CHANCE = field(
    "chance_to_settle",
    CHANCE_TO_SETTLE,
    "The chance that a motion that is called chaotic settles within ten times the periods that were watched.",
    when="where states lead to chaos",
    variable=None,
)
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
            "Mean distance of the contact coordinate from the steady motion at the initial phase of the "
            "forcing, divided by the clearance.",
            when=_KNOWN,
        ),
        field("mean_velocity", "float", "The same for the velocity, over p omega times the clearance.", when=_KNOWN),
        field("multiplier", "float", "Largest modulus of the multipliers over one period.", when=_KNOWN),
        field("lyapunov", "float", "Largest Lyapunov exponent per forcing period.", when="where it is known"),
        _VERIFIED,
        deprecated("certified", _VERIFIED),
        field("states", "int", "Initial states that lead to it."),
        field("share", "float", "Fraction of all initial states."),
    ),
)
_MEASURED = "of evenly spaced values, since version 0.3.5"
BASIN_ENTROPY = Record(
    "BasinEntropy",
    "How mixed the motions are in the boxes of a rectangle of states (Daza et al. 2016), in nats.",
    (
        field("box", "int", "Number of states along a side of a box."),
        field("boxes", "int", "Number of boxes that have states whose motion is resolved."),
        field("boundary_boxes", "int", "Number of boxes with more than one attractor."),
        field("entropy", "float", "S_b: mean entropy of the attractors in a box."),
        field("boundary_entropy", "float", "S_bb: the mean over the boundary boxes.", null=True),
        field("standard_error", "float", "Standard error of S_bb, from the spread of the boxes.", null=True),
        field(
            "fractal",
            "bool",
            "Whether S_bb exceeds log 2 by three standard errors, which smooth boundaries do not. Where it does not, "
            "the boundary may be smooth or fractal; of two attractors it never does.",
        ),
    ),
)
UNCERTAINTY = Record(
    "Uncertainty",
    "The share of uncertain states by distance, and the exponent of its power law (Grebogi et al. 1983).",
    (
        field("distance", "int", "In steps of the rectangle, along either side.", "distance", coordinate=True),
        field(
            "share",
            "float",
            "Share of the resolved states that have one within the distance which leads to another attractor.",
            "distance",
        ),
        field("exponent", "float", "alpha: slope of log share over log distance.", null=True),
        field(
            "standard_error",
            "float",
            "Standard error of the slope, from the residuals; the finite rectangle adds a bias of some hundredths.",
            null=True,
        ),
        field("boundary_dimension", "float", "Box dimension of the boundary in the rectangle: 2 - alpha.", null=True),
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
            "basin_entropy",
            BASIN_ENTROPY,
            "The entropy of the boxes.",
            when=f"{_MEASURED}, at least 5 a side",
            prefix="entropy_",
        ),
        field(
            "uncertainty",
            UNCERTAINTY,
            "The uncertainty exponent.",
            when=f"{_MEASURED}, at least 64 a side",
            prefix="uncertainty_",
        ),
        _CHANCE,
    ),
    process="basins",
    derived=(
        field("motion", "str", "The name of the motion, or its kind.", _PLANE),
        field("attractor_motion", "str", "The name of the attractor, or its kind.", "attractor"),
    ),
)

_ALONG = "attractor parameter"
_MEANS = (ATTRACTOR["mean_position"], ATTRACTOR["mean_velocity"], ATTRACTOR["multiplier"], ATTRACTOR["lyapunov"])
CONTINUED_ATTRACTOR = Record(
    "ContinuedAttractor",
    "A motion that initial states lead to at several values of a parameter; it has one name at all of them.",
    (
        ATTRACTOR["kind"],
        ATTRACTOR["label"],
        *NAME,
        field("first", "float", "The smallest value at which it was found."),
        field("last", "float", "The largest value at which it was found."),
        field("found", "int", "Number of values at which it was found."),
    ),
)
BASIN_FRACTIONS = ResultSchema(
    "BasinFractions",
    "The shares of random initial states that lead to each attractor, along one parameter.",
    (
        field("parameter", "float", "Values of the parameter that varies, increasing.", "parameter"),
        field(
            "attractors",
            CONTINUED_ATTRACTOR,
            "The motions found, in the order of the values at which they are met, then of their shares there.",
            "attractor",
            prefix="attractor_",
        ),
        field("states", "int", "Initial states that lead to the attractor; 0 where it was not found.", _ALONG),
        field("share", "float", "Fraction of all initial states.", _ALONG),
        field("share_error", "float", "Its binomial standard error.", _ALONG),
        *(one.in_result(dims=("attractor", "parameter"), null=True, when="") for one in _MEANS),
        field("verified", "bool", "Whether a periodic motion is verified for every state that leads to it.", _ALONG),
        field("unresolved", "float", "Share of the states whose motion is unresolved.", "parameter"),
        field("unresolved_error", "float", "Its binomial standard error.", "parameter"),
        field("sensitive", "float", "Share of the states whose trajectories are sensitive.", "parameter"),
        field("displacement", "float", "The range of each initial displacement.", "mass end", "m"),
        field("velocity", "float", "The range of each initial velocity.", "mass end", "m/s"),
        _CHANCE,
    ),
    process="basin-fractions",
    derived=(field("attractor_motion", "str", "The name of the attractor, or its kind.", "attractor"),),
)
