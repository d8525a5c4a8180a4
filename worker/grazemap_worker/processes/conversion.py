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
from grazemap.wire.planes import Line, Parameters, is_structural, structure_value, with_parameter
from grazemap_worker.planning import Plan
from grazemap_worker.processes.process import Report

if TYPE_CHECKING:
    from grazemap_core.continuation.parameters import ParameterPoint
    from grazemap_core.maps.basins import Attractor
    from grazemap_core.maps.planes import ParameterLine as CoreLine
    from grazemap_core.model.oscillator import Oscillator as CoreOscillator
    from grazemap_core.simulation.motion import Motion

Item = TypeVar("Item")
STOPS = {"A": 1, "C": -1}
"""The sides of the stops by the names of the stops in the paper."""


def core_oscillator(oscillator: Oscillator) -> CoreOscillator:
    """Return the core's oscillator. Equal oscillators give the same object for a while, because it keeps its modes.

    Raises
    ------
    CoreError
        The theory of the core does not cover the oscillator.
    """
    return _core_oscillator(oscillator.model_dump_json())


@lru_cache(maxsize=16)
def _core_oscillator(text: str) -> CoreOscillator:
    from grazemap_core.model.oscillator import Oscillator as CoreOscillator

    oscillator = Oscillator.model_validate_json(text)
    if oscillator.beyond_the_chain() is not None:
        return _general(oscillator)
    return CoreOscillator.create(
        oscillator.masses,
        oscillator.stiffnesses,
        oscillator.damping,
        oscillator.amplitudes,
        oscillator.equal_restitution,
        units=oscillator.units,
    )


def _general(described: Oscillator) -> CoreOscillator:
    from grazemap_core.model.drive import base_in_space, base_with_stops, force
    from grazemap_core.model.matrices import Matrices as CoreMatrices
    from grazemap_core.model.oscillator import Oscillator as CoreOscillator
    from grazemap_core.model.structure import Structure

    structure: Structure
    if described.matrices is None:
        structure = CoreOscillator.create(
            described.masses, described.stiffnesses, described.damping, [0.0] * described.size, 1.0, described.units
        ).structure
    else:
        damping = described.matrices.damping
        kinds: dict[str, Any] = {"damping": damping} if isinstance(damping, list) else damping.model_dump()
        structure = CoreMatrices.create(described.matrices.mass, described.matrices.stiffness, **kinds)
    orders = described.orders  # without harmonics whose amplitudes cancel exactly; rounded sums need not be zero
    parts = [
        force(
            forcing.harmonic,
            np.array(forcing.amplitude),
            None if forcing.phase is None else np.array(forcing.phase),
            unbalance=forcing.law == "unbalance",
        )
        for forcing in described.harmonics or [Forcing.model_validate({"amplitude": described.forcing})]
        if forcing.harmonic in orders
    ]
    if described.base is not None and 1 in orders:
        base = described.base
        influence = np.ones(described.size) if base.influence is None else np.array(base.influence)
        amplitude = base.amplitude * complex(np.cos(base.phase), np.sin(base.phase))
        if base.stops_move:
            parts.append(base_with_stops(amplitude, structure.mass_matrix @ influence))
        else:
            parts.append(base_in_space(amplitude, *structure.ground_forces(influence)))
    restitution = described.restitution
    right, left = (restitution, None) if isinstance(restitution, float) else (restitution.right, restitution.left)
    same = left is None or left == right
    return CoreOscillator.of_structure(
        structure, described.contact_row, parts, right, described.bias, None if same else left
    )


def core_line(line: Line) -> CoreLine:
    """Return the core's line of one parameter. Raises CoreError."""
    from grazemap_core.maps.planes import Axis
    from grazemap_core.maps.planes import ParameterLine as CoreLine

    oscillator = varying_oscillator(line.parameters.oscillator, line.axis.vary)
    axis = Axis(line.axis.vary, grid_values(line.axis.values))
    return CoreLine(oscillator, parameter_point(oscillator, line.parameters), axis)


def varying_oscillator(oscillator: Oscillator, *varied: str) -> CoreOscillator:
    """Return the core's oscillator; the structural ones of the named parameters may vary."""
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
    """Return the JSON pointer to the field of a request that an error of the core names, or None."""
    if request.oscillator.matrices is not None and name in Matrices.model_fields:
        return f"/oscillator/matrices/{name}"
    if name in Oscillator.model_fields:
        return f"/oscillator/{name}"
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


def known(values: Mapping[str, Any]) -> Document:
    """Return the values that are not None."""
    return {name: value for name, value in values.items() if value is not None}


def empty_record(record: RecordSchema, **values: Any) -> Document:
    """Return the document of a record that was not found: fields without a value are empty arrays, NaN, 0 or False."""
    return {
        field.name: empty_value(field) for field in record if not field.optional and field.name not in values
    } | values


def empty_value(field: Field) -> Any:
    """Return the value of a field, other than a text, in the document of a record that was not found."""
    if isinstance(field.type, RecordSchema):
        return [] if field.dims else empty_record(field.type)
    if field.dims:
        return np.zeros([0] * len(field.dims), field.stored_dtype)
    return {"float": np.nan, "int": 0, "bool": False}[str(field.type)]


def counted(items: Iterable[Item], count: int, report: Report, times: int) -> Iterator[Item]:
    """Yield `count` items, and report the number of yielded items about `times` times."""
    for done, item in enumerate(items):
        if done % -(-count // times) == 0:
            report(done, count)
        yield item


def joined(plan: Plan, tiles: Sequence[Document], but: Container[str] = ()) -> Document:
    """Return the arrays of the grid, joined from the arrays of its tiles in the order of the plan; leave out `but`."""
    whole = {}
    for name in tiles[0]:
        if name not in but:
            whole[name] = np.empty((plan.rows, plan.columns), dtype=tiles[0][name].dtype)
            for tile, part in zip(plan.tiles, tiles, strict=True):
                whole[name][tile.rows, tile.columns] = part[name]
    return whole


def reasons() -> list[str]:
    """Return the reasons why motions are unresolved or not verified; the index of a reason is its code."""
    from grazemap_core.simulation.motion import REASONS

    return [REASONS.get(code, "") for code in range(1 + max(REASONS))]
