"""The fields of results that are read off motions: observables by name, and outputs."""

from __future__ import annotations

from grazemap.schema.fields import Field, Record, field

_ASKED_FOR = "where `observables` names it"
_STOPS = (("", ""), ("_right", " on stop A"), ("_left", " on stop C"))
_BY_STOP = (
    (
        "impact_rate",
        "Number of impacts{} per forcing period; null in complete chatter, which has infinitely many.",
        "",
    ),
    ("peak_impact_speed", "Largest speed of the contact before an impact{}; null without impacts.", "m/s"),
    (
        "mean_impact_speed",
        "Mean speed of the contact before impacts{}; null without impacts, 0 in complete chatter.",
        "m/s",
    ),
    (
        "impulse",
        "Impulse of the contact force{} per forcing period: that of all impacts, complete chatter included, and of the "
        "force while the contact rests.",
        "N s",
    ),
    ("dissipated_power", "Energy that impacts{} dissipate per unit of time.", "W"),
)
_OF_DISPLACEMENT = (
    ("rms_displacement", "Root mean square of the contact coordinate about its static equilibrium."),
    ("peak_displacement", "Largest distance of the contact coordinate from its static equilibrium."),
    ("peak_displacement_right", "Largest displacement of the contact from its static equilibrium toward stop A."),
    ("peak_displacement_left", "Largest displacement of the contact from its static equilibrium toward stop C."),
)
_OBSERVABLES = (
    *(
        field(name + side, "float", said.format(where), unit=unit, when=_ASKED_FOR, null=True)
        for name, said, unit in _BY_STOP
        for side, where in _STOPS
    ),
    *(field(name, "float", said, unit="m", when=_ASKED_FOR, null=True) for name, said in _OF_DISPLACEMENT),
)
MEANS = (
    field("rms", "float", "Root mean square.", null=True),
    field("mean", "float", "Mean.", null=True),
    field("peak", "float", "Largest modulus; at an impact, that of the limits on both sides.", null=True),
)


def output_record(name: str, dims: tuple[str, ...] = ()) -> Record:
    """Return the record of an output, by its name in the API's document, with the dimensions of its numbers."""
    return Record(
        name,
        "An output over the same time as the observables, in the unit of the request.",
        (
            field("name", "str", "Its name."),
            field("unit", "str", "Its unit, as in the request; empty if it gave none."),
            *(one.in_result(dims=dims) for one in MEANS),
        ),
    )


OUTPUT = output_record("Output")


def observed_fields(dims: tuple[str, ...], output: Record) -> tuple[Field, ...]:
    """Return the fields of observables and outputs with these dimensions."""
    when = "where `outputs` asks for some"
    return (
        *(one.in_result(dims=dims) for one in _OBSERVABLES),
        field("outputs", output, "The outputs, by name.", "output", when=when, variable=None),
    )


OBSERVABLES = tuple(one.name for one in _OBSERVABLES)
