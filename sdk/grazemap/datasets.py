"""Results as xarray Datasets: dimensions, units and labels travel with the arrays. Needs the extra "xarray"."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from grazemap.errors import MissingExtra

if TYPE_CHECKING:
    import xarray

    from grazemap.results import (
        Basins,
        BifurcationCurves,
        BifurcationDiagram,
        CodimensionTwoPoints,
        DiscontinuityMapping,
        GrazingCurve,
        OrbitBranch,
        PeriodicOrbit,
        Result,
        State,
        Trajectories,
        Trajectory,
        UnfoldingDiagram,
        UnfoldingMap,
    )

_SI_UNITS = {
    "omega": "rad/s",
    "omega_error": "rad/s",
    "clearance": "m",
    "phase": "rad",
    "time": "s",
    "displacement": "m",
    "velocity": "m/s",
    "least_impact_velocity": "m/s",
    "impact_time": "s",
    "impact_phase_time": "s",
    "impact_period": "forcing periods",
    "impact_velocity": "m/s",
    "final_displacement": "m",
    "final_velocity": "m/s",
    "final_phase": "rad",
    "sticking_start": "s",
    "sticking_stop_time": "s",
    "settled_after": "forcing periods",
    "period": "forcing periods",
}
# Counts of forcing periods and angles have their unit whatever the oscillator's units are.
_ALWAYS = {"phase", "final_phase", "settled_after", "period", "impact_period"}


def dataset(result: Result) -> xarray.Dataset:
    """Return a result as a Dataset; its attributes hold the process, the version, and the request as JSON.

    A trajectory's motion is an attribute too, as JSON; a list of trajectories has the list of their motions. There the
    samples are NaN where a trajectory ended early, and impacts and intervals of sticking are columns over all of them:
    `impact_trajectory` and `interval_trajectory` are the places of their trajectories. The families of codimension-two
    points are columns of their own, one entry for each family: `family_point` is the place of its point, `family_case`
    and `family_n` name it.

    Raises
    ------
    MissingExtra
        xarray is not installed.
    """
    try:
        import xarray
    except ImportError as error:
        raise MissingExtra("to_xarray()", "xarray") from error
    variables, coordinates = _contents(result)
    attributes = {
        "process": result.process,
        "core_version": str(result.meta.get("core_version", "")),
        "request": json.dumps(result.meta.get("request", {}), sort_keys=True),
    }
    if hasattr(result, "trajectories"):
        attributes["motion"] = json.dumps([path.motion.model_dump(mode="json") for path in result.trajectories])
    elif type(result).__name__ == "Trajectory":
        attributes["motion"] = cast("Trajectory", result).motion.model_dump_json()
    made = xarray.Dataset(variables, coordinates, attributes)
    for name in made.variables:
        unit = _unit(str(name), result.units)
        if unit:
            made[name].attrs["units"] = unit
    return made


Variables = dict[str, tuple[tuple[str, ...], NDArray[Any]]]


def _unit(name: str, units: str) -> str:
    if name not in _SI_UNITS:
        return ""
    return _SI_UNITS[name] if units == "SI" or name in _ALWAYS else "nondimensional"


def _contents(result: Result) -> tuple[Variables, Variables]:
    contents = _CONTENTS.get(type(result).__name__)
    if contents is None:
        raise TypeError(f"no Dataset for a {type(result).__name__}")
    return contents(result)


def _curve(result: GrazingCurve) -> tuple[Variables, Variables]:
    names = ("clearance", "phase", "first_recurrence", "recurrence_stop")
    variables: Variables = {name: (("omega",), getattr(result, name)) for name in names}
    if result.xi is not None:
        variables["xi"] = (("omega", "order"), result.xi)
    return variables, {"omega": (("omega",), result.omega)}


def _discontinuity_mapping(result: DiscontinuityMapping) -> tuple[Variables, Variables]:
    """Return states along `state_entry`: x_1, v_1, ..., theta, named by the coordinate."""
    count = (len(result.grazing.state) - 1) // 2
    entries = [f"{name}{i}" for i in range(1, count + 1) for name in ("x", "v")]
    returns, contact = result.returns, result.next_contact
    each, onward = ("overshoot",), ("overshoot", "return")
    square = ("state_entry", "state_entry_before")
    variables: Variables = {
        **{name: ((*each, "state_entry"), getattr(result, name)) for name in ("state", "mapped", "displacement")},
        **{name: (each, getattr(result, name)) for name in ("size", "error", "error_of_second_order")},
        **{f"grazing_{name}": (("state_entry",), getattr(result.grazing, name)) for name in ("state", "beta", "gamma")},
        "grazing_vector_field": (("state_entry",), result.grazing.vector_field),
        **{name: (square, getattr(result, name)) for name in ("jacobian", "jacobian_opposite")},
        "xi": (("order",), result.xi),
        **{f"next_{name}": (each, getattr(contact, name)) for name in ("order", "stop", "margin")},
        **{f"returns_{name}": ((*onward, "state_entry"), getattr(returns, name)) for name in ("mapped", "simulated")},
        **{
            f"returns_{name}": (onward, getattr(returns, name))
            for name in ("mapped_overshoot", "simulated_overshoot", "error")
        },
        **{name: ((), np.array(getattr(result, name))) for name in ("omega", "clearance", "stop", "largest_overshoot")},
        **{name: ((), np.array(getattr(result, name))) for name in ("fitted_order", "fitted_order_of_second")},
        **{name: ((), np.array(getattr(result, name))) for name in ("first_recurrence", "recurrence_stop")},
    }
    coordinates: Variables = {
        "overshoot": (each, result.overshoot),
        "state_entry": (("state_entry",), np.array([*entries, "theta"])),
        "order": (("order",), np.arange(1, len(result.xi) + 1)),
    }
    return variables, coordinates


def _points(result: CodimensionTwoPoints) -> tuple[Variables, Variables]:
    def column(name: str, missing: float | int | bool | str) -> NDArray[Any]:
        values = (getattr(point, name) for point in result.points)
        return np.array([missing if value is None else value for value in values], dtype=type(missing))

    variables: Variables = {
        name: (("point",), column(name, missing))
        for name, missing in (
            ("clearance", np.nan),
            ("kind", ""),
            ("order", 0),
            ("active", False),
            ("multiple", 0),
            ("symmetric", False),
            ("bifurcation", ""),
            ("residual", np.nan),
            ("status", ""),
            ("omega_error", np.nan),
        )
    }
    unfoldings = [point.unfolding for point in result.points]
    for name in ("slope", "quadratic", "velocity_slope"):
        values = [None if one is None else getattr(one, name) for one in unfoldings]
        numbers = np.array([np.nan if value is None else value for value in values], dtype=np.float64)
        variables[f"unfolding_{name}"] = (("point",), numbers)
    families = [(place, family) for place, point in enumerate(result.points) for family in point.families]
    variables["family_point"] = (("family",), np.array([place for place, _ in families], dtype=np.int64))
    variables["family_case"] = (("family",), np.array([family.case for _, family in families], dtype=np.int64))
    variables["family_n"] = (("family",), np.array([family.n for _, family in families], dtype=np.int64))
    return variables, {"omega": (("point",), column("omega", np.nan))}


def _trajectory(result: Trajectory) -> tuple[Variables, Variables]:
    final = _final(result)
    variables: Variables = {
        "displacement": (("mass", "time"), result.displacement),
        "velocity": (("mass", "time"), result.velocity),
        **_events((result,)),
        "undecided": ((), np.array(result.undecided)),
        "final_displacement": (("mass",), final.displacement),
        "final_velocity": (("mass",), final.velocity),
        "final_phase": ((), np.array(final.phase)),
    }
    coordinates: Variables = {
        "time": (("time",), result.time),
        "mass": (("mass",), np.arange(1, len(result.displacement) + 1)),
        "impact_time": (("impact",), result.impacts.time),
    }
    return variables, coordinates


def _trajectories(result: Trajectories) -> tuple[Variables, Variables]:
    paths = result.trajectories
    longest = max(paths, key=lambda path: len(path.time))
    finals = [_final(path) for path in paths]

    def padded(name: str) -> NDArray[np.float64]:
        whole = np.full((len(paths), *longest.displacement.shape), np.nan)
        for place, path in enumerate(paths):
            whole[place, :, : len(path.time)] = getattr(path, name)
        return whole

    def places(lengths: list[int]) -> NDArray[np.int64]:
        return np.repeat(np.arange(len(paths)), lengths)

    variables: Variables = {
        **{name: (("trajectory", "mass", "time"), padded(name)) for name in ("displacement", "velocity")},
        **_events(paths),
        "impact_trajectory": (("impact",), places([len(path.impacts) for path in paths])),
        "interval_trajectory": (("interval",), places([len(path.sticking) for path in paths])),
        "undecided": (("trajectory",), np.array([path.undecided for path in paths])),
        "final_displacement": (("trajectory", "mass"), np.array([final.displacement for final in finals])),
        "final_velocity": (("trajectory", "mass"), np.array([final.velocity for final in finals])),
        "final_phase": (("trajectory",), np.array([final.phase for final in finals])),
    }
    coordinates: Variables = {
        "time": (("time",), longest.time),
        "mass": (("mass",), np.arange(1, len(longest.displacement) + 1)),
        "impact_time": (("impact",), np.concatenate([path.impacts.time for path in paths])),
    }
    return variables, coordinates


def _events(paths: Sequence[Trajectory]) -> Variables:
    """Return the columns of the impacts and of the intervals of sticking, one trajectory behind the other."""
    variables: Variables = {}
    for name in ("stop", "velocity", "kind", "period", "phase_time"):
        column = np.concatenate([getattr(path.impacts, name) for path in paths])
        variables[f"impact_{name}"] = (("impact",), column)
    for name in ("start", "stop_time", "stop"):
        column = np.concatenate([getattr(path.sticking, name) for path in paths])
        variables[f"sticking_{name}"] = (("interval",), column)
    return variables


def _final(result: Trajectory) -> State | SimpleNamespace:
    """Return where a trajectory ends, NaN where it has no such state."""
    nothing = np.full(len(result.displacement), np.nan)
    return result.final or SimpleNamespace(displacement=nothing, velocity=nothing, phase=np.nan)


def _diagram(result: BifurcationDiagram) -> tuple[Variables, Variables]:
    """Return stroboscopic points and impacts as columns over all values, with the parameter of each."""
    variables: Variables = {"motion": (("parameter",), np.array(result.labels()))}
    for quantity, dimension in (("displacement", "point"), ("velocity", "point"), ("impact_velocity", "impact")):
        place, column = result.points(quantity)
        variables[quantity] = ((dimension,), column)
        variables[f"{dimension}_parameter"] = ((dimension,), place)
    variables["impact_stop"] = (("impact",), np.concatenate([section.impact_stop for section in result.sections]))
    return variables, {"parameter": (("parameter",), result.parameter)}


def _basins(result: Basins) -> tuple[Variables, Variables]:
    plane = ("vertical", "horizontal")
    named = np.array([attractor.label or attractor.kind for attractor in result.attractors] + ["unresolved"])
    variables: Variables = {
        **{name: (plane, getattr(result, name)) for name in ("label", "settled_after", "lyapunov")},
        "motion": (plane, named[result.label]),
        "reason": (plane, np.array(result.reasons)[result.reason]),
        "attractor_motion": (("attractor",), named[:-1]),
        "attractor_share": (("attractor",), np.array([attractor.share for attractor in result.attractors])),
    }
    coordinates: Variables = {name: ((name,), getattr(result, name)) for name in ("horizontal", "vertical")}
    return variables, coordinates


def _curves(result: BifurcationCurves) -> tuple[Variables, Variables]:
    """Return all curves behind one another, `point_curve` being the place of a point's curve."""
    lengths = [len(curve.omega) for curve in result.curves]

    def joined(name: str) -> NDArray[np.float64]:
        return np.concatenate([np.zeros(0), *(getattr(curve, name) for curve in result.curves)])

    variables: Variables = {
        **{name: (("point",), joined(name)) for name in ("omega", "clearance", "impact_velocity")},
        "point_curve": (("point",), np.repeat(np.arange(len(lengths)), lengths)),
        "curve_type": (("curve",), np.array([curve.type for curve in result.curves], dtype="U2")),
        "curve_motion": (("curve",), np.array([curve.motion for curve in result.curves], dtype=np.str_)),
        "curve_admissible": (("curve",), np.array([curve.admissible for curve in result.curves], dtype=np.bool_)),
    }
    return variables, {}


def _unfolding_diagram(result: UnfoldingDiagram) -> tuple[Variables, Variables]:
    """Return the map, the clearances of the grazing curve, and the pairs of points at borders as columns."""
    variables, coordinates = _unfolding_map(result.unfolding_map)
    curve, borders = result.grazing_curve, result.borders
    variables["grazing_clearance"] = (("grazing_omega",), curve.clearance)
    coordinates["grazing_omega"] = (("grazing_omega",), curve.omega)
    if borders is not None:
        for name in ("row", "column", "along", "regular", "curve", "distance"):
            variables[f"border_{name}"] = (("border",), getattr(borders, name))
        variables["border_explanation"] = (("border",), np.array(borders.explanations)[borders.explanation])
        variables["border_reason"] = (("border",), np.array(borders.reasons)[borders.reason])
    return variables, coordinates


def _orbit(result: PeriodicOrbit) -> tuple[Variables, Variables]:
    """Return impacts and multipliers as columns; what is one number, or one of few words, without dimensions."""
    alone = ("omega", "clearance", "converged", "found_by", "certified", "residual", "kantorovich", "radius", "period",
             "stable", "physical", "admissible", "contacts", "excess", "excess_phase", "excess_stop")  # fmt: skip
    variables: Variables = {
        **{name: ((), np.array(getattr(result, name))) for name in alone},
        **{f"impact_{name}": (("impact",), getattr(result, name)) for name in ("stops", "phases", "times")},
        "impact_velocity": (("impact",), result.velocities),
        **{f"sticking_{name}": (("interval",), getattr(result.sticking, name)) for name in ("start", "stop_time")},
        "sticking_stop": (("interval",), result.sticking.stop),
        "multipliers_real": (("multiplier",), result.multipliers.real),
        "multipliers_imaginary": (("multiplier",), result.multipliers.imag),
        "start_displacement": (("mass",), result.start.displacement),
        "start_velocity": (("mass",), result.start.velocity),
        "label": ((), np.array(result.motion.label or result.motion.kind)),
    }
    return variables, {}


def _branch(result: OrbitBranch) -> tuple[Variables, Variables]:
    along, each = ("point",), ("point", "impact")
    variables: Variables = {
        **{
            name: (along, getattr(result, name)) for name in ("omega", "clearance", "restitution", "excess", "residual")
        },
        **{name: (along, getattr(result, name)) for name in ("stable", "admissible")},
        **{name: (each, getattr(result, name)) for name in ("phases", "velocities")},
        "multipliers_real": (("point", "multiplier"), result.multipliers.real),
        "multipliers_imaginary": (("point", "multiplier"), result.multipliers.imag),
        "stops": (("impact",), result.stops),
        "special_type": (("special",), np.array([point.type for point in result.special_points], dtype="U2")),
    }
    for name in ("clearance", "omega", "restitution"):
        values = np.array([getattr(point, name) for point in result.special_points], dtype=np.float64)
        variables[f"special_{name}"] = (("special",), values)
    return variables, {"parameter": (along, result.parameter)}


def _unfolding_map(result: UnfoldingMap) -> tuple[Variables, Variables]:
    counts = ("period", "impacts_right", "impacts_left", "settled_after")
    whole = [*counts, "symmetric", "sticking", "certified", "least_impact_velocity"]
    whole += [name for name in result.NOT_ALWAYS if getattr(result, name) is not None]
    plane = ("clearance", "omega")
    variables: Variables = {name: (plane, getattr(result, name)) for name in whole}
    variables["kind"] = (plane, np.array(result.kinds)[result.kind])
    variables["reason"] = (plane, np.array(result.reasons)[result.reason])
    variables["label"] = (plane, result.labels())
    if result.computed is not None:
        variables["computed"] = (plane, result.computed)
    return variables, {"omega": (("omega",), result.omega), "clearance": (("clearance",), result.clearance)}


_CONTENTS: dict[str, Callable[[Any], tuple[Variables, Variables]]] = {
    "GrazingCurve": _curve,
    "DiscontinuityMapping": _discontinuity_mapping,
    "CodimensionTwoPoints": _points,
    "Trajectory": _trajectory,
    "Trajectories": _trajectories,
    "BifurcationDiagram": _diagram,
    "Basins": _basins,
    "BifurcationCurves": _curves,
    "PeriodicOrbit": _orbit,
    "OrbitBranch": _branch,
    "UnfoldingMap": _unfolding_map,
    "UnfoldingDiagram": _unfolding_diagram,
}
