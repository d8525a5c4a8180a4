"""Observables and outputs: quantities that are measured on the motions of a result."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

from grazemap.results.fields import Field, RecordSchema
from grazemap.results.record import Record, field

if TYPE_CHECKING:
    from collections.abc import Iterator


_ASKED_FOR = "where `observables` names it"
_RIGHT_STOP, _LEFT_STOP = " on the right stop", " on the left stop"
_RATE = "Number of impacts{} per forcing period; null in complete chatter, which has infinitely many."
_PEAK = "Largest speed of the contact before an impact{}; null without impacts."
_MEAN = "Mean speed of the contact before impacts{}; null without impacts, 0 in complete chatter."
_IMPULSE = (
    "Impulse of the contact force{} per forcing period: that of all impacts, complete chatter included, and of the "
    "force while the contact rests."
)
_POWER = "Energy that impacts{} dissipate per unit of time."


class Output(Record):
    """An output over the same time as the observables, in the unit of the request.

    Its numbers are arrays with the dimensions of the observables.
    """

    name: str = field("Its name.")
    unit: str = field("Its unit, as in the request; empty if it gave none.")
    rms: Any = field("Root mean square.", null=True)
    mean: Any = field("Mean.", null=True)
    peak: Any = field("Largest modulus; at an impact, that of the limits on both sides.", null=True)


MEANS = tuple(Output.schema[name] for name in ("rms", "mean", "peak"))


class Observed(Record):
    """Base of results with observables and outputs; those that the request does not ask for are None.

    A subclass gives the `dimensions` of its observables, and the name of the schema of its outputs in the API's
    document.
    """

    impact_rate: Any = field(_RATE.format(""), when=_ASKED_FOR, null=True)
    impact_rate_right: Any = field(_RATE.format(_RIGHT_STOP), when=_ASKED_FOR, null=True)
    impact_rate_left: Any = field(_RATE.format(_LEFT_STOP), when=_ASKED_FOR, null=True)
    peak_impact_speed: Any = field(_PEAK.format(""), unit="m/s", when=_ASKED_FOR, null=True)
    peak_impact_speed_right: Any = field(_PEAK.format(_RIGHT_STOP), unit="m/s", when=_ASKED_FOR, null=True)
    peak_impact_speed_left: Any = field(_PEAK.format(_LEFT_STOP), unit="m/s", when=_ASKED_FOR, null=True)
    mean_impact_speed: Any = field(_MEAN.format(""), unit="m/s", when=_ASKED_FOR, null=True)
    mean_impact_speed_right: Any = field(_MEAN.format(_RIGHT_STOP), unit="m/s", when=_ASKED_FOR, null=True)
    mean_impact_speed_left: Any = field(_MEAN.format(_LEFT_STOP), unit="m/s", when=_ASKED_FOR, null=True)
    impulse: Any = field(_IMPULSE.format(""), unit="N s", when=_ASKED_FOR, null=True)
    impulse_right: Any = field(_IMPULSE.format(_RIGHT_STOP), unit="N s", when=_ASKED_FOR, null=True)
    impulse_left: Any = field(_IMPULSE.format(_LEFT_STOP), unit="N s", when=_ASKED_FOR, null=True)
    dissipated_power: Any = field(_POWER.format(""), unit="W", when=_ASKED_FOR, null=True)
    dissipated_power_right: Any = field(_POWER.format(_RIGHT_STOP), unit="W", when=_ASKED_FOR, null=True)
    dissipated_power_left: Any = field(_POWER.format(_LEFT_STOP), unit="W", when=_ASKED_FOR, null=True)
    rms_displacement: Any = field(
        "Root mean square of the contact coordinate about its static equilibrium.", unit="m", when=_ASKED_FOR, null=True
    )
    peak_displacement: Any = field(
        "Largest distance of the contact coordinate from its static equilibrium.", unit="m", when=_ASKED_FOR, null=True
    )
    peak_displacement_right: Any = field(
        "Largest displacement of the contact from its static equilibrium toward the right stop.",
        unit="m",
        when=_ASKED_FOR,
        null=True,
    )
    peak_displacement_left: Any = field(
        "Largest displacement of the contact from its static equilibrium toward the left stop.",
        unit="m",
        when=_ASKED_FOR,
        null=True,
    )
    outputs: tuple[Output, ...] = field(
        "The outputs, by name.", "output", when="where `outputs` asks for some", variable=None
    )

    def __init_subclass__(cls, dimensions: str = "", outputs: str = "Output", **more: Any) -> None:
        super().__init_subclass__(**more)
        dims = {"dims": tuple(dimensions.split())}
        output = Output.schema.varied(outputs, **{mean.name: dims for mean in MEANS})
        observed = (
            observable.varied(type=output) if observable.name == "outputs" else observable.varied(**dims)
            for observable in Observed.schema
        )
        names = {observable.name for observable in Observed.schema}
        own = (observable for observable in cls.schema if observable.name not in names)
        cls.schema = replace(cls.schema, fields=(*own, *observed))

    def output(self, name: str) -> Output:
        """Return the output of a name. Raises ValueError for a name that was not asked for."""
        outputs = {output.name: output for output in self.outputs}
        if name not in outputs:
            raise ValueError(f"the result has no output {name!r}; it has {', '.join(outputs) or 'none'}")
        return outputs[name]


OBSERVABLES = tuple(observable.name for observable in Observed.schema if observable.name != "outputs")


@dataclass(frozen=True, eq=False)
class Quantity:
    """The values of an observable or an output over the motions of a result."""

    values: Any
    """The values."""
    name: str
    """The name of the quantity in words."""
    unit: str
    """The unit; empty if there is none."""


def quantity_of(result: Any, name: str) -> Quantity:
    """Return an observable by its name, or an output: ``spring_rms``, ``spring_mean`` or ``spring_peak``.

    Raises
    ------
    ValueError
        The request did not ask for it; the message names the quantities of the result.
    """
    variables = {variable.name: (variable, values) for variable, values in variables_of(result)}
    if name not in variables:
        asked = f'; ask for observables=["{name}"] with the request' if name in OBSERVABLES else ""
        raise ValueError(f"the result has no {name}; it has {', '.join(variables) or 'no observables'}{asked}")
    variable, values = variables[name]
    return Quantity(values, name.replace("_", " "), variable.unit_in(result.units))


def variables_of(result: Any) -> Iterator[tuple[Field, Any]]:
    """Yield the fields of the observables of a result, and those of its outputs with names like spring_rms."""
    for observable in result.schema:
        if observable.name in OBSERVABLES and getattr(result, observable.name) is not None:
            yield observable, getattr(result, observable.name)
    yield from outputs_of(result)


def outputs_of(result: Any) -> Iterator[tuple[Field, Any]]:
    """Yield the fields of the outputs of a result, with names like spring_rms."""
    if not isinstance(result, Observed):
        return
    record = cast("RecordSchema", result.schema["outputs"].type)
    for output in result.outputs:
        for mean in MEANS:
            quantity = f"{mean.description.rstrip('.').partition(';')[0]} of {output.name}"
            changes = {"name": f"{output.name}_{mean.name}", "description": f"{quantity}.", "unit": output.unit}
            yield record[mean.name].varied(**changes), getattr(output, mean.name)
