"""Conversion of wire models into objects of the core, and of objects of the core into documents."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from grazemap.codec import Document
from grazemap.results.fields import Field, RecordSchema
from grazemap.wire import ClearancePair, Forcing, Matrices, Oscillator, ProcessRequest, grid_values, motion_label
from grazemap.wire.planes import AXES, Line, Parameters, is_structural, structure_value, with_parameter
from grazemap.wire.structure import restitutions
from grazemap_worker.planning import Plan
from grazemap_worker.processes.process import Report

if TYPE_CHECKING:
    from grazemap_core.continuation.parameters import ParameterPoint
    from grazemap_core.maps.basins import Attractor
    from grazemap_core.maps.planes import ParameterLine as CoreLine
    from grazemap_core.model.oscillator import Oscillator as CoreOscillator
    from grazemap_core.simulation.motion import Motion

Item = TypeVar("Item")
STOPS = {"right": 1, "left": -1}
"""The number of a stop in the core: stop A of the paper is on the right, stop C on the left."""


def core_oscillator(oscillator: Oscillator) -> CoreOscillator:
    """Return the core's oscillator. The last ones are kept, because an oscillator keeps the modes that it has computed.

    Raises
    ------
    CoreError
        The theory of the core does not cover the oscillator.
    """
    kept = _kept(oscillator.model_dump_json())
    if not kept:
        kept.append(_built(oscillator))
    return kept[0]


@lru_cache(maxsize=16)
def _kept(_: str) -> list[CoreOscillator]:
    """Return the list that keeps the core's oscillator of a text, the same one for the same text; it is empty first."""
    return []


def _built(oscillator: Oscillator) -> CoreOscillator:
    from grazemap_core.model.oscillator import Oscillator as CoreOscillator

    if oscillator.beyond_the_chain() is not None:
        return _general(oscillator)
    return CoreOscillator.create(
        oscillator.masses,
        oscillator.stiffnesses,
        oscillator.damping,
        oscillator.amplitudes,
        restitutions(oscillator.restitution)[0],
        units=oscillator.units,
    )


def _general(oscillator: Oscillator) -> CoreOscillator:
    from grazemap_core.model.drive import base_in_space, base_with_stops, force
    from grazemap_core.model.matrices import Matrices as CoreMatrices
    from grazemap_core.model.oscillator import Oscillator as CoreOscillator
    from grazemap_core.model.structure import Structure

    structure: Structure
    if oscillator.matrices is None:
        structure = CoreOscillator.create(
            oscillator.masses,
            oscillator.stiffnesses,
            oscillator.damping,
            [0.0] * oscillator.size,
            1.0,
            oscillator.units,
        ).structure
    else:
        damping = oscillator.matrices.damping
        damping_arguments: dict[str, Any] = {"damping": damping} if isinstance(damping, list) else damping.model_dump()
        structure = CoreMatrices.create(oscillator.matrices.mass, oscillator.matrices.stiffness, **damping_arguments)
    # without the harmonics whose amplitudes cancel exactly; here their rounded sum might not be zero
    orders = oscillator.orders
    parts = [
        force(
            forcing.harmonic,
            np.array(forcing.amplitude),
            None if forcing.phase is None else np.array(forcing.phase),
            unbalance=forcing.law == "unbalance",
        )
        for forcing in oscillator.harmonics or [Forcing.model_validate({"amplitude": oscillator.forcing})]
        if forcing.harmonic in orders
    ]
    if oscillator.base is not None and 1 in orders:
        base = oscillator.base
        influence = np.ones(oscillator.size) if base.influence is None else np.array(base.influence)
        amplitude = base.amplitude * complex(np.cos(base.phase), np.sin(base.phase))
        if base.stops_move:
            parts.append(base_with_stops(amplitude, structure.mass_matrix @ influence))
        else:
            parts.append(base_in_space(amplitude, *structure.ground_forces(influence)))
    restitution = oscillator.restitution
    right, left = (restitution, None) if isinstance(restitution, float) else (restitution.right, restitution.left)
    same = left is None or left == right
    return CoreOscillator.of_structure(
        structure, oscillator.contact_row, parts, right, oscillator.bias, None if same else left, oscillator.units
    )


def core_line(line: Line) -> CoreLine:
    """Return the core's line of one parameter. Raises CoreError."""
    from grazemap_core.maps.planes import Axis
    from grazemap_core.maps.planes import ParameterLine as CoreLine

    oscillator = varying_oscillator(line.parameters.oscillator, line.axis.vary)
    axis = Axis(line.axis.vary, grid_values(line.axis.grid))
    return CoreLine(oscillator, parameter_point(oscillator, line.parameters), axis)


def varying_oscillator(oscillator: Oscillator, *varied: str) -> CoreOscillator:
    """Return the core's oscillator, in which structural parameters among `varied`, such as a mass, may change."""
    base, names = core_oscillator(oscillator), [name for name in varied if is_structural(name)]
    if not names:
        return base
    from grazemap_core.model.oscillator import Variants

    def create(values: Mapping[str, float]) -> CoreOscillator:
        variant = oscillator
        for name, value in values.items():
            variant = with_parameter(variant, name, value)
        return core_oscillator(variant)

    values = {name: structure_value(oscillator, name) for name in names}
    return dataclasses.replace(base, variants=Variants(values, create))


def parameter_point(oscillator: CoreOscillator, parameters: Parameters) -> ParameterPoint:
    """Return the values of the fixed parameters as an object of the core."""
    from grazemap_core.continuation.parameters import ParameterPoint

    return ParameterPoint.of(oscillator, parameters.omega or math.nan, (parameters.right, parameters.left))


def core_clearance(clearance: float | ClearancePair) -> float | tuple[float | None, float | None]:
    """Return one clearance for both stops, or a pair (right, left), as the core takes it."""
    return (clearance.right, clearance.left) if isinstance(clearance, ClearancePair) else clearance


def request_pointer(request: ProcessRequest, name: str | None) -> str | None:
    """Return the JSON pointer to the field of a request that an error of the core names, or None.

    For example "masses" is at /oscillator/masses, "velocity" at /initial/velocity, "states[3].phase" at
    /initial/3/phase.
    """
    if request.oscillator.matrices is not None and name in Matrices.model_fields:
        return f"/oscillator/matrices/{name}"
    if name in Oscillator.model_fields:
        return f"/oscillator/{name}"
    axes = ((field, getattr(request, field, None)) for field in ("axis", *AXES))
    if (field := next((field for field, axis in axes if axis is not None and axis.vary == name), None)) is not None:
        return f"/{field}/values"
    if name in type(request).model_fields:
        return f"/{name}"
    if name in {"displacement", "velocity", "phase"} and "initial" in type(request).model_fields:
        return f"/initial/{name}"
    match = re.fullmatch(r"states\[(\d+)\]\.(\w+)", name or "")
    return f"/initial/{match[1]}/{match[2]}" if match else None


def fields(source: Any, *names: str) -> Document:
    """Return the named attributes of an object."""
    return {name: getattr(source, name) for name in names}


def label(motion: Motion | Attractor) -> str | None:
    """Return the label of a motion; None if its period or its impacts are not known."""
    if motion.period is None or motion.impacts_right is None or motion.impacts_left is None:
        return None
    return motion_label(motion.period, motion.impacts_right, motion.impacts_left)


def without_none(values: Mapping[str, Any]) -> Document:
    """Return the values that are not None."""
    return {name: value for name, value in values.items() if value is not None}


def empty_record(record: RecordSchema, **values: Any) -> Document:
    """Return the document of a record when nothing was found, for example no orbit; see `empty_value`."""
    return {
        field.name: empty_value(field) for field in record if not field.optional and field.name not in values
    } | values


def empty_value(field: Field) -> Any:
    """Return the value of a field that has none: NaN, 0, False, or an empty array. Texts have no such value."""
    if isinstance(field.type, RecordSchema):
        return [] if field.dims else empty_record(field.type)
    if field.dims:
        return np.zeros([0] * len(field.dims), field.stored_dtype)
    return {"float": np.nan, "int": 0, "bool": False}[str(field.type)]


def reporting_progress(items: Iterable[Item], count: int, report: Report, times: int) -> Iterator[Item]:
    """Yield the items, and report about `times` times how many of the `count` items have been yielded."""
    for done, item in enumerate(items):
        if done % -(-count // times) == 0:
            report(done, count)
        yield item


def join_tiles(plan: Plan, tiles: Sequence[Document], omitted: Container[str] = ()) -> Document:
    """Return the arrays of the grid, joined from the arrays of its tiles in the order of the plan."""
    whole = {}
    for name in tiles[0]:
        if name not in omitted:
            whole[name] = np.empty((plan.rows, plan.columns), dtype=tiles[0][name].dtype)
            for tile, part in zip(plan.tiles, tiles, strict=True):
                whole[name][tile.row_slice, tile.column_slice] = part[name]
    return whole


def reasons() -> list[str]:
    """Return the reasons why motions are unresolved or not verified; the index of a reason is its code."""
    from grazemap_core.simulation.motion import REASONS

    return [REASONS.get(code, "") for code in range(1 + max(REASONS))]
