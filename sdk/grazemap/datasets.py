"""Results as xarray Datasets: dimensions, units and labels travel with the arrays. Needs the extra "xarray"."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.errors import MissingExtra
from grazemap.results import CodimensionTwoPoints, GrazingCurve, Result, Trajectory, UnfoldingMap

if TYPE_CHECKING:
    import xarray

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
    "impact_velocity": "m/s",
    "sticking_start": "s",
    "sticking_stop_time": "s",
    "settled_after": "forcing periods",
    "period": "forcing periods",
}
# Counts of forcing periods and angles have their unit whatever the oscillator's units are.
_ALWAYS = {"phase", "settled_after", "period"}


def dataset(result: Result) -> xarray.Dataset:
    """Return a result as a Dataset; its attributes hold the process, the version, and the request as JSON.

    A trajectory's motion is an attribute too, as JSON. The families of codimension-two points are columns of their
    own, one entry for each family: `family_point` is the place of its point, `family_case` and `family_n` name it.

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
    if isinstance(result, Trajectory):
        attributes["motion"] = result.motion.model_dump_json()
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
    match result:
        case GrazingCurve():
            names = ("clearance", "phase", "first_recurrence", "recurrence_stop")
            return {name: (("omega",), getattr(result, name)) for name in names}, {"omega": (("omega",), result.omega)}
        case CodimensionTwoPoints():
            return _points(result)
        case Trajectory():
            return _trajectory(result)
        case UnfoldingMap():
            return _unfolding_map(result)
        case _:
            raise TypeError(f"no Dataset for a {type(result).__name__}")


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
    families = [(place, family) for place, point in enumerate(result.points) for family in point.families]
    variables["family_point"] = (("family",), np.array([place for place, _ in families], dtype=np.int64))
    variables["family_case"] = (("family",), np.array([family.case for _, family in families], dtype=np.int64))
    variables["family_n"] = (("family",), np.array([family.n for _, family in families], dtype=np.int64))
    return variables, {"omega": (("point",), column("omega", np.nan))}


def _trajectory(result: Trajectory) -> tuple[Variables, Variables]:
    impacts = result.impacts
    variables: Variables = {
        "displacement": (("mass", "time"), result.displacement),
        "velocity": (("mass", "time"), result.velocity),
        "impact_stop": (("impact",), impacts.stop),
        "impact_velocity": (("impact",), impacts.velocity),
        "impact_kind": (("impact",), impacts.kind),
        "sticking_start": (("interval",), result.sticking.start),
        "sticking_stop_time": (("interval",), result.sticking.stop_time),
        "sticking_stop": (("interval",), result.sticking.stop),
    }
    coordinates: Variables = {
        "time": (("time",), result.time),
        "mass": (("mass",), np.arange(1, len(result.displacement) + 1)),
        "impact_time": (("impact",), impacts.time),
    }
    return variables, coordinates


def _unfolding_map(result: UnfoldingMap) -> tuple[Variables, Variables]:
    counts = ("period", "impacts_right", "impacts_left", "settled_after")
    whole = [*counts, "symmetric", "sticking", "multiplier", "lyapunov", "least_impact_velocity"]
    whole += [name for name in ("share", "motions_found") if getattr(result, name) is not None]
    plane = ("clearance", "omega")
    variables: Variables = {name: (plane, getattr(result, name)) for name in whole}
    variables["kind"] = (plane, np.array(result.kinds)[result.kind])
    variables["reason"] = (plane, np.array(result.reasons)[result.reason])
    variables["label"] = (plane, result.labels())
    return variables, {"omega": (("omega",), result.omega), "clearance": (("clearance",), result.clearance)}
