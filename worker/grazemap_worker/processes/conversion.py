"""From wire models to the core's objects, and from the core's dataclasses to plain records."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import Document
from grazemap.wire import ClearancePair, Forcing, Matrices, Oscillator, ProcessRequest, grid_values, motion_label
from grazemap.wire.planes import Line, Parameters, is_structural, structure_value, with_parameter
from grazemap_worker.planning import Plan
from grazemap_worker.processes.process import Report

if TYPE_CHECKING:
    from grazemap_core.continuation.parameters import ParameterPoint
    from grazemap_core.maps.chaotic_transients import ChanceToSettle
    from grazemap_core.maps.planes import Line as CoreLine
    from grazemap_core.model.oscillator import Oscillator as CoreOscillator

Item = TypeVar("Item")
EVIDENCE = ("isolated", "admissible", "stable", "verified")
"""The names of the checks of an orbit, or of the orbits of a branch."""


def core_oscillator(oscillator: Oscillator) -> CoreOscillator:
    """Return the core's oscillator, the same object for equal ones asked for one after another: its modes are kept.

    Raises
    ------
    CoreError
        The core's theory does not cover it.
    """
    return _core_oscillator(oscillator.model_dump_json())


@lru_cache(maxsize=16)
def _core_oscillator(described: str) -> CoreOscillator:
    from grazemap_core.model.oscillator import Oscillator as CoreOscillator

    oscillator = Oscillator.model_validate_json(described)
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
    orders = described.orders  # amplitudes that add up to zero may do so in exact arithmetic only
    parts = [
        force(
            one.harmonic,
            np.array(one.amplitude),
            None if one.phase is None else np.array(one.phase),
            unbalance=one.law == "unbalance",
        )
        for one in described.harmonics or [Forcing.model_validate({"amplitude": described.forcing})]
        if one.harmonic in orders
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
    from grazemap_core.maps.planes import Line as CoreLine

    oscillator = varying_oscillator(line.parameters.oscillator, line.axis.vary)
    axis = Axis(line.axis.vary, grid_values(line.axis.values))
    return CoreLine(oscillator, parameter_point(oscillator, line.parameters), axis)


def varying_oscillator(oscillator: Oscillator, *varied: str) -> CoreOscillator:
    """Return the core's oscillator; those of the parameters named that are of its structure may vary."""
    found, names = core_oscillator(oscillator), [name for name in varied if is_structural(name)]
    if not names:
        return found
    from grazemap_core.model.oscillator import Variants

    def create(values: Mapping[str, float]) -> CoreOscillator:
        of = oscillator
        for name, value in values.items():
            of = with_parameter(of, name, value)
        return core_oscillator(of)

    values = {name: structure_value(oscillator, name) for name in names}
    return dataclasses.replace(found, variants=Variants(values, create))


def parameter_point(oscillator: CoreOscillator, parameters: Parameters) -> ParameterPoint:
    """Return the values of the parameters that do not vary, as the core takes them."""
    from grazemap_core.continuation.parameters import ParameterPoint

    return ParameterPoint.of(oscillator, parameters.omega or math.nan, (parameters.right, parameters.left))


def core_clearance(clearance: float | ClearancePair) -> float | tuple[float | None, float | None]:
    """Return the clearance of both stops, or of the right and of the left one, as the core takes it."""
    return (clearance.right, clearance.left) if isinstance(clearance, ClearancePair) else clearance


def record(item: Any) -> Any:
    """Return a dataclass or named tuple of the core as plain values, without fields of a dataclass that are None."""
    if isinstance(item, float | int | str):
        return item.item() if isinstance(item, np.generic) else item
    if dataclasses.is_dataclass(item) and not isinstance(item, type):
        values = ((name, getattr(item, name)) for name in _names(type(item)))
        return {name: record(value) for name, value in values if value is not None}
    if isinstance(item, tuple) and hasattr(item, "_asdict"):
        return record(item._asdict())
    if isinstance(item, dict):
        return {name: record(value) for name, value in item.items()}
    if isinstance(item, list | tuple | np.ndarray):
        return [record(entry) for entry in item]
    if isinstance(item, np.generic):
        return item.item()
    return item


@cache
def _names(kind: Any) -> list[str]:
    return [field.name for field in dataclasses.fields(kind)]


def request_pointer(request: ProcessRequest, name: str | None) -> str | None:
    """Return the JSON pointer of the request's field that an error of the core names, or None."""
    if request.oscillator.matrices is not None and name in Matrices.model_fields:
        return f"/oscillator/matrices/{name}"
    if name in Oscillator.model_fields:
        return f"/oscillator/{name}"
    if name in type(request).model_fields:
        return f"/{name}"
    if name in {"displacement", "velocity", "phase"} and "initial" in type(request).model_fields:
        return f"/initial/{name}"
    of_many = re.fullmatch(r"states\[(\d+)\]\.(\w+)", name or "")
    return f"/initial/{of_many[1]}/{of_many[2]}" if of_many else None


def pairs(values: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return complex numbers (...) as real and imaginary parts, (..., 2), as JSON has no complex numbers."""
    return np.stack([values.real, values.imag], axis=-1)


def fields(found: Any, *names: str) -> Document:
    """Return the named attributes of an object."""
    return {name: getattr(found, name) for name in names}


def label(motion: Mapping[str, Any]) -> str | None:
    """Return the label of a motion from its record; None where its period or its impacts are not known."""
    counts: list[Any] = [motion.get(name) for name in ("period", "impacts_right", "impacts_left")]
    return motion_label(*counts) if None not in counts else None


def chance_document(chance: ChanceToSettle | None) -> Document:
    """Return the field of a result that has the chance of its chaotic motions to settle, if there are any."""
    return {} if chance is None else {"chance_to_settle": record(chance)}


def counted(found: Iterable[Item], count: int, report: Report, times: int) -> Iterator[Item]:
    """Yield `count` items, and report their number about `times` times."""
    for done, item in enumerate(found):
        if done % -(-count // times) == 0:
            report(done, count)
        yield item


def joined(plan: Plan, parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Return an array of the grid, joined from those of its tiles in the plan's order."""
    array = np.empty((plan.rows, plan.columns), dtype=parts[0].dtype)
    for tile, part in zip(plan.tiles, parts, strict=True):
        array[tile.rows, tile.columns] = part
    return array
