"""The result of unfolding-maps."""

from __future__ import annotations

from grazemap.schema.common import (
    CHANCE_TO_SETTLE,
    CLEARANCE,
    IMPACTS_LEFT,
    IMPACTS_RIGHT,
    KINDS,
    OMEGA,
    PERIOD,
    SENSITIVE,
    SINCE,
    STICKING,
    SYMMETRIC,
    TRANSIENT_GROWTH,
    VERIFIED,
)
from grazemap.schema.fields import Field, Record, ResultSchema, deprecated, field
from grazemap.schema.observables import OBSERVABLES, observed_fields, output_record

PLANE = ("vertical", "horizontal")
_IN_JSON = "in JSON"
_FULL, _ADAPTIVE = "of maps that are not adaptive", "of adaptive maps"
_OF_RANGES, _OF_AXES = "of maps over ranges of omega and clearance", "of maps with axes"
_PREVIEW, _ENSEMBLE = "of maps that are not previews", "of ensembles"
# When a value is a field of the map itself.
_WHEN_FULL = {
    "": _FULL,
    SINCE: f"{_FULL}, {SINCE}",
    _PREVIEW: "of maps that are neither previews nor adaptive",
    _ENSEMBLE: "of ensembles that are not adaptive",
}


def _of_plane(one: Field, **more: object) -> Field:
    return one.in_result(dims=PLANE, **more)


_CAPTURED = VERIFIED.in_result(
    description="The orbit is isolated, admissible and stable, with the minimum period; it captures the trajectory, "
    "which is not sensitive."
)
_VERIFIED = _of_plane(_CAPTURED, when=_FULL)
_FIGURES = (
    field(
        "multiplier",
        "float",
        "Largest modulus of the multipliers over one period of a periodic motion.",
        null=True,
        when=_PREVIEW,
    ),
    field(
        "lyapunov",
        "float",
        "Largest Lyapunov exponent per forcing period: ln(multiplier)/n for a periodic motion, otherwise measured; "
        "null where it was not measured, and where all perturbations vanish.",
        null=True,
        when=_PREVIEW,
    ),
    field(
        "lyapunov_error",
        "float",
        "Standard error of an exponent that was measured along the trajectory, from its spread between windows.",
        null=True,
        when=_PREVIEW,
    ),
    field(
        "least_impact_velocity",
        "float",
        "Minimum impact speed of a periodic motion with impacts; 0 in complete chatter.",
        unit="m/s",
        null=True,
    ),
    field(
        "settled_after",
        "int",
        "Forcing periods after which the trajectory had settled, or was close enough for its orbit to be solved for; "
        "-1 unless periodic.",
        unit="forcing periods",
        dtype="int32",
    ),
    field(
        "share", "float", "Fraction of the initial states that lead to this motion or its mirror image.", when=_ENSEMBLE
    ),
    field(
        "motions_found",
        "int",
        "Number of different motions found; mirror images count once.",
        dtype="int32",
        when=_ENSEMBLE,
    ),
    _CAPTURED,
    SENSITIVE,
    TRANSIENT_GROWTH,
)
AT_COMPUTED = Record(
    "FiguresAtComputedPoints",
    "The values at the computed points of an adaptive map, in the order of the rows of `computed`.",
    (
        *(one.in_result(dims=("computed_point",)) for one in _FIGURES),
        deprecated("certified", _CAPTURED.in_result(dims=("computed_point",))),
    ),
)

MOTION_SHARE = Record(
    "MotionShare",
    "One motion of an unfolding map and how much of the map it covers.",
    (
        field("label", "str", "The name n-p_r-q_l as plain text, or the kind of a motion that is not periodic."),
        field("kind", "str", "The kind of the motion.", values=KINDS),
        *(one.in_result(null=True) for one in (PERIOD, IMPACTS_RIGHT, IMPACTS_LEFT)),
        field("pixels", "int", "Points of the map with this motion."),
        field("share", "float", "Their fraction of all points."),
        field("colour", "str", "Its colour in the picture of the map, #RRGGBB; grey for the smallest ones."),
    ),
)
INFERRED_WRONG = Record(
    "InferredWrong",
    "How many of the inferred points of an adaptive map are wrong, from a random sample of them that was computed.",
    (
        field(
            "inferred",
            "int",
            "Number of points that were inferred to have a motion, or to be chaotic, before the sample was computed.",
        ),
        field("sampled", "int", "Number of points in the sample, which are computed points of the map."),
        field("wrong", "int", "Number of them that have another motion, or are unresolved or sensitive."),
        field("low", "float", "Lower end of the 95 % interval of the share of wrong ones (Clopper & Pearson)."),
        field("high", "float", "Upper end of the interval."),
    ),
)
UNFOLDING_MAPS = ResultSchema(
    "UnfoldingMap",
    "The motion that each point of a rectangle of the plane settles to.",
    (
        OMEGA.in_result(dims=("omega",), when=_OF_RANGES),
        CLEARANCE.in_result(dims=("clearance",), when=_OF_RANGES),
        field("horizontal", "float", "Values of the horizontal parameter.", "horizontal", when=_OF_AXES, variable=None),
        field("vertical", "float", "Values of the vertical parameter.", "vertical", when=_OF_AXES, variable=None),
        *(
            field(
                f"margin_{side}",
                "float",
                f"Gap of the {side} stop from the steady motion, 0 on its grazing curve; null for an absent stop. That "
                "motion exists without impacts where no margin is negative.",
                " ".join(PLANE),
                unit="m",
                null=True,
                when=_OF_AXES,
            )
            for side in ("right", "left")
        ),
        field(
            "kind",
            "int",
            "Whether the motion is unresolved, periodic, quasi-periodic or chaotic.",
            " ".join(PLANE),
            dtype="int8",
            index_of="kinds",
        ),
        field("kinds", "str", "The names of the kinds.", "kind", texts=True, variable=None),
        _of_plane(PERIOD, dtype="int32"),
        _of_plane(IMPACTS_RIGHT, dtype="int32"),
        _of_plane(IMPACTS_LEFT, dtype="int32"),
        _of_plane(SYMMETRIC),
        _of_plane(STICKING),
        *(_of_plane(one, when=_WHEN_FULL[one.when]) for one in _FIGURES),
        deprecated("certified", _VERIFIED),
        field(
            "resolved",
            "bool",
            "Whether the point is sensitive and its motion was decided in more digits.",
            " ".join(PLANE),
            when="of maps with resolve_sensitive",
        ),
        field(
            "reason",
            "int",
            "Why a motion is unresolved, or is periodic and not verified.",
            " ".join(PLANE),
            dtype="int8",
            index_of="reasons",
        ),
        field("reasons", "str", "The reasons.", "reason", texts=True, variable=None),
        field(
            "computed",
            "bool",
            "Whether the point was computed, or inferred from its neighbours.",
            " ".join(PLANE),
            when=_ADAPTIVE,
        ),
        field("at_computed", AT_COMPUTED, "The values at computed points only.", when=_ADAPTIVE, variable=None),
        field(
            "inferred_wrong",
            INFERRED_WRONG,
            "How many of the inferred points are wrong.",
            when=f"of adaptive maps with inferred motions, {SINCE}",
            variable=None,
        ),
        field(
            "chance_to_settle",
            CHANCE_TO_SETTLE,
            "The chance that a motion that is called chaotic settles within ten times the periods that were watched.",
            when="of maps with chaotic points",
            variable=None,
        ),
        *observed_fields(PLANE, output_record("OutputOfMap", PLANE)),
    ),
    process="unfolding-maps",
    roles={"vertical": "clearance", "horizontal": "omega"},
    derived=(field("label", "str", "The name of the motion, or its kind.", " ".join(PLANE)),),
    in_json=(
        field("motions", MOTION_SHARE, "The motions of the map, the largest share first.", "motion", when=_IN_JSON),
        field("motion", "int", "The motion of the point.", " ".join(PLANE), index_of="motions", when=_IN_JSON),
    ),
)

TILE_OF_BASINS = Record(
    "TileOfBasins",
    "The motions that the initial states of a part of the rectangle lead to, before attractors are distinguished; of "
    "basin fractions those at some values of the parameter, for some states.",
    (
        *(
            one.in_result(index_of="")
            for one in UNFOLDING_MAPS.fields
            if one.dims == PLANE and not one.replaces and one.name not in ("computed", "resolved", *OBSERVABLES)
        ),
        field("mean_position", "float", "As for an attractor.", " ".join(PLANE), null=True),
        field("mean_velocity", "float", "As for an attractor.", " ".join(PLANE), null=True),
    ),
)
