"""Small results with every shape of field.

Values that tests look at are written by hand; others follow from the type of their field (`example`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from grazemap.codec import encode_npz
from grazemap.results import VERSION, DiscontinuityMapping, PeriodicOrbit, Structure, class_of
from grazemap.results.documents import Document, document_of
from grazemap.results.fields import Field, RecordSchema
from grazemap.wire import canonical, parse_request

REQUESTS: dict[str, dict[str, Any]] = {
    "structures": {"omega": {"start": 0.2, "stop": 0.3, "points": 3}, "times": [1.0, 2.0]},
    "grazing-curves": {"omega": {"start": 0.2, "stop": 0.3, "points": 3}},
    "codimension-two-points": {"omega": {"start": 0.2, "stop": 0.3}},
    "discontinuity-mappings": {"omega": 0.29, "overshoot": [1e-4, 1e-6], "stop": "C", "returns": 2},
    "trajectories": {"omega": 0.29, "clearance": 1.6, "periods": 2, "samples_per_period": 2},
    "unfolding-maps": {
        "omega": {"start": 0.2, "stop": 0.3, "points": 3},
        "clearance": {"start": 1.5, "stop": 1.6, "points": 2},
    },
    "unfolding-diagrams": {
        "omega": {"start": 0.2, "stop": 0.3, "points": 3},
        "clearance": {"start": 1.5, "stop": 1.6, "points": 2},
    },
    "bifurcation-diagrams": {"vary": "clearance", "range": [1.5, 1.6], "omega": 0.29, "periods": 3},
    "periodic-orbits": {"omega": 0.27, "clearance": 1.85, "motion": {"period": 1, "stops": [1, -1]}},
    "proofs": {
        "statement": {"kind": "codimension-two", "type": "g", "order": 2, "range": {"start": 0.282, "stop": 0.283}}
    },
    "orbit-branches": {
        "omega": 0.27,
        "clearance": 1.85,
        "motion": {"period": 1, "stops": [1, -1]},
        "range": {"start": 1.8, "stop": 1.9},
    },
    "bifurcation-curves": {"omega": {"start": 0.2, "stop": 0.3}, "clearance": {"start": 1.5, "stop": 1.6}},
    "basins": {
        "omega": 0.29,
        "clearance": 1.6,
        "horizontal": {"quantity": "displacement", "mass": 1, "values": {"start": -1.0, "stop": 1.0, "points": 3}},
        "vertical": {"quantity": "velocity", "mass": 2, "values": [-0.5, 0.5]},
    },
    "basin-fractions": {
        "vary": "clearance",
        "range": [1.5, 1.6],
        "omega": 0.29,
        "states": 8,
    },
}

POINTS: list[dict[str, Any]] = [
    {
        "kind": "recurrence",
        "omega": 0.25,
        "clearance": 1.7,
        "order": 2,
        "active": True,
        "families": [{"case": 1, "n": 1}, {"case": 4, "n": 0}],
        "residual": 1e-16,
        "status": "simple",
    },
    {
        "kind": "resonant",
        "omega": 0.28,
        "clearance": 1.9,
        "multiple": 1,
        "symmetric": False,
        "bifurcation": "SN",
        "residual": 2e-16,
        "status": "simple",
        "unfolding": {
            "orbits_before": -1,
            "orbits_after": 1,
            "curve_omega": 1,
            "curve_clearance": 1,
            "contact": "tangent",
            "slope": 0.0,
            "quadratic": 120.0,
            "velocity_slope": 3.0,
            "transversality": 0.5,
            "admissible": True,
            "margin": 0.25,
        },
    },
]


CHANCE: dict[str, Any] = {
    "watched": 1000,
    "run_on": 10_000,
    "chaotic": 5,
    "sampled": 4,
    "settled": 1,
    "chance": 0.25,
    "low": 0.0063,
    "high": 0.8059,
}
"""The chance of chaotic motions to settle, in results that have such motions."""

MANY = "trajectories of many"
"""The process trajectories asked with a list of states."""
MOTIONS = "bifurcation-curves of motions"
"""The process bifurcation-curves asked with motions."""
REQUESTS[MOTIONS] = {
    **REQUESTS["bifurcation-curves"],
    "motions": [{"period": 1, "stops": [1, 1, -1, -1]}, {"period": 1, "stops": [1, 1, 1]}],
}
ONE_STOP = "grazing-curves of one stop"
"""The process grazing-curves where the other stop is fixed."""
REQUESTS[ONE_STOP] = {**REQUESTS["grazing-curves"], "clearance": {"left": 1.75}}
CURVES_OF_ONE = "bifurcation-curves of one stop"
"""The process bifurcation-curves asked with a motion, where the clearance of one stop varies."""
REQUESTS[CURVES_OF_ONE] = {
    **REQUESTS["bifurcation-curves"],
    "clearance": {"right": REQUESTS["bifurcation-curves"]["clearance"], "left": None},
    "motions": [{"period": 1, "stops": [1]}],
}
DIAGRAM_OF_ONE = "unfolding-diagrams of one stop"
"""The process unfolding-diagrams where the other stop is fixed."""
REQUESTS[DIAGRAM_OF_ONE] = {
    **REQUESTS["unfolding-diagrams"],
    "clearance": {"right": REQUESTS["unfolding-diagrams"]["clearance"], "left": 1.75},
}
RESTED = "periodic-orbits by simulation"
"""The process periodic-orbits where mass 1 rests on a stop."""
REQUESTS[RESTED] = {"omega": 0.27, "clearance": 0.85}
ADAPTIVE = "unfolding-maps of computed points"
"""The process unfolding-maps asked for an adaptive map."""
REQUESTS[ADAPTIVE] = {**REQUESTS["unfolding-maps"], "adaptive": True}
AXES = "unfolding-maps of axes"
"""The process unfolding-maps asked for other parameters than omega and clearance."""
REQUESTS[AXES] = {
    "horizontal": {"vary": "restitution", "values": [0.5, 0.7, 0.9]},
    "vertical": {"vary": "omega", "values": [0.2, 0.3]},
    "clearance": {"right": 1.6},
}
CURVES_OF_AXES = "bifurcation-curves of axes"
"""The process bifurcation-curves asked for a motion and other parameters, those of `AXES`."""
REQUESTS[CURVES_OF_AXES] = {
    "horizontal": {"vary": "restitution", "values": {"start": 0.5, "stop": 0.9}},
    "vertical": {"vary": "omega", "values": {"start": 0.2, "stop": 0.3}},
    "clearance": {"right": 1.6},
    "max_multiple": 1,
}
DIAGRAM_OF_AXES = "unfolding-diagrams of axes"
"""The process unfolding-diagrams asked for other parameters, those of `AXES`."""
REQUESTS[DIAGRAM_OF_AXES] = {**REQUESTS[AXES], "borders": True, "max_multiple": 1}
REQUESTS[MANY] = {**REQUESTS["trajectories"], "initial": [{}, {"phase": 1.0}, {"velocity": [0.0, 0.0, 0.5]}]}


DRAWN = [name for name in REQUESTS if name != "proofs"]
"""All but proofs, which have no picture."""


def document(process: str) -> dict[str, Any]:
    """Return a result's document as the workers make it."""
    return {
        "structures": _structure,
        "grazing-curves": _curve,
        ONE_STOP: _stop_curves,
        "codimension-two-points": lambda: {"points": POINTS},
        "discontinuity-mappings": _mapping,
        "trajectories": _trajectory,
        "trajectories of many": _trajectories,
        "bifurcation-diagrams": _diagram,
        "unfolding-maps": _map,
        ADAPTIVE: _adaptive_map,
        AXES: _map_of_axes,
        "unfolding-diagrams": _unfolding_diagram,
        "basins": _basins,
        "basin-fractions": _fractions,
        "bifurcation-curves": _curves,
        "bifurcation-curves of motions": _curves_of_motions,
        CURVES_OF_ONE: _curves_of_one_stop,
        DIAGRAM_OF_ONE: _diagram_of_one_stop,
        CURVES_OF_AXES: _curves_of_axes,
        DIAGRAM_OF_AXES: _diagram_of_axes,
        "periodic-orbits": _orbit,
        "periodic-orbits by simulation": _rested,
        "orbit-branches": _branch,
        "proofs": _proof,
    }[process]()


def npz(process: str, extra: dict[str, Any] | None = None) -> bytes:
    """Return a result as the service sends it."""
    name = process.split()[0]
    request = canonical(parse_request(name, REQUESTS[process]))
    meta = {
        "process": name,
        "schema": VERSION,
        "request": request,
        "core_version": "1",
        "numerics": {},
        "units": "nondimensional",
        "notes": [],
    }
    made = document(process)
    full = document_of(class_of(name, made), **made)
    return encode_npz({**full, **(extra or {})}, meta)


def example(record: RecordSchema, sizes: Mapping[str, int], **given: Any) -> Document:
    """Return a document with the fields that every such result has, and with those that are given.

    Arrays have the sizes of their dimensions; their numbers rise from 0.1 to 1. Lists of records are empty.
    """
    made: Document = {}
    for one in record:
        single = isinstance(one.type, RecordSchema) and not one.dims
        if one.name in given:
            made[one.name] = given.pop(one.name)
        elif not one.optional and not one.stored_only:
            made[one.name] = {} if single else _example_of(one, [sizes.get(dim, 0) for dim in one.dims])
        if single and isinstance(made.get(one.name), dict):
            made[one.name] = example(one.type, sizes, **made[one.name])
    assert not given
    return made


def _example_of(one: Field, shape: list[int]) -> Any:
    if isinstance(one.type, RecordSchema):
        return []
    single = {"float": 0.5, "int": 1, "bool": True, "str": "text"}[str(one.type)]
    single = one.values[0] if one.values else single
    if not one.dims:
        return single
    if one.type == "float":
        return np.linspace(0.1, 1.0, math.prod(shape)).reshape(shape)
    return np.full(shape, single, dtype=one.dtype or None)


def _mapping() -> Document:
    onward = np.tile(np.array([1e-4, 1e-5, np.nan]), (2, 1))
    return example(
        DiscontinuityMapping.schema,
        {"overshoot": 2, "return": 3, "state_entry": 7, "state_entry_before": 7, "order": 2},
        omega=0.29,
        clearance=1.99,
        stop=-1,
        grazing={"acceleration": 0.17},
        overshoot=np.array([1e-4, 1e-6]),
        error=np.array([1e-4, 1e-6]),
        error_of_second_order=np.array([1e-5, 1e-7]),
        fitted_order=1.0,
        fitted_order_of_second=1.5,
        next_contact={"order": np.array([2, 0]), "stop": np.array([-1, 0])},
        returns={"mapped_overshoot": onward, "simulated_overshoot": 2 * onward, "error": onward},
    )


def _orbit() -> Document:
    motion = {"kind": "periodic", "period": 1, "impacts_right": 1, "impacts_left": 1, "symmetric": True}
    return example(
        PeriodicOrbit.schema,
        {"mass": 3},
        omega=0.27,
        clearance=1.85,
        reason=None,
        stops=np.array([1, -1]),
        phases=np.array([0.5, 0.5 + np.pi]),
        times=np.array([1.0, 12.0]),
        velocities=np.array([0.25, -0.25]),
        stable=False,
        verified=False,
        multipliers=np.array([[0.5, 0.25], [0.5, -0.25], [-1.5, 0.0]]),
        excess=-0.5,
        excess_phase=2.0,
        excess_stop=-1,
        start={"displacement": np.array([1.0, 0.0, 0.0]), "velocity": np.array([0.1, 0.2, 0.3]), "phase": 0.0},
        motion={**motion, "sticking": False, "label": "1-1r-1l", "verified": False},
    )


def _proof() -> dict[str, Any]:
    certificate = {"verdict": "undecided", "statement": {"kind": "codimension-two"}}
    return {
        "kind": "codimension-two",
        "verdict": "undecided",
        "reason": "rests",
        "limited": False,
        "certificate": json.dumps(certificate),
        "shown": "{}",
    }


def _rested() -> dict[str, Any]:
    rests = {"start": np.array([3.0, 14.0]), "stop_time": np.array([5.0, 16.0]), "stop": np.array([1, -1])}
    unknown = dict.fromkeys(("kantorovich", "radius", "excess", "excess_phase"), np.nan)
    said = {"verified": False, "reason": "found by simulation"}
    orbit = _orbit()
    motion = {**orbit["motion"], "sticking": True, **said}
    return {
        **orbit,
        "found_by": "simulation",
        "sticking": rests,
        "isolated": False,
        "stable": True,
        **unknown,
        **said,
        "motion": motion,
    }


def _branch() -> dict[str, Any]:
    graze = {"clearance": 1.89, "omega": 0.27, "restitution": 0.8, "status": "converged", "admissible": True}
    graze |= {"segment": 2, "reason": None}
    request = {
        "oscillator": {"masses": [1.0, 10.0, 10.0], "restitution": 0.8, "damping": 0.05},
        "omega": 0.27,
        "clearance": 1.86,
        "motion": {"period": 1, "stops": [1, -1], "phases": [0.5, 3.5], "velocities": [0.1, -0.2]},
    }
    impacts = {"phases": np.array([0.5, 0.5 + np.pi]), "velocities": np.array([0.1, -0.1])}
    nothing = {"stop": None, "phase": None, "impact": None}
    guess = {"status": "guess", "reason": "it was not solved for"}
    return {
        "parameter": np.array([1.8, 1.85, 1.88, 1.86]),
        "omega": np.full(4, 0.27),
        "clearance": np.array([1.8, 1.85, 1.88, 1.86]),
        "restitution": np.full(4, 0.8),
        "stops": np.array([1, -1]),
        "period": 1,
        "symmetric": True,
        "phases": np.array([[0.5], [0.6], [0.7], [0.8]]) + np.array([0.0, np.pi]),
        "velocities": np.array([[0.3], [0.25], [0.1], [-0.05]]) * np.array([1.0, -1.0]),
        "multipliers": np.ones((4, 6, 2)),
        "isolated": np.array([True, True, True, True]),
        "admissible": np.array([True, True, True, False]),
        "stable": np.array([True, True, False, False]),
        "verified": np.array([True, True, False, False]),
        "excess": np.array([-0.1, -0.1, -0.05, 0.1]),
        "residual": np.full(4, 1e-16),
        "special_points": [
            {"type": "SN", "parameter": 1.885, **graze, **impacts, **nothing, **guess, "beyond": []},
            {
                "type": "GR",
                "parameter": 1.87,
                **graze,
                **impacts,
                "stop": -1,
                "phase": 2.5,
                "impact": 0,
                "beyond": [{"admissible": True, "request": request}, {"admissible": False, "request": request}],
            },
        ],
        "ends": np.array(["a parameter reaches the end of its range", "steps become too short"]),
        "reason": None,
    }


def _curves() -> dict[str, Any]:
    one = {"period": 1, "impacts_right": 1, "impacts_left": -1, "motion": "1-1r-(-1)l", "symmetric": False, "stop": 0}
    line = {"omega": np.array([0.2, 0.25, 0.3]), "clearance": np.array([1.5, 1.55, 1.6])}
    speed = {"impact_velocity": np.array([0.1, 0.05, 0.0])}
    return {
        "curves": [
            {**one, "type": "SN", "admissible": True, **line, **speed, "ends": ["window", "grazing"]},
            {**one, "type": "GR", "admissible": True, **line, **speed, "ends": ["window", "none"], "stop": -1},
            {**one, "type": "PD", "admissible": False, **line, **speed, "ends": ["admissible", "none"]},
        ],
        "motions": [],
    }


def _curves_of_one_stop() -> dict[str, Any]:
    one = {"period": 1, "impacts_right": 1, "impacts_left": -1, "motion": "1-1r-(-1)l", "symmetric": False, "stop": 0}
    line = {"omega": np.array([0.2, 0.25]), "clearance": np.array([1.5, 1.55])}
    impacts = {"stops": [1], "phases": np.array([[0.5], [0.6]]), "velocities": np.array([[0.1], [0.2]])}
    sides = {"clearance_right": line["clearance"], "clearance_left": np.array([np.nan, np.nan])}
    rest = {**line, **sides, **impacts, "impact_velocity": np.array([0.1, 0.2]), "of_motion": 0, "admissible": True}
    found = {"period": 1, "stops": [1], "omega": 0.25, "clearance": 1.55, "label": "1-1r-(-1)l", "reason": None}
    return {
        "curves": [{**one, "type": "PD", **rest, "impact": None, "ends": ["window", "window"]}],
        "motions": [{**found, "admissible": True}],
    }


def _diagram_of_one_stop() -> dict[str, Any]:
    whole = _unfolding_diagram()
    del whole["grazing_curve"]
    return {**whole, "stop_grazing_curves": _stop_curves()}


def _curves_of_axes() -> dict[str, Any]:
    whole = _curves_of_one_stop()
    (curve,), (motion,) = whole["curves"], whole["motions"]
    for one in (curve, motion):
        del one["omega"], one["clearance"]
    del curve["clearance_right"], curve["clearance_left"]
    curve |= {"horizontal": np.array([0.6, 0.7]), "vertical": np.array([0.25, 0.3])}
    return {"curves": [curve], "motions": [{**motion, "horizontal": 0.6, "vertical": 0.25}]}


def _diagram_of_axes() -> dict[str, Any]:
    line = {"horizontal": np.array([0.5, 0.9]), "vertical": np.array([0.24, 0.24])}
    borders = _unfolding_diagram()["borders"]
    for curve in borders["curves"]:
        del curve["omega"], curve["clearance"]
        curve |= {"horizontal": np.array([0.5, 0.7, 0.9]), "vertical": np.array([0.2, 0.25, 0.3])}
        curve["admissible"] = np.array([True, True, False])
    return {
        "unfolding_map": _map_of_axes(),
        "grazing_curves": [{"stop": 1, **line, "admissible": np.array([True, True])}],
        "bifurcation_curves": _curves_of_axes(),
        "borders": borders,
    }


def _curves_of_motions() -> dict[str, Any]:
    four = {"period": 1, "impacts_right": 2, "impacts_left": 2, "motion": "1-2r-2l", "symmetric": True}
    line = {"omega": np.array([0.2, 0.25]), "clearance": np.array([1.5, 1.55])}
    impacts = {
        "stops": [1, 1, -1, -1],
        "phases": np.array([[0.5, 1.0, 3.5, 4.0], [0.6, 1.1, 3.6, 4.1]]),
        "velocities": np.array([[0.1, 0.2, -0.1, -0.2], [0.1, 0.0, -0.1, 0.0]]),
    }
    rest = {**line, "impact_velocity": np.array([0.1, 0.05]), **impacts, "of_motion": 0, "admissible": True}
    lost = {"omega": None, "clearance": None, "label": None, "admissible": False, "reason": "not met"}
    return {
        "curves": [
            {**four, "type": "NS", "stop": 0, **rest, "impact": None, "ends": ["real", "window"]},
            {**four, "type": "GR", "stop": 1, **rest, "impact": 1, "ends": ["window", "admissible"]},
        ],
        "motions": [
            {
                "period": 1,
                "stops": [1, 1, -1, -1],
                "omega": 0.25,
                "clearance": 1.55,
                "label": "1-2r-2l",
                "admissible": True,
                "reason": None,
            },
            {"period": 1, "stops": [1, 1, 1], **lost},
        ],
    }


def _diagram() -> dict[str, Any]:
    unknown = dict.fromkeys(("period", "impacts_right", "impacts_left", "symmetric", "sticking", "label"))
    periodic = {"kind": "periodic", "period": 1, "impacts_right": 1, "impacts_left": 0, "symmetric": False}
    return {
        "parameter": np.array([1.5, 1.6]),
        "sections": [
            {
                "displacement": np.array([0.1, 0.1, 0.1]),
                "velocity": np.array([0.2, 0.2, 0.2]),
                "impact_velocity": np.array([0.5, 0.5, 0.5]),
                "impact_stop": np.array([1, 1, 1], dtype=np.int8),
                "motion": {**periodic, "sticking": False, "label": "1-1r-0l", "verified": False, "reason": None},
                "sensitive": True,
                "transient_growth": 31.5,
            },
            {
                "displacement": np.array([0.3, 0.4, 0.5]),
                "velocity": np.array([0.6, 0.7, 0.8]),
                "impact_velocity": np.array([]),
                "impact_stop": np.array([], dtype=np.int8),
                "motion": {**unknown, "kind": "unresolved", "verified": False, "reason": "not closed"},
                "sensitive": False,
                "transient_growth": None,
            },
        ],
    }


def _unfolding_diagram() -> dict[str, Any]:
    return {
        "unfolding_map": _map(),
        "grazing_curve": _curve(),
        "codimension_two_points": {"points": POINTS},
        "bifurcation_curves": _curves(),
        "borders": {
            "row": np.array([0, 0, 0, 1]),
            "column": np.array([0, 1, 0, 1]),
            "along": np.array([0, 0, 1, 1]),
            "regular": np.array([True, True, True, False]),
            "explanation": np.array([1, 2, 0, 3]),
            "reason": np.array([0, 0, 1, 0]),
            "curve": np.array([1, -1, -1, -1]),
            "distance": np.array([0.25, np.nan, np.nan, np.nan]),
            "explanations": np.array(["unexplained", "curve", "coexistence", "goes on"]),
            "reasons": np.array(["", "no orbit"]),
            "curves": [
                {**_STEADY, **_LINE, "type": "GR", "pairs": 0, "admissible": np.array([True, True, True])},
                {**_ONE_STOP, **_LINE, "type": "SN", "pairs": 1, "admissible": np.array([True, False, True])},
            ],
            "without_orbit": 1,
            "irregular_pairs": 2,
        },
    }


_LINE = {
    "omega": np.array([0.2, 0.25, 0.3]),
    "clearance": np.array([1.5, 1.55, 1.6]),
    "ends": ["window", "window"],
}
_STEADY = {"motion": "1-(-1)r-(-1)l", "period": 1, "impacts_right": -1, "impacts_left": -1, "symmetric": True}
_ONE_STOP = {"motion": "1-1r-(-1)l", "period": 1, "impacts_right": 1, "impacts_left": -1, "symmetric": False}


def _basins() -> dict[str, Any]:
    periodic = {"kind": "periodic", "symmetric": False, "sticking": False, "multiplier": 0.5, "lyapunov": -0.7}
    chaos = {"kind": "chaotic", "label": None, "multiplier": None, "lyapunov": 0.1, "verified": False}
    one = {"verified": True, **periodic, "label": "1-2r-1l", "period": 1, "impacts_right": 2, "impacts_left": 1}
    return {
        "horizontal": np.array([-1.0, 0.0, 1.0]),
        "vertical": np.array([-0.5, 0.5]),
        "label": np.array([[0, 0, 1], [2, -1, 0]], dtype=np.int16),
        "attractors": [
            {**one, "mean_position": 0.25, "mean_velocity": 0.0, "states": 3, "share": 0.5},
            {**one, "mean_position": -0.25, "mean_velocity": 0.0, "states": 1, "share": 1 / 6},
            {**chaos, "states": 1, "share": 1 / 6},
        ],
        "settled_after": np.array([[9, 8, 7], [-1, -1, 6]], dtype=np.int32),
        "lyapunov": np.array([[-0.7, -0.7, -0.7], [0.1, np.nan, -0.7]]),
        "reason": np.array([[0, 0, 0], [0, 1, 0]], dtype=np.int8),
        "reasons": np.array(["", "not closed"]),
        "basin_entropy": {
            "box": 5,
            "boxes": 40,
            "boundary_boxes": 10,
            "entropy": 0.2,
            "boundary_entropy": 0.8,
            "standard_error": 0.01,
            "fractal": True,
        },
        "uncertainty": {
            "distance": np.array([1, 2, 4]),
            "share": np.array([0.1, 0.2, 0.4]),
            "exponent": 1.0,
            "standard_error": 0.0,
            "boundary_dimension": 1.0,
        },
        "chance_to_settle": CHANCE,
    }


def _fractions() -> dict[str, Any]:
    name = {"kind": "periodic", "period": 1, "symmetric": False, "sticking": False}
    nothing = np.array([[0.1, np.nan], [np.nan, -0.1], [np.nan, np.nan]])
    states = np.array([[8, 4], [0, 2], [0, 1]])
    share = states / 8
    return {
        "parameter": np.array([1.5, 1.6]),
        "attractors": [
            {**name, "label": "1-2r-1l", "impacts_right": 2, "impacts_left": 1, "first": 1.5, "last": 1.6, "found": 2},
            {**name, "label": "1-2r-1l", "impacts_right": 2, "impacts_left": 1, "first": 1.6, "last": 1.6, "found": 1},
            {"kind": "chaotic", "label": None, "first": 1.6, "last": 1.6, "found": 1},
        ],
        "states": states,
        "share": share,
        "share_error": np.sqrt(share * (1 - share) / 8),
        **dict.fromkeys(("mean_position", "mean_velocity", "multiplier", "lyapunov"), nothing),
        "verified": states > 2,
        "unresolved": np.array([0.0, 0.125]),
        "unresolved_error": np.array([0.0, 0.1169]),
        "sensitive": np.array([0.0, 0.25]),
        "displacement": np.array([[-1.0, 1.0], [0.0, 0.0], [0.0, 0.5]]),
        "velocity": np.tile([-0.4, 0.4], (3, 1)),
        "chance_to_settle": CHANCE,
    }


def _structure() -> Document:
    response = {
        "amplitude": np.array([1.6, 1.8, np.nan]),
        "phase": np.array([0.1, 0.2, np.nan]),
        "amplitude_slope": np.array([2.0, 4.0, np.nan]),
    }
    return example(
        Structure.schema,
        {"mass": 3, "mode": 3},
        natural_frequencies=np.array([0.25, 1.0, 1.2]),
        contact_weights=np.array([0.3, 0.8, 0.4]),
        omega=np.array([0.2, 0.25, 0.3]),
        **response,
        harmonics=[{"harmonic": 1, **response}],
        time=np.array([1.0, 2.0]),
        impulse_response=np.array([0.8, 0.4]),
    )


_CORNER = {
    "phase_before": -1.5,
    "phase_after": 1.6,
    "slope_before": 4.0,
    "slope_after": 6.0,
    "recurrence_before": 2,
    "recurrence_after": 1,
}


def _stop_curves() -> dict[str, Any]:
    return {
        "contact_equilibrium": 0.0,
        "omega": np.array([0.2, 0.25, 0.3]),
        "clearance_right": np.array([1.5, 1.7, 2.0]),
        "phase_right": np.array([0.1, 0.2, 0.3]),
        "margin_right": np.array([0.25, 0.05, -0.25]),
        "virtual_right": np.array([False, False, True]),
        "first_recurrence_right": np.array([2, 4, 0]),
        "points": [
            {"kind": "double-graze", "omega": 0.26, "clearance": 1.75, "residual": 0.0, "status": "simple"}
            | {"omega_error": 1e-16, "stop": 1, "amplitude_slope": 5.0, "margin": 0.0},
            {"kind": "corner", "omega": 0.27, "clearance": 1.8, "residual": 0.0, "status": "simple"}
            | {"omega_error": 1e-16, "stop": 1, "margin": -0.05, "corner": _CORNER},
        ],
    }


def _curve() -> dict[str, Any]:
    return {
        "omega": np.array([0.2, 0.25, 0.3]),
        "clearance": np.array([1.5, 1.7, 2.0]),
        "phase": np.array([0.1, 0.2, 0.3]),
        "first_recurrence": np.array([1, 2, 0]),
        "recurrence_stop": np.array([-1, 1, 0]),
        "points": POINTS,
    }


def _trajectory() -> dict[str, Any]:
    return {
        "time": np.array([0.0, 10.0, 20.0, 30.0, 40.0]),
        "displacement": np.zeros((3, 5)),
        "velocity": np.ones((3, 5)),
        "impacts": {
            "time": np.array([5.0, 20.0]),
            "period": np.array([0, 0]),
            "phase_time": np.array([5.0, 20.0]),
            "stop": np.array([1, -1], dtype=np.int8),
            "velocity": np.array([0.5, -0.25]),
            "kind": np.array(["impact", "impact"]),
        },
        "sticking": {"start": np.zeros(0), "stop_time": np.zeros(0), "stop": np.zeros(0, dtype=np.int8)},
        "motion": {
            "kind": "periodic",
            "period": 1,
            "impacts_right": 1,
            "impacts_left": 1,
            "symmetric": True,
            "sticking": False,
            "label": "1-1r-1l",
            "verified": False,
            "reason": None,
        },
        "undecided": 0,
        "final": {"displacement": np.zeros(3), "velocity": np.ones(3), "phase": 0.0},
    }


def _trajectories() -> dict[str, Any]:
    """Return what a list of states is answered with; the second trajectory ended early, the third before its record."""
    whole = _trajectory()
    early = {
        **whole,
        "time": whole["time"][:2],
        "displacement": np.array([[0.1, 0.2], [0.3, 0.4], [0.5, np.nan]]),
        "velocity": whole["velocity"][:, :2],
        "impacts": {name: values[:1] for name, values in whole["impacts"].items()},
        "sticking": {"start": np.array([7.0]), "stop_time": np.array([9.0]), "stop": np.array([1], dtype=np.int8)},
        "motion": {**dict.fromkeys(whole["motion"]), "kind": "unresolved", "verified": False, "reason": "too stiff"},
        "undecided": 2,
    }
    none = {
        **early,
        "time": np.zeros(0),
        "displacement": np.zeros((3, 0)),
        "velocity": np.zeros((3, 0)),
        "impacts": {name: values[:0] for name, values in whole["impacts"].items()},
        "sticking": whole["sticking"],
        "final": None,
    }
    return {"trajectories": [whole, early, none]}


def _map() -> dict[str, Any]:
    return {
        "omega": np.array([0.2, 0.25, 0.3]),
        "clearance": np.array([1.5, 1.6]),
        "kind": np.array([[1, 0, 1], [1, 0, 1]], dtype=np.int8),
        "kinds": np.array(["unresolved", "periodic"]),
        # where the kind is "unresolved" the counts mean nothing
        "period": np.array([[1, 9, 3], [1, 0, 1]], dtype=np.int32),
        "impacts_right": np.array([[2, 2, 4], [2, 0, -1]], dtype=np.int32),
        "impacts_left": np.array([[2, 2, 4], [2, 0, -1]], dtype=np.int32),
        "symmetric": np.array([[True, True, True], [True, False, True]]),
        "sticking": np.array([[False, False, False], [False, True, False]]),
        "least_impact_velocity": np.array([[0.1, 0.2, 0.3], [0.4, np.nan, np.nan]]),
        "settled_after": np.array([[50, -1, 70], [80, -1, 20]], dtype=np.int32),
        "verified": np.array([[True, False, True], [True, False, False]]),
        "reason": np.array([[0, 1, 0], [0, 1, 2]], dtype=np.int8),
        "reasons": np.array(["", "not closed", "rests"]),
    }


def _map_of_axes() -> dict[str, Any]:
    found = _map()
    del found["omega"], found["clearance"]
    return found | {
        "horizontal": np.array([0.5, 0.7, 0.9]),
        "vertical": np.array([0.2, 0.3]),
        "margin_right": np.array([[-0.2, -0.2, -0.2], [0.1, 0.1, 0.1]]),
        "margin_left": np.full((2, 3), np.nan),
    }


INFERRED_WRONG: dict[str, Any] = {"inferred": 3, "sampled": 2, "wrong": 1, "low": 0.0126, "high": 0.9874}


def _adaptive_map() -> dict[str, Any]:
    """The same map with four computed points; the two of the last clearance and first omegas are inferred."""
    whole = _map()
    computed = np.array([[True, True, True], [False, False, True]])
    figures = ("least_impact_velocity", "settled_after", "verified")
    whole["reason"] = np.array([[0, 1, 0], [3, 3, 2]], dtype=np.int8)
    whole["reasons"] = np.array(["", "not closed", "rests", "not computed"])
    at_computed = {name: whole.pop(name)[computed] for name in figures} | {
        "multiplier": np.array([0.5, np.nan, 0.6, 0.7])
    }
    return {**whole, "computed": computed, "at_computed": at_computed, "inferred_wrong": INFERRED_WRONG}
