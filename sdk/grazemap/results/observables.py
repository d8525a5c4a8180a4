"""What is read off the motions of a result: observables, and outputs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from grazemap.results.records import RECORDS, described
from grazemap.schema.fields import Field, Record
from grazemap.schema.observables import MEANS, OBSERVABLES, OUTPUT

if TYPE_CHECKING:
    from collections.abc import Iterator


@described(OUTPUT)
class Output:
    """An output, such as the force of a spring; its numbers are arrays with the dimensions of the observables."""

    name: str
    unit: str
    rms: Any
    mean: Any
    peak: Any


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Observed:
    """Base of results with what was read off their motions; None where it was not asked for."""

    impact_rate: Any = None
    impact_rate_right: Any = None
    impact_rate_left: Any = None
    peak_impact_speed: Any = None
    peak_impact_speed_right: Any = None
    peak_impact_speed_left: Any = None
    mean_impact_speed: Any = None
    mean_impact_speed_right: Any = None
    mean_impact_speed_left: Any = None
    impulse: Any = None
    impulse_right: Any = None
    impulse_left: Any = None
    dissipated_power: Any = None
    dissipated_power_right: Any = None
    dissipated_power_left: Any = None
    rms_displacement: Any = None
    peak_displacement: Any = None
    peak_displacement_right: Any = None
    peak_displacement_left: Any = None
    outputs: tuple[Output, ...] = ()

    def output(self, name: str) -> Output:
        """Return the output of a name. Raises ValueError for a name that was not asked for."""
        found = {one.name: one for one in self.outputs}
        if name not in found:
            raise ValueError(f"the result has no output {name!r}; it has {', '.join(found) or 'none'}")
        return found[name]


@dataclass(frozen=True, eq=False)
class Quantity:
    """Figures of the motions of a result, their name in words, and their unit, which is empty if there is none."""

    values: Any
    name: str
    unit: str


def quantity_of(result: Any, name: str) -> Quantity:
    """Return an observable by its name, or an output: ``spring_rms``, ``spring_mean`` or ``spring_peak``.

    Raises
    ------
    ValueError
        It was not asked for; the message names what was.
    """
    found = {one.name: (one, values) for one, values in variables_of(result)}
    if name not in found:
        raise ValueError(f"the result has no {name}; it has {', '.join(found) or 'no observables'}")
    one, values = found[name]
    return Quantity(values, name.replace("_", " "), one.unit_in(result.units))


def variables_of(result: Any) -> Iterator[tuple[Field, Any]]:
    """Yield the fields of the observables of a result, and those of its outputs with names like spring_rms."""
    for one in result.schema:
        if one.name in OBSERVABLES and getattr(result, one.name) is not None:
            yield one, getattr(result, one.name)
    yield from outputs_of(result)


def outputs_of(result: Any) -> Iterator[tuple[Field, Any]]:
    """Yield the fields of the outputs of a result, with names like spring_rms."""
    if not isinstance(result, Observed):
        return
    record = cast("Record", result.schema["outputs"].type)  # type: ignore[attr-defined]
    for output in result.outputs:
        for mean in MEANS:
            said = f"{mean.description.rstrip('.').partition(';')[0]} of {output.name}"
            changes = {"name": f"{output.name}_{mean.name}", "description": f"{said}.", "unit": output.unit}
            yield record[mean.name].in_result(**changes), getattr(output, mean.name)


for _name in ("OutputOfMap", "OutputOfBranch", "OutputOfDiagram"):
    RECORDS[_name] = Output
