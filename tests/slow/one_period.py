"""The same machine written twice: its forces as harmonics of their own frequency, and as p times these at omega.

`python -m tests.slow.one_period` (make one-period) computes every process for ten systems and p = 2, 3 and 4, and
compares the results of both ways of writing. Frequencies and phases of the second are those of the first over p. With a
power of two that is exact, and results are equal to the bit; with 3 they agree in every label that is verified, and in
numbers to FIGURES, or to what their condition leaves: the multipliers of an orbit with thirteen impacts, one of them
slow, change by hundreds of times the relative change of a stiffness.
"""

from __future__ import annotations

import copy
import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from grazemap.codec import Document
from grazemap.wire import parse_request
from grazemap_worker.processes import IMPLEMENTATIONS

FIGURES = 1e-12
"""Largest difference with p = 3 of numbers of condition 1, relative to the largest entry of an array."""
BACKWARD = 64 * np.finfo(float).eps
"""Numbers of a worse condition may be those of a machine whose stiffnesses differ by this, relatively."""
_NUDGE = 1e-9  # of the stiffnesses: far above round-off, and well within what is linear

# omega t of the request's omega, and frequencies; others of these names are those of a force, or have their own rules
_OF_CONTACT = ("phase", "phase_right", "phase_left", "phase_before", "phase_after")
_PHASES = (*_OF_CONTACT, "phases", "excess_phase")
_FREQUENCIES = ("omega", "omega_error")
# derivatives by omega
_SLOPES = {"amplitude_slope": 1, "slope_before": 1, "slope_after": 1, "slope": 1, "velocity_slope": 1, "quadratic": 2}


# differences of displacements, which are of the size of 1
_GAPS = ("excess", "margin", "margin_right", "margin_left")
# points of a curve that are not as far apart as its steps
_STEP = 1e-6
_ROUNDING = ("residual", "omega_error", "kantorovich", "radius", "error", "fitted_order", "fitted_order_of_second")


def computed(process: str, body: Document) -> Document:
    """Return the document of a request, computed as a worker does."""
    request, how = parse_request(process, body), IMPLEMENTATIONS[process]
    if how.whole is not None:
        return how.whole(request, lambda done, total: None)
    assert how.tile is not None
    assert how.assembled is not None
    plan = IMPLEMENTATIONS[process].plan(request)
    return how.assembled(request, plan, [how.tile(request, tile) for tile in plan.tiles], lambda done, total: None)


def declared(body: Document, times: int) -> Document:
    """Return the request with the orders of the forces multiplied, and frequencies and phases divided by a number."""
    request = copy.deepcopy(body)
    oscillator = request["oscillator"]
    forces = oscillator["forcing"]
    forces = forces if isinstance(forces, list) else [forces]
    forces = forces if isinstance(forces[0], dict) else [{"amplitude": forces}]
    oscillator["forcing"] = [{**force, "harmonic": times * force.get("harmonic", 1)} for force in forces]
    for name in ("omega", "range", "horizontal", "vertical"):
        varied = {"omega": "omega", "range": request.get("vary")}.get(name)
        value = request.get(name)
        if isinstance(value, dict) and "vary" in value:
            if value["vary"] == "omega":
                value |= _over({key: part for key, part in value.items() if key != "vary"}, times)
        elif value is not None and varied == "omega":
            request[name] = _over(value, times)
    states = request.get("initial", [])
    for state in states if isinstance(states, list) else [states]:
        if "phase" in state:
            state["phase"] /= times
    if "phase" in request:
        request["phase"] /= times
    motions = request.get("motions") or ([request["motion"]] if "motion" in request else [])
    for motion in motions:
        if "phases" in motion:
            motion["phases"] = _over(motion["phases"], times)
        if "omega" in motion:
            motion["omega"] /= times
    return request


def _over(value: Any, times: int) -> Any:
    """Return a number, list or range divided by a number."""
    if isinstance(value, list):
        return [_over(part, times) for part in value]
    if isinstance(value, dict):
        return {name: part if name == "points" else _over(part, times) for name, part in value.items()}
    return value / times


def scaled(document: Any, body: Document, times: int, at: tuple[str, ...] = ()) -> Any:
    """Return the document of a request as it is expected of `declared`."""
    if isinstance(document, dict):
        return {name: _part(name, value, body, times, at) for name, value in document.items()}
    if isinstance(document, list):
        return [scaled(part, body, times, at) for part in document]
    return document


def _part(name: str, value: Any, body: Document, times: int, at: tuple[str, ...]) -> Any:
    if value is None:
        return None
    process_of_axes = {side: body[side].get("vary") for side in ("horizontal", "vertical") if side in body}
    if name == "request":
        return declared(value, times)
    if body.get("returns") and (state := _of_state(name, value, times, at)) is not None:
        return state
    if name in ("harmonic", "harmonics") and not isinstance(value, list):
        return times * value
    if "times" in body and name == "phase":  # that of a force's response, at t = 0
        return value
    frequency = name in _FREQUENCIES or (name in ("parameter", "first", "last") and body.get("vary") == "omega")
    if frequency or name in _PHASES or process_of_axes.get(name) == "omega":
        return _over(value, times) if isinstance(value, list) else np.asarray(value) / times
    if name in _SLOPES:
        return np.asarray(value) * times ** _SLOPES[name]
    return scaled(value, body, times, (*at, name))


def _of_state(name: str, value: Any, times: int, at: tuple[str, ...]) -> Any:
    """Return arrays of a discontinuity mapping, whose states end with the phase; None for others."""
    if name in ("state", "vector_field", "beta", "gamma", "mapped", "displacement", "simulated"):
        array = np.array(value)
        array[..., -1] /= times
        return array
    if name.startswith("jacobian"):
        array = np.array(value)
        array[-1, :-1] /= times
        array[:-1, -1] *= times
        return array
    return None


class Difference(NamedTuple):
    """Where two documents differ, what differs, and by how much of the largest entry there if these are numbers."""

    at: str
    what: str
    size: float = np.inf

    def __str__(self) -> str:
        return f"{self.at}: {self.what}"


def differences(expected: Any, got: Any, exact: bool, at: str = "") -> Iterator[Difference]:
    """Yield where two documents differ: in anything, or in numbers by more than `FIGURES`."""
    if isinstance(expected, dict):
        if not isinstance(got, dict) or list(expected) != list(got):
            yield Difference(at, "other fields")
            return
        path = () if exact else _path(expected, got)
        if path:
            yield from _off_path(at, *(np.column_stack([of[name] for name in path]) for of in (expected, got)))
        for name in set(expected) - set(path):
            both = expected[name], got[name]
            if name == "request":
                both = _in_one_form(both[0], exact), _in_one_form(both[1], exact)
            yield from differences(*both, exact, f"{at}.{name}")
    elif isinstance(expected, list) and any(isinstance(part, dict | list) for part in expected):
        if len(expected) != len(got):
            yield Difference(at, f"{len(expected)} and {len(got)}")
            return
        for number, (part, other) in enumerate(zip(expected, got, strict=True)):
            yield from differences(part, other, exact, f"{at}[{number}]")
    elif isinstance(expected, str) or expected is None:
        if expected != got:
            yield Difference(at, f"{expected!r} and {got!r}")
    else:
        values, other = np.asarray(expected), np.asarray(got)
        if values.shape != other.shape or values.dtype.kind != other.dtype.kind:
            yield Difference(at, f"shapes {values.shape} and {other.shape}, {values.dtype} and {other.dtype}")
        elif exact or values.dtype.kind not in "fc":
            if not np.array_equal(values, other, equal_nan=values.dtype.kind in "fc"):
                yield Difference(at, f"{np.count_nonzero(values != other)} of {values.size} numbers differ")
        elif values.size:
            yield from _inexact(at, values, other)


def _in_one_form(request: Document, exact: bool) -> Document:
    """Return a request for an orbit beyond a special point; round-off may choose another orbit of that branch."""
    whole: Document = parse_request("periodic-orbits", request).model_dump(mode="json")
    return whole if exact else {name: whole["motion"][name] for name in ("period", "stops")}


def _path(expected: Document, got: Document) -> tuple[str, ...]:
    """Return the names of the numbers at the points of a continued curve, if these are as many in both documents."""
    if np.ndim(expected.get("phases", 0.0)) != 2 or len(expected["phases"]) < 2:
        return ()
    names = [
        name
        for name in ("parameter", "omega", "clearance", "impact_velocity", "phases", "velocities")
        if name in expected
    ]
    same = all(np.shape(expected[name]) == np.shape(got[name]) for name in names)
    return tuple(names) if same else ()


def _off_path(at: str, points: Any, other: Any) -> Iterator[Difference]:
    """Yield whether points lie beside a curve; where on it they are depends on round-off in all steps before."""
    size = np.max(np.abs(points), axis=0)
    points, apart = points / size, (other - points) / size
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    beside = float(np.max(np.abs(apart - np.sum(apart * along, axis=1)[:, None] * along)))
    if beside > FIGURES or float(np.max(np.abs(apart))) > _STEP:
        yield Difference(at, f"{beside:.2g} beside the curve")


def _inexact(at: str, values: Any, other: Any) -> Iterator[Difference]:
    """Yield whether numbers differ by more than `FIGURES` of the largest one."""
    name = at.rpartition(".")[2]
    if name in _ROUNDING:  # they measure round-off, so only their size is known
        return
    if name == "multipliers":  # pairs of one modulus, in either order
        values, other = np.abs(values), np.abs(other)
    size = float(np.max(np.abs(values[np.isfinite(values)]), initial=1.0 if name in _GAPS else 0.0))
    if not np.allclose(values, other, rtol=0.0, atol=FIGURES * size, equal_nan=True):
        apart = float(np.nanmax(np.abs(values - other))) / (size or 1.0)
        alike = np.array_equal(np.isfinite(values), np.isfinite(other))
        yield Difference(at, f"differ by {apart:.2g}", apart if alike else np.inf)


def systems() -> dict[str, Document]:
    """Return ten machines at their own frequency: an oscillator, omega and a clearance; by name."""
    chain: Document = {"masses": [1.0, 10.0, 10.0], "stiffnesses": [1.0, 5.0, 5.0], "damping": 0.05}
    light: Document = {"masses": [1.0, 2.0, 1.5], "stiffnesses": [1.0, 1.5, 2.0], "damping": [0.08, 0.05, 0.1]}
    dense: Document = {
        "matrices": {
            "mass": [[2.0, 0.2, 0.0], [0.2, 1.0, 0.1], [0.0, 0.1, 1.5]],
            "damping": {"rayleigh": [0.1, 0.05]},
            "stiffness": [[2.0, -1.0, 0.0], [-1.0, 2.5, -0.5], [0.0, -0.5, 1.0]],
        },
        "contact": {"row": [1.0, -0.5, 0.0]},
    }

    def forced(of: Document, *forces: Document, **more: Any) -> Document:
        return {**of, "forcing": [{"amplitude": [1.0, 0.0, 0.0], **force} for force in forces], **more}

    def weaker(amplitude: float, harmonic: int) -> Document:
        return {"amplitude": [amplitude, 0.1, 0.0], "phase": [0.4, 0.0, 0.0], "harmonic": harmonic}

    unlike = {"right": 0.8, "left": 0.5}
    machine = [
        ("a chain", forced(chain, {}), 0.25, 1.2),
        ("less damping", forced({**chain, "damping": 0.01}, {}, restitution=0.6), 0.25, 1.5),
        ("even and odd", forced(light, {}, weaker(0.4, 2)), 0.5, 1.5),
        ("odd harmonics", forced(light, {}, weaker(0.6, 3)), 0.5, 1.5),
        ("without the first", forced(light, {"harmonic": 2}, weaker(0.8, 3)), 0.25, 1.0),
        ("an unbalance", forced(light, {"law": "unbalance"}), 0.5, 0.4),
        ("one stop", forced(chain, {}), 0.25, {"right": 1.0, "left": None}),
        ("a preload", forced(light, {}, bias=[0.3, 0.0, 0.0]), 0.5, {"right": 0.1, "left": None}),
        ("two restitutions", forced(light, {}, restitution=unlike), 0.5, {"right": 1.2, "left": 1.0}),
        ("matrices", forced(dense, {"phase": [0.3, 0.0, 0.0]}, restitution=unlike), 0.5, {"right": 0.4, "left": 0.5}),
    ]
    return {name: {"oscillator": of, "omega": omega, "clearance": clearance} for name, of, omega, clearance in machine}


def requests(machine: Document) -> Iterator[tuple[str, Document]]:
    """Yield small requests of every process for a machine, with the names of the processes."""
    of, omega, stops = machine["oscillator"], machine["omega"], machine["clearance"]
    both = not isinstance(stops, dict)
    place = stops if both else stops["right"]
    plain: Document = {"oscillator": of}
    curve = plain if both else {**plain, "clearance": {"right": None, "left": stops["left"]}}
    yield "structures", {**plain, "omega": [0.5 * omega, omega], "times": [0.0, 1.0], "clearance": stops}
    for each in (plain,) if both or stops["left"] is None else (plain, curve):
        yield "grazing-curves", {**each, "omega": {"start": 0.75 * omega, "stop": 1.5 * omega, "points": 5}}
        yield "codimension-two-points", {**each, "omega": {"start": 0.75 * omega, "stop": 1.5 * omega}}
    yield "discontinuity-mappings", {**plain, "omega": omega, "overshoot": [1e-6, 1e-4], "returns": 3}
    states = [{"phase": 0.0}, {"velocity": [0.1] * 3, "phase": 1.0}]
    seen = {"observables": ["impact_rate", "dissipated_power", "rms_displacement"]}
    yield (
        "trajectories",
        {**machine, **seen, "initial": states, "periods": 6, "transient_periods": 40, "samples_per_period": 7},
    )
    along = {"vary": "omega", "range": {"start": omega, "stop": 1.25 * omega, "points": 3}}
    line = {"oscillator": of, "clearance": stops, **along}
    yield "bifurcation-diagrams", {**line, "policy": "sweep-up", "periods": 10, "transient_periods": 100}
    yield "basin-fractions", {**line, "states": 8, "phase": 0.5, "max_periods": 200}
    plane: Document = {
        "horizontal": {"vary": "omega", "values": {"start": omega, "stop": 1.25 * omega, "points": 4}},
        "vertical": {"vary": "forcing", "values": {"start": 0.8, "stop": 1.2, "points": 4}},
    }
    ranges: Document = {
        "omega": plane["horizontal"]["values"],
        "clearance": {"start": 0.8 * place, "stop": 1.2 * place, "points": 5},
    }
    if not both:
        ranges["clearance"] = {"right": ranges["clearance"], "left": stops["left"]}
    yield "unfolding-maps", {**plain, **ranges, "max_periods": 200, **seen}
    yield "unfolding-maps", {**plain, **ranges, "max_periods": 100, "policy": "ensemble", "initial_conditions": 3}
    yield "unfolding-maps", {**plain, "clearance": stops, **plane, "max_periods": 200}
    yield "unfolding-maps", {**plain, **ranges, "max_periods": 200, "adaptive": True}
    yield "unfolding-diagrams", {**plain, **ranges, "max_periods": 200}
    reach = {"start": -0.5 * place, "stop": 0.9 * place, "points": 4}
    yield (
        "basins",
        {
            **machine,
            "horizontal": {"quantity": "displacement", "values": reach},
            "vertical": {"quantity": "velocity", "values": {"start": -0.3, "stop": 0.3, "points": 4}},
            "initial": {"phase": 0.5},
            "max_periods": 200,
        },
    )
    settles = {"max_period": 8, "transient_periods": 400}
    yield "periodic-orbits", {**machine, **settles, **seen}
    yield "periodic-orbits", {**machine, "motion": {"period": 1, "stops": [1]}}
    yield "periodic-orbits", {**machine, "motion": {"period": 1, "stops": [1, -1] if both else [1]}}
    yield (
        "orbit-branches",
        {
            **machine,
            "motion": {"period": 1, "stops": [1]},
            "vary": "omega",
            "range": {"start": 0.9 * omega, "stop": 1.1 * omega},
            "max_points": 60,
            **seen,
        },
    )
    vary = "clearance" if both else "clearance_right"
    near = {"start": 0.8 * place, "stop": 1.2 * place}
    yield (
        "orbit-branches",
        {**machine, "motion": {"period": 1, "stops": [1]}, "vary": vary, "range": near, "max_points": 60},
    )
    window: Document = {
        "omega": {"start": 0.9 * omega, "stop": 1.2 * omega},
        "clearance": near if both else {"right": near, "left": stops["left"]},
    }
    yield "bifurcation-curves", {**plain, **window, "points": 40}
    yield "bifurcation-curves", {**plain, **window, "motions": [{"period": 1, "stops": [1]}]}
    small = {side: {**axis, "values": {**axis["values"], "points": 3}} for side, axis in plane.items()}
    yield "unfolding-diagrams", {**plain, "clearance": stops, **small, "max_periods": 200, "borders": True}


def compared(process: str, body: Document, times: int, own: Document | None = None) -> list[Difference]:
    """Return how a request's result differs from that of the machine at its own frequency."""
    expected = scaled(computed(process, body) if own is None else own, body, times)
    got, exact = computed(process, declared(body, times)), times & (times - 1) == 0
    apart = list(differences(expected, got, exact))
    if exact or not any(np.isfinite(difference.size) for difference in apart):
        return apart
    nearby = scaled(computed(process, _nudged(body)), body, times)
    changes = {change.at: change.size for change in differences(expected, nearby, exact) if np.isfinite(change.size)}
    return [
        difference
        for difference in apart
        if difference.size > FIGURES + BACKWARD * changes.get(difference.at, 0.0) / _NUDGE
    ]


def _nudged(body: Document) -> Document:
    """Return the request for a machine whose stiffnesses are slightly larger."""
    nudged = copy.deepcopy(body)
    oscillator = nudged["oscillator"]
    of, name = (oscillator["matrices"], "stiffness") if "matrices" in oscillator else (oscillator, "stiffnesses")
    of[name] = (np.asarray(of[name]) * (1.0 + _NUDGE)).tolist()
    return nudged


def main() -> None:
    """Compare, print what differs, and fail if anything does. Names of systems can be given."""
    from grazemap_core.errors import CoreError

    failed = 0
    chosen = sys.argv[1:] or [*systems()]
    for name, machine in ((name, systems()[name]) for name in chosen):
        for process, body in requests(machine):
            try:
                own = computed(process, body)
            except CoreError as error:
                print(f"{name}: {process}: refused, {error}", flush=True)
                continue
            for times in (2, 3, 4):
                wrong = compared(process, body, times, own)
                failed += bool(wrong)
                print(f"{name}: {process}, p = {times}: {len(wrong)} differences", *wrong[:4], sep="\n    ", flush=True)
    print(f"{failed} results differ")
    if failed:
        sys.exit(1)


if __name__ == "__main__":
    main()
