"""The results of bifurcation-curves and unfolding-diagrams."""

from __future__ import annotations

from grazemap.schema.common import (
    ADMISSIBLE,
    BIFURCATIONS,
    CLEARANCE,
    IMPACTS_LEFT,
    IMPACTS_RIGHT,
    OMEGA,
    PERIOD,
    SYMMETRIC,
)
from grazemap.schema.fields import Record, ResultSchema, field
from grazemap.schema.grazing import CODIMENSION_TWO_POINTS, GRAZING_CURVES, STOP_GRAZING_CURVES
from grazemap.schema.maps import UNFOLDING_MAPS

_ASKED = "of continued curves"
_FOUND = "where an orbit was found"
_ENDS = field(
    "ends",
    "str",
    "The reason for each end: window, grazing (the curve meets the grazing curve), admissible (the admissibility "
    "changes), none (no such motions beyond); for continued curves also closed, real (two multipliers become real), "
    "step (impacts coincide, or orbits are not smooth), singular (curves meet), points (their maximum number).",
    "end",
    texts=True,
    variable=None,
)
_MOTION = (
    field(
        "type", "str", "Saddle-node, period doubling, symmetry breaking, Neimark-Sacker or graze.", values=BIFURCATIONS
    ),
    field("motion", "str", "Name n-p_r-q_l of the motion that ends there, as plain text."),
    PERIOD,
    IMPACTS_RIGHT,
    IMPACTS_LEFT,
    SYMMETRIC,
)
_OF_RANGES, _OF_AXES = "of windows of omega and clearance", "of windows with axes"
_DIAGRAM_OF_RANGES = "of diagrams over ranges of omega and clearance"
_OF_VARIED = "Clearance: of both stops, or of the stop that varies."
_LINE = (
    OMEGA.in_result(dims=("point",), when=_OF_RANGES),
    CLEARANCE.in_result(dims=("point",), when=_OF_RANGES, description=_OF_VARIED),
    field("horizontal", "float", "Values of the horizontal parameter.", "point", when=_OF_AXES),
    field("vertical", "float", "Values of the vertical parameter.", "point", when=_OF_AXES),
)
_ONE_VARIES = f"of continued curves {_OF_RANGES}, where the clearance of one stop varies"

CURVE = Record(
    "BifurcationCurve",
    "A piece of a curve inside the window.",
    (
        *_MOTION,
        ADMISSIBLE.in_result(description="Whether the orbits are admissible; otherwise the piece is not a border."),
        field("stop", "int", "Stop of a graze: +1 A, -1 C; 0 for other types."),
        *_LINE,
        field(
            "impact_velocity",
            "float",
            "Minimum impact speed, except that of an impact that vanishes.",
            "point",
            "m/s",
        ),
        _ENDS,
        field("of_motion", "int", "Position of the motion in `motions`.", when=_ASKED),
        field("impact", "int", "Number of the impact that vanishes.", when="of grazes where an impact vanishes"),
        field("stops", "int", "Stops of all impacts: +1 A, -1 C.", "impact", when=_ASKED, texts=True, variable=None),
        *(
            field(
                f"clearance_{side}",
                "float",
                f"Clearance of the {side} stop, null if there is none.",
                "point",
                "m",
                when=_ONE_VARIES,
                null=True,
                variable=None,
            )
            for side in ("right", "left")
        ),
        field("phases", "float", "Phases omega t of the impacts.", "point impact", "rad", when=_ASKED, variable=None),
        field("velocities", "float", "Impact velocities, signed.", "point impact", "m/s", when=_ASKED, variable=None),
    ),
)
FOLLOWED_MOTION = Record(
    "FollowedMotion",
    "A motion whose curves are continued, and the orbit from which the search started.",
    (
        PERIOD,
        field("stops", "int", "Stops of its impacts: +1 A, -1 C.", "impact", texts=True, variable=None),
        OMEGA.in_result(when=f"{_OF_RANGES}, {_FOUND}"),
        CLEARANCE.in_result(when=f"{_OF_RANGES}, {_FOUND}", description=_OF_VARIED),
        field("horizontal", "float", "Value of the horizontal parameter.", when=f"{_OF_AXES}, {_FOUND}"),
        field("vertical", "float", "Value of the vertical parameter.", when=f"{_OF_AXES}, {_FOUND}"),
        field("label", "str", "The name n-p_r-q_l as plain text.", when=_FOUND),
        ADMISSIBLE,
        field("reason", "str", "Why no orbit was found.", when="where no orbit was found"),
    ),
)
BIFURCATION_CURVES = ResultSchema(
    "BifurcationCurves",
    "Bifurcation curves in a window of omega and clearance, or of two other parameters.",
    (
        field("curves", CURVE, "The pieces inside the window.", "curve", prefix="curve_"),
        field(
            "motions",
            FOLLOWED_MOTION,
            "The motions whose curves are continued, in order; none for curves in closed form.",
            "motion",
            variable=None,
        ),
    ),
    process="bifurcation-curves",
)

BORDER_CURVE = Record(
    "BorderCurve",
    "A curve that explains borders of a map; between symmetric stops mirror images count as one motion, named with "
    "more impacts first.",
    (
        *_MOTION,
        *_LINE,
        ADMISSIBLE.in_result(dims=("point",)),
        field("pairs", "int", "Number of pairs of neighbouring points that it explains."),
        _ENDS,
    ),
)
MAP_BORDERS = Record(
    "MapBorders",
    "The borders of a map's regions: pairs of neighbouring points with different motions; between symmetric stops "
    "mirror images are one.",
    (
        field("row", "int", "Row of the first point of a pair.", "border"),
        field("column", "int", "Column of the same point.", "border"),
        field(
            "along",
            "int",
            "0: the other point has the next larger vertical value, 1: the next larger horizontal one.",
            "border",
        ),
        field("regular", "bool", "Whether both motions are periodic.", "border"),
        field(
            "explanation",
            "int",
            "curve: one of the motions ends between the points; coexistence: both motions exist at both points, stable "
            "and admissible; goes on: only one motion of the pair is periodic, and it exists at the other point too.",
            "border",
            index_of="explanations",
        ),
        field("reason", "int", "Why a pair is unexplained.", "border", index_of="reasons"),
        field("explanations", "str", "The explanations.", "explanation", texts=True, variable=None),
        field("reasons", "str", "The reasons.", "reason", texts=True, variable=None),
        field("curve", "int", "Position in `curves`; -1: none.", "border"),
        field(
            "distance",
            "float",
            "Distance of the curve from the middle between the points, in steps of the map.",
            "border",
            null=True,
        ),
        field("curves", BORDER_CURVE, "The curves.", "curve", variable=None),
        field(
            "without_orbit",
            "int",
            "Number of points with a periodic motion for which no orbit was found.",
            variable=None,
        ),
        field(
            "irregular_pairs",
            "int",
            "Number of further pairs, of two different kinds, neither of which is periodic.",
            variable=None,
        ),
    ),
)
PLANE_GRAZES = Record(
    "GrazingCurveOfPlane",
    "A curve of a plane of any two parameters on which the steady motion touches a stop.",
    (
        field("stop", "int", "The stop that is touched: +1 right, or both where they are alike; -1 left."),
        field("horizontal", "float", "Values of the horizontal parameter.", "point"),
        field("vertical", "float", "Values of the vertical parameter.", "point"),
        field("admissible", "bool", "Whether the steady motion does not reach beyond the other stop.", "point"),
    ),
)
UNFOLDING_DIAGRAMS = ResultSchema(
    "UnfoldingDiagram",
    "An unfolding map from rest and the results drawn over it, each equal to that of its own process.",
    (
        field("unfolding_map", UNFOLDING_MAPS, "The map."),
        field(
            "grazing_curve",
            GRAZING_CURVES,
            "The curve, at 400 values of omega, or two for each column of the map.",
            when=f"{_DIAGRAM_OF_RANGES}, where the stops are grazed at once",
            prefix="grazing_",
        ),
        field(
            "stop_grazing_curves",
            STOP_GRAZING_CURVES,
            "The curves of the stops, at as many values of omega.",
            when=f"{_DIAGRAM_OF_RANGES}, where the stops are not alike",
            prefix="grazing_",
        ),
        field(
            "grazing_curves",
            PLANE_GRAZES,
            "The curves on which the steady motion touches a stop.",
            "graze",
            when="of diagrams with axes",
            variable=None,
        ),
        field(
            "codimension_two_points",
            CODIMENSION_TWO_POINTS,
            "The points on the grazing curve.",
            when=_DIAGRAM_OF_RANGES,
            variable=None,
        ),
        field(
            "bifurcation_curves",
            BIFURCATION_CURVES,
            "The curves of motions with one impact.",
            when="over omega and a parameter of the stops or the forces",
            variable=None,
        ),
        field(
            "borders",
            MAP_BORDERS,
            "The borders of the map's regions, each with its explanation.",
            when="with borders",
            prefix="border_",
        ),
    ),
    process="unfolding-diagrams",
    roles=UNFOLDING_MAPS.roles,
    derived=UNFOLDING_MAPS.derived,
)
