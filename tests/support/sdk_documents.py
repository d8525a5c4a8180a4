"""Small results of every process with every shape of field: what tests look at, and the rest as the classes have it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import numpy as np

from grazemap.codec import encode_npz
from grazemap.results import RESULTS, VERSION, ChanceToSettle, CodimensionTwoPoint, class_of, decode_result
from grazemap.results.documents import Document, array_units, document_of
from grazemap.results.fields import Field, RecordSchema
from grazemap.wire import parse_request

_SCALARS = {"float": 0.5, "int": 1, "bool": True, "str": "text"}


def example(schema: RecordSchema, sizes: Mapping[str, int] | None = None, **fields: Any) -> Document:
    """Return a document with the fields that every such result has, and with those that are given.

    Given lists become arrays of the field's type, and given records get the other fields of their class. Other arrays
    have the sizes of the given ones or `sizes`, and numbers that rise from 0.1 to 1; other lists of records are empty.
    """
    assert fields.keys() <= {field.name for field in schema}, fields.keys()
    known = dict(sizes or {})
    for field in schema:
        if field.name in fields and field.dims and not isinstance(field.type, RecordSchema):
            fields[field.name] = np.asarray(fields[field.name], dtype=field.stored_dtype)
            known |= dict(zip(field.dims, fields[field.name].shape, strict=False))
    there = (field for field in schema if field.name in fields or not (field.optional or field.stored_only))
    return {field.name: _value(field, known, fields) for field in there}


def _value(field: Field, sizes: Mapping[str, int], fields: Mapping[str, Any]) -> Any:
    if isinstance(field.type, RecordSchema):
        value = fields.get(field.name, [] if field.dims else {})
        if field.dims:
            return [example(field.type, sizes, **item) for item in value]
        return None if value is None else example(field.type, sizes, **value)
    if field.name in fields:
        return fields[field.name]
    shape = [sizes[dim] for dim in field.dims] + ([2] if field.type == "complex" else [])
    if field.dims and field.type in ("float", "complex"):
        return np.linspace(0.1, 1.0, math.prod(shape)).reshape(shape)
    single = field.values[0] if field.values else _SCALARS[str(field.type)]
    return np.full(shape, single, dtype=field.dtype or None) if field.dims else single


# The names of samples of one process that has several forms of results.
MANY = "trajectories of many"
MOTIONS = "bifurcation-curves of motions"
ONE_STOP = "grazing-curves of one stop"
CURVES_OF_ONE = "bifurcation-curves of one stop"
DIAGRAM_OF_ONE = "unfolding-diagrams of one stop"
RESTED = "periodic-orbits by simulation"
ADAPTIVE = "unfolding-maps of computed points"
AXES = "unfolding-maps of axes"
CURVES_OF_AXES = "bifurcation-curves of axes"
DIAGRAM_OF_AXES = "unfolding-diagrams of axes"

REQUESTS: dict[str, dict[str, Any]] = {}
_DOCUMENTS: dict[str, Document] = {}
_NAN = np.nan


def _sample(
    name: str, kind: str, request: dict[str, Any], sizes: Mapping[str, int] | None = None, /, **fields: Any
) -> None:
    """Keep a result of a class of results with its request under a name."""
    REQUESTS[name] = request
    _DOCUMENTS[name] = example(RESULTS[kind].schema, sizes, **fields)


_RANGE = {"start": 0.2, "stop": 0.3, "points": 3}
_RANGES = {"omega": _RANGE, "clearance": {"start": 1.5, "stop": 1.6, "points": 2}}
_WINDOW = {"omega": {"start": 0.2, "stop": 0.3}, "clearance": {"start": 1.5, "stop": 1.6}}
_OMEGA = [0.2, 0.25, 0.3]
_ORBIT = {"omega": 0.27, "clearance": 1.85, "motion": {"period": 1, "stops": [1, -1]}}
CHANCE = example(ChanceToSettle.schema, run_on=10_000, chaotic=5, sampled=4, chance=0.25, low=0.0063, high=0.8059)
UNRESOLVED = {"kind": "unresolved", "verified": False, "reason": "not closed"}


def periodic(period: int, right: int, left: int, **more: Any) -> dict[str, Any]:
    """Return the fields of a periodic motion with its counts of impacts."""
    names = {"period": period, "impacts_right": right, "impacts_left": left, "label": f"{period}-{right}r-{left}l"}
    return {"kind": "periodic", **names, "symmetric": right == left, "sticking": False, **more}


_response = {"amplitude": [1.6, 1.8, _NAN], "phase": [0.1, 0.2, _NAN], "amplitude_slope": [2.0, 4.0, _NAN]}
_sample(
    "structures",
    "Structure",
    {"omega": _RANGE, "times": [1.0, 2.0]},
    {"mass": 3, "mode": 3},
    omega=_OMEGA,
    **_response,
    harmonics=[{"harmonic": 1, **_response}],
    time=[1.0, 2.0],
)

_POINTS = (
    {
        "kind": "recurrence",
        "omega": 0.25,
        "clearance": 1.7,
        "order": 2,
        "active": True,
        "residual": 1e-16,
        "families": [{"case": 1, "n": 1}, {"case": 4, "n": 0}],
    },
    {
        "kind": "resonant",
        "omega": 0.28,
        "clearance": 1.9,
        "multiple": 1,
        "symmetric": False,
        "residual": 2e-16,
        "bifurcation": "SN",
        "unfolding": {"orbits_before": -1, "contact": "tangent", "slope": 0.0, "quadratic": 120.0},
    },
)
POINTS = [example(CodimensionTwoPoint.schema, status="simple", **point) for point in _POINTS]
_curve = {
    "omega": _OMEGA,
    "clearance": [1.5, 1.7, 2.0],
    "first_recurrence": [1, 2, 0],
    "recurrence_stop": [-1, 1, 0],
    "points": POINTS,
}
_at_a_stop = {"stop": 1, "residual": 0.0, "status": "simple", "omega_error": 1e-16}
_curve_of_stop = {
    "omega": _OMEGA,
    "clearance_right": [1.5, 1.7, 2.0],
    "phase_right": [0.1, 0.2, 0.3],
    "margin_right": [0.25, 0.05, -0.25],
    "virtual_right": [False, False, True],
    "first_recurrence_right": [2, 4, 0],
    "points": [
        {"kind": "double-graze", "omega": 0.26, "clearance": 1.75, **_at_a_stop, "amplitude_slope": 5.0, "margin": 0.0},
        {"kind": "corner", "omega": 0.27, "clearance": 1.8, **_at_a_stop, "margin": -0.05, "corner": {}},
    ],
}
_sample("grazing-curves", "GrazingCurve", {"omega": _RANGE}, **_curve)
_sample(ONE_STOP, "StopGrazingCurves", {"omega": _RANGE, "clearance": {"left": 1.75}}, **_curve_of_stop)
_sample("codimension-two-points", "CodimensionTwoPoints", {"omega": _WINDOW["omega"]}, points=POINTS)

_onward = np.tile([1e-4, 1e-5, _NAN], (2, 1))
_sample(
    "discontinuity-mappings",
    "DiscontinuityMapping",
    {"omega": 0.29, "overshoot": [1e-4, 1e-6], "stop": "left", "returns": 2},
    {"return": 3, "state_entry": 7, "state_entry_before": 7, "order": 2},
    omega=0.29,
    clearance=1.99,
    stop=-1,
    overshoot=[1e-4, 1e-6],
    error=[1e-4, 1e-6],
    fitted_order=1.0,
    next_contact={"order": [2, 0], "stop": [-1, 0]},
    returns={"mapped_overshoot": _onward, "simulated_overshoot": 2 * _onward, "error": _onward},
)

_path = {
    "time": [0.0, 10.0, 20.0, 30.0, 40.0],
    "displacement": np.zeros((3, 5)),
    "velocity": np.ones((3, 5)),
    "impacts": {
        "time": [5.0, 20.0],
        "phase_time": [5.0, 20.0],
        "stop": [1, -1],
        "velocity": [0.5, -0.25],
    },
    "sticking": {"start": []},
    "motion": periodic(1, 1, 1, verified=False, reason=None),
    "undecided": 0,
    "final": {"displacement": np.zeros(3), "velocity": np.ones(3), "phase": 0.0},
}
_early = _path | {
    "time": [0.0, 10.0],
    "displacement": [[0.1, 0.2], [0.3, 0.4], [0.5, _NAN]],
    "velocity": np.ones((3, 2)),
    "impacts": {"time": [5.0]},
    "sticking": {"start": [7.0], "stop_time": [9.0]},
    "motion": UNRESOLVED | {"reason": "too stiff"},
    "undecided": 2,
}
_before_its_record = _early | {
    "time": [],
    "displacement": np.zeros((3, 0)),
    "velocity": np.zeros((3, 0)),
    "impacts": {"time": []},
    "sticking": {"start": []},
    "final": None,
}
_trajectory = {"omega": 0.29, "clearance": 1.6, "periods": 2, "samples_per_period": 2}
_sample("trajectories", "Trajectory", _trajectory, **_path)
_sample(
    MANY,
    "Trajectories",
    _trajectory | {"initial": [{}, {"phase": 1.0}, {"velocity": [0.0, 0.0, 0.5]}]},
    trajectories=[_path, _early, _before_its_record],
)

_sample(
    "bifurcation-diagrams",
    "BifurcationDiagram",
    {"vary": "clearance", "range": _RANGES["clearance"], "omega": 0.29, "periods": 3},
    parameter=[1.5, 1.6],
    sections=[
        {
            "displacement": [0.1, 0.1, 0.1],
            "impact_velocity": [0.5, 0.5, 0.5],
            "motion": periodic(1, 1, 0, verified=False, reason=None),
            "sensitive": True,
            "transient_growth": 31.5,
        },
        {
            "displacement": [0.3, 0.4, 0.5],
            "impact_velocity": [],
            "motion": UNRESOLVED,
            "sensitive": False,
            "transient_growth": None,
        },
    ],
)

_map: dict[str, Any] = {
    "kind": [[1, 0, 1], [1, 0, 1]],
    "kinds": ["unresolved", "periodic"],
    # where the kind is "unresolved" the counts mean nothing
    "period": [[1, 9, 3], [1, 0, 1]],
    "impacts_right": [[2, 2, 4], [2, 0, -1]],
    "impacts_left": [[2, 2, 4], [2, 0, -1]],
    "symmetric": [[True, True, True], [True, False, True]],
    "sticking": [[False, False, False], [False, True, False]],
    "least_impact_velocity": [[0.1, 0.2, 0.3], [0.4, _NAN, _NAN]],
    "settled_after": [[50, -1, 70], [80, -1, 20]],
    "verified": [[True, False, True], [True, False, False]],
    "sensitive": [[False, False, False], [False, False, False]],
    "transient_growth": [[0.5, _NAN, 0.7], [0.8, _NAN, _NAN]],
    "reason": [[0, 1, 0], [0, 1, 2]],
    "reasons": ["", "not closed", "rests"],
}
_over_ranges = {"omega": _OMEGA, "clearance": [1.5, 1.6], **_map}
_over_axes = {
    "horizontal": [0.5, 0.7, 0.9],
    "vertical": [0.2, 0.3],
    "margin_right": [[-0.2, -0.2, -0.2], [0.1, 0.1, 0.1]],
    "margin_left": np.full((2, 3), _NAN),
    **_map,
}
# the two points of the last clearance and first omegas are inferred
_computed = np.array([[True, True, True], [False, False, True]])
_figures = ("least_impact_velocity", "settled_after", "verified", "sensitive", "transient_growth")
INFERRED_WRONG = {"inferred": 3, "sampled": 2, "wrong": 1, "low": 0.0126, "high": 0.9874}
_adaptive = {name: value for name, value in _over_ranges.items() if name not in _figures} | {
    "reason": [[0, 1, 0], [3, 3, 2]],
    "reasons": ["", "not closed", "rests", "not computed"],
    "computed": _computed,
    "at_computed": {name: np.array(_map[name])[_computed] for name in _figures} | {"multiplier": [0.5, _NAN, 0.6, 0.7]},
    "inferred_wrong": INFERRED_WRONG,
}
_axes = {
    "horizontal": {"vary": "restitution", "values": [0.5, 0.7, 0.9]},
    "vertical": {"vary": "omega", "values": [0.2, 0.3]},
    "clearance": {"right": 1.6},
}
_sample("unfolding-maps", "UnfoldingMap", _RANGES, **_over_ranges)
_sample(ADAPTIVE, "UnfoldingMap", _RANGES | {"adaptive": True}, **_adaptive)
_sample(AXES, "UnfoldingMap", _axes, **_over_axes)

_one_impact = {"motion": "1-1r-(-1)l", "period": 1, "impacts_right": 1, "impacts_left": -1, "symmetric": False}
_steady = {"motion": "1-(-1)r-(-1)l", "period": 1, "impacts_right": -1, "impacts_left": -1, "symmetric": True}
_two_each = {"motion": "1-2r-2l", "period": 1, "impacts_right": 2, "impacts_left": 2, "symmetric": True}
_line = {"omega": _OMEGA, "clearance": [1.5, 1.55, 1.6]}
_crossed = {"omega": [0.2, 0.25], "clearance": [1.5, 1.55]}
_window_of_axes = {"horizontal": [0.6, 0.7], "vertical": [0.25, 0.3]}
_impacts = {"stops": [1], "phases": [[0.5], [0.6]], "velocities": [[0.1], [0.2]], "of_motion": 0}
_continued = {**_one_impact, "type": "PD", "stop": 0, **_impacts, "impact": None, "ends": ["window", "window"]}
_followed = {"period": 1, "stops": [1], "label": "1-1r-(-1)l", "reason": None}
_of_four = {
    **_crossed,
    **_two_each,
    "stops": [1, 1, -1, -1],
    "phases": [[0.5, 1.0, 3.5, 4.0], [0.6, 1.1, 3.6, 4.1]],
    "velocities": [[0.1, 0.2, -0.1, -0.2], [0.1, 0.0, -0.1, 0.0]],
    "of_motion": 0,
}
_curves = {
    "curves": [
        {**_one_impact, **_line, "type": "SN", "stop": 0, "ends": ["window", "grazing"]},
        {**_one_impact, **_line, "type": "GR", "stop": -1, "ends": ["window", "none"]},
        {**_one_impact, **_line, "type": "PD", "stop": 0, "ends": ["admissible", "none"], "admissible": False},
    ],
}
_curves_of_axes = {
    "curves": [_continued | _window_of_axes],
    "motions": [_followed | {"horizontal": 0.6, "vertical": 0.25}],
}
_motion = {"motions": [{"period": 1, "stops": [1]}]}
_sample("bifurcation-curves", "BifurcationCurves", _WINDOW, **_curves)
_sample(
    MOTIONS,
    "BifurcationCurves",
    _WINDOW | {"motions": [{"period": 1, "stops": [1, 1, -1, -1]}, {"period": 1, "stops": [1, 1, 1]}]},
    curves=[
        {**_of_four, "type": "NS", "stop": 0, "impact": None, "ends": ["real", "window"]},
        {**_of_four, "type": "GR", "stop": 1, "impact": 1, "ends": ["window", "admissible"]},
    ],
    motions=[
        {"stops": [1, 1, -1, -1], "omega": 0.25, "clearance": 1.55, "label": "1-2r-2l", "reason": None},
        {"stops": [1, 1, 1], "omega": None, "clearance": None, "label": None, "admissible": False, "reason": "not met"},
    ],
)
_sample(
    CURVES_OF_ONE,
    "BifurcationCurves",
    _WINDOW | {"clearance": {"right": _WINDOW["clearance"], "left": None}} | _motion,
    curves=[_continued | _crossed | {"clearance_right": [1.5, 1.55], "clearance_left": [_NAN, _NAN]}],
    motions=[_followed | {"omega": 0.25, "clearance": 1.55}],
)
_sample(
    CURVES_OF_AXES,
    "BifurcationCurves",
    {
        "horizontal": {"vary": "restitution", "values": {"start": 0.5, "stop": 0.9}},
        "vertical": {"vary": "omega", "values": {"start": 0.2, "stop": 0.3}},
        "clearance": {"right": 1.6},
        "max_multiple": 1,
    },
    **_curves_of_axes,
)


def _borders(line: Mapping[str, Any], admissible: list[bool]) -> dict[str, Any]:
    """Return borders of the map; `admissible` is where the curve that explains two of them is."""
    ends = {"ends": ["window", "window"]}
    return {
        "row": [0, 0, 0, 1],
        "column": [0, 1, 0, 1],
        "along": [0, 0, 1, 1],
        "regular": [True, True, True, False],
        "explanation": [1, 2, 0, 3],
        "reason": [0, 0, 1, 0],
        "curve": [1, -1, -1, -1],
        "distance": [0.25, _NAN, _NAN, _NAN],
        "explanations": ["unexplained", "curve", "coexistence", "goes on"],
        "reasons": ["", "no orbit"],
        "curves": [
            {**_steady, **line, **ends, "type": "GR", "pairs": 0, "admissible": [True, True, True]},
            {**_one_impact, **line, **ends, "type": "SN", "pairs": 1, "admissible": admissible},
        ],
        "irregular_pairs": 2,
    }


_diagram = {
    "unfolding_map": _over_ranges,
    "codimension_two_points": {"points": POINTS},
    "bifurcation_curves": _curves,
    "borders": _borders(_line, [True, False, True]),
}
_sample("unfolding-diagrams", "UnfoldingDiagram", _RANGES, **_diagram, grazing_curve=_curve)
_sample(
    DIAGRAM_OF_ONE,
    "UnfoldingDiagram",
    _RANGES | {"clearance": {"right": _RANGES["clearance"], "left": 1.75}},
    **_diagram,
    stop_grazing_curves=_curve_of_stop,
)
_sample(
    DIAGRAM_OF_AXES,
    "UnfoldingDiagram",
    _axes | {"borders": True, "max_multiple": 1},
    unfolding_map=_over_axes,
    grazing_curves=[{"stop": 1, "horizontal": [0.5, 0.9], "vertical": [0.24, 0.24], "admissible": [True, True]}],
    bifurcation_curves=_curves_of_axes,
    borders=_borders({"horizontal": [0.5, 0.7, 0.9], "vertical": [0.2, 0.25, 0.3]}, [True, True, False]),
)

_twin = periodic(1, 2, 1, multiplier=0.5, lyapunov=-0.7, mean_velocity=0.0)
_coordinates = {
    "horizontal": {"quantity": "displacement", "mass": 1, "values": {"start": -1.0, "stop": 1.0, "points": 3}},
    "vertical": {"quantity": "velocity", "mass": 2, "values": [-0.5, 0.5]},
}
_sample(
    "basins",
    "Basins",
    {"omega": 0.29, "clearance": 1.6, **_coordinates},
    horizontal=[-1.0, 0.0, 1.0],
    vertical=[-0.5, 0.5],
    label=[[0, 0, 1], [2, -1, 0]],
    attractors=[
        {**_twin, "mean_position": 0.25, "states": 3, "share": 0.5},
        {**_twin, "mean_position": -0.25, "states": 1, "share": 1 / 6},
        {"kind": "chaotic", "lyapunov": 0.1, "verified": False, "states": 1, "share": 1 / 6},
    ],
    settled_after=[[9, 8, 7], [-1, -1, 6]],
    lyapunov=[[-0.7, -0.7, -0.7], [0.1, _NAN, -0.7]],
    sensitive=[[False, False, False], [False, False, False]],
    reason=[[0, 0, 0], [0, 1, 0]],
    reasons=["", "not closed"],
    basin_entropy={"box": 5, "entropy": 0.2, "boundary_entropy": 0.8},
    uncertainty={"distance": [1, 2, 4], "share": [0.1, 0.2, 0.4], "exponent": 1.0, "standard_error": 0.0},
    chance_to_settle=CHANCE,
)
_states = np.array([[8, 4], [0, 2], [0, 1]])
_known = [[0.1, _NAN], [_NAN, -0.1], [_NAN, _NAN]]
_sample(
    "basin-fractions",
    "BasinFractions",
    {"vary": "clearance", "range": _RANGES["clearance"], "omega": 0.29, "states": 8},
    {"mass": 3, "end": 2},
    parameter=[1.5, 1.6],
    attractors=[
        {**periodic(1, 2, 1), "first": 1.5, "last": 1.6, "found": 2},
        {**periodic(1, 2, 1), "first": 1.6, "last": 1.6, "found": 1},
        {"kind": "chaotic", "label": None, "first": 1.6, "last": 1.6, "found": 1},
    ],
    states=_states,
    share=_states / 8,
    **dict.fromkeys(("mean_position", "mean_velocity", "multiplier", "lyapunov"), _known),
    unresolved=[0.0, 0.125],
    sensitive=[0.0, 0.25],
    chance_to_settle=CHANCE,
)

_solved: dict[str, Any] = {
    "omega": 0.27,
    "clearance": 1.85,
    "reason": None,
    "stops": [1, -1],
    "phases": [0.5, 0.5 + np.pi],
    "velocities": [0.25, -0.25],
    "stable": False,
    "verified": False,
    "multipliers": [[0.5, 0.25], [0.5, -0.25], [-1.5, 0.0]],
    "excess": -0.5,
    "sticking": {"start": []},
    "start": {"displacement": [1.0, 0.0, 0.0], "velocity": [0.1, 0.2, 0.3], "phase": 0.0},
    "motion": periodic(1, 1, 1, verified=False),
}
_by_simulation = {"verified": False, "reason": "found by simulation"}
_sample("periodic-orbits", "PeriodicOrbit", _ORBIT, **_solved)
_sample(
    RESTED,  # mass 1 rests on a stop
    "PeriodicOrbit",
    {"omega": 0.27, "clearance": 0.85},
    **_solved
    | {
        **dict.fromkeys(("kantorovich", "radius", "excess", "excess_phase"), _NAN),
        **_by_simulation,
        "found_by": "simulation",
        "sticking": {"start": [3.0, 14.0], "stop_time": [5.0, 16.0], "stop": [1, -1]},
        "isolated": False,
        "stable": True,
        "motion": periodic(1, 1, 1, **_by_simulation) | {"sticking": True},
    },
)

_beyond = {
    "oscillator": {"masses": [1.0, 10.0, 10.0], "restitution": 0.8, "damping": 0.05},
    "omega": 0.27,
    "clearance": 1.86,
    "motion": {"period": 1, "stops": [1, -1], "phases": [0.5, 3.5], "velocities": [0.1, -0.2]},
}
_special = {"omega": 0.27, "restitution": 0.8, "segment": 2, "reason": None}
_special |= {"clearance": 1.89, "phases": [0.5, 0.5 + np.pi], "velocities": [0.1, -0.1]}
_sample(
    "orbit-branches",
    "OrbitBranch",
    _ORBIT | {"range": {"start": 1.8, "stop": 1.9}},
    {"multiplier": 6},
    parameter=[1.8, 1.85, 1.88, 1.86],
    omega=[0.27] * 4,
    clearance=[1.8, 1.85, 1.88, 1.86],
    restitution=[0.8] * 4,
    stops=[1, -1],
    phases=np.add.outer([0.5, 0.6, 0.7, 0.8], [0.0, np.pi]),
    velocities=np.outer([0.3, 0.25, 0.1, -0.05], [1.0, -1.0]),
    multipliers=np.ones((4, 6, 2)),
    admissible=[True, True, True, False],
    stable=[True, True, False, False],
    verified=[True, True, False, False],
    excess=[-0.1, -0.1, -0.05, 0.1],
    special_points=[
        {**_special, "type": "SN", "parameter": 1.885, "status": "guess", "reason": "it was not solved for"},
        {
            **_special,
            "type": "GR",
            "parameter": 1.87,
            "stop": -1,
            "phase": 2.5,
            "impact": 0,
            "beyond": [{"admissible": True, "request": _beyond}, {"admissible": False, "request": _beyond}],
        },
    ],
    ends=["a parameter reaches the end of its range", "steps become too short"],
    reason=None,
)

_sample(
    "proofs",
    "Proof",
    {"statement": {"kind": "codimension-two", "type": "g", "order": 2, "range": {"start": 0.282, "stop": 0.283}}},
    kind="codimension-two",
    verdict="undecided",
    reason="rests",
    certificate=json.dumps({"verdict": "undecided", "statement": {"kind": "codimension-two"}}),
    shown="{}",
)

DRAWN = [name for name in REQUESTS if name != "proofs"]
"""All but proofs, which have no picture."""


def document(sample: str) -> Document:
    """Return a result's document as the workers make it."""
    return deepcopy(_DOCUMENTS[sample])


def npz(sample: str, extra: dict[str, Any] | None = None, units: str = "nondimensional") -> bytes:
    """Return a result as the service sends it, with some fields changed."""
    return _encoded(sample, document(sample), extra or {}, units)


def _encoded(sample: str, whole: Document, extra: Mapping[str, Any], units: str = "nondimensional") -> bytes:
    process = sample.split()[0]
    kind = class_of(process, whole)
    encoded = document_of(kind, **whole)
    request = parse_request(process, REQUESTS[sample]).canonical()
    meta = {
        "process": process,
        "schema": VERSION,
        "request": {**request, "oscillator": {**request["oscillator"], "units": units}},
        "core_version": "1",
        "numerics": {},
        "units": units,
        "notes": [],
        "array_units": array_units(kind.schema, encoded, units),
    }
    return encode_npz({**encoded, **extra}, meta)


def result_of(sample: str, extra: dict[str, Any] | None = None) -> Any:
    """Return the result that a client makes of it."""
    return decode_result(npz(sample, extra))


def in_si(sample: str) -> Any:
    """Return the result that a client makes of it, in SI."""
    return decode_result(npz(sample, units="SI"))


def result_like(kind: str, sizes: Mapping[str, int] | None = None, /, **fields: Any) -> Any:
    """Return a result of a class with the request of its process's sample, and fields as by `example`."""
    schema = RESULTS[kind].schema
    return decode_result(_encoded(schema.process, example(schema, sizes, **fields), {}))
