"""The base of the requests of processes, and the short forms in which they may be written.

A request says what varies by its axes: `axis` along a curve or a branch, `horizontal` and `vertical` in a plane. An
axis has the name of a parameter and its values:

    {"horizontal": {"vary": "omega", "values": {"start": 0.26, "stop": 0.3, "points": 64}},
     "vertical": {"vary": "clearance_right", "values": {"start": 1.3, "stop": 2.0, "points": 64}},
     "clearance": {"left": 1.2}}

What people write is shorter. Where a frequency or a clearance is expected, its values may stand, and it varies:

    {"omega": {"start": 0.26, "stop": 0.3, "points": 64},
     "clearance": {"right": {"start": 1.3, "stop": 2.0, "points": 64}, "left": 1.2}}

One parameter may also be named beside its values: {"vary": "damping", "range": {"start": 0.5, "stop": 1.5}, ..}. All
ways to ask (HTTP, Python, the command line) take both forms; the document of the API, the ids of jobs and all other
code know the first one. Errors name the fields as they were written.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from pydantic import ValidationError

from grazemap.described import described
from grazemap.process_names import SUMMARIES
from grazemap.wire.base import Place, Places, Positive, Request, invalid, is_range_or_list, without_nulls
from grazemap.wire.error_details import errors_of
from grazemap.wire.error_texts import Schema, branches
from grazemap.wire.oscillator import Oscillator
from grazemap.wire.problems import parameter_error
from grazemap.wire.structure import SIDES, Clearance, ClearancePair, is_of_sides


@dataclass(frozen=True)
class Operation:
    """The description of a process in the API's document."""

    process: str
    """Its name, and the last part of its address."""
    operation_id: str
    """The operation's name for generated clients."""
    description: str
    """Some sentences."""
    examples: Mapping[str, Mapping[str, Any]]
    """Requests that can be posted as they are, by their names."""
    references: str = ""
    """Where the theory is, for the docstrings of clients."""

    @property
    def summary(self) -> str:
        """A few words."""
        return SUMMARIES[self.process]


class ProcessRequest(Request):
    """Base of all requests; a class with an `operation` is the request of a process."""

    short: ClassVar[ShortForms | None] = None
    """How what varies may be written without axes."""

    operation: ClassVar[Operation]

    oscillator: Oscillator = Oscillator()
    """The oscillator, of any kind; fields that are left out are those of the paper's example."""

    @classmethod
    def long_form(cls, values: Any) -> tuple[Any, Places]:
        """As `Request.long_form`: with axes."""
        return (values, {}) if cls.short is None else in_one_form(values, cls.short)

    @classmethod
    def checked(cls, body: Mapping[str, Any]) -> Self:
        """Return a request; raises ParameterError, which has all errors of the body."""
        try:
            return cls.model_validate(dict(body))
        except ValidationError as error:
            details = [{**item, "loc": ("body", *item["loc"])} for item in error.errors(include_url=False)]
            raise parameter_error(errors_of(details, naming=True)) from None

    @classmethod
    def short_form(cls, body: Mapping[str, Any]) -> dict[str, Any]:
        """Return a request in its long form as people write it, where it has a short form."""
        return dict(body) if cls.short is None else in_short_form(body, cls.short)

    @classmethod
    def write_short_forms(cls, schema: dict[str, Any]) -> None:
        """Add the fields that may be written to the JSON schema of this request."""
        if cls.short is not None:
            schema["properties"] = with_short_forms(schema["properties"], cls.short, schema)


class PointRequest(ProcessRequest):
    """Base of the requests at one point of the plane of omega and clearance."""

    omega: Positive
    """Forcing frequency."""
    clearance: Clearance
    """Distance of the stops from q = 0: one number, or {"right": .., "left": ..} with None for an absent stop."""


@described
@dataclass(frozen=True)
class ShortForms:
    """The short forms of the requests of a process."""

    axes: tuple[str, ...]
    """The fields that these stand for: axis, or horizontal and vertical."""
    values: Mapping[str, str]
    """The fields, omega and clearance, that may have values instead of a number, with their descriptions."""
    vary: str | None = None
    """The parameter that varies where `range` stands alone; "": `vary` names it; None: there is no `range`."""

    @property
    def fields(self) -> dict[str, str]:
        """The fields that are written in place of axes, with their descriptions."""
        return {**(NAMED if self.vary is not None else {}), **self.values}


NAMED = {
    "vary": "The parameter that varies: the name of the axis.",
    "range": "The values of the parameter that varies.",
}
"""The two fields in place of one axis, with their descriptions."""


def in_one_form(body: Any, forms: ShortForms) -> tuple[Any, Places]:
    """Return a request in its one form, and where its parts were written.

    An axis or a short form that is null is not there. Where the clearance varies and that of one stop is given, it is
    that of the other stop which varies.
    """
    if not isinstance(body, dict):
        return body, {}
    body = _with_the_side_that_varies(without_nulls(body, (*forms.axes, *NAMED)), forms)
    if not body.keys().isdisjoint(forms.axes):
        return body, {}
    varied = [name for field in forms.values for name in _varied(body, field)]
    if len(forms.axes) == 2:
        up = [(vary, place) for vary, place in varied if vary != "omega"] or [("clearance", ("clearance",))]
        if len(up) == 2 or (up[0][0] == "clearance" and is_of_sides(body.get("clearance"))):
            raise invalid("only one of the two clearances may vary", "values for right or for left", "clearance")
        return _with_axes(body, dict(zip(forms.axes, [("omega", ("omega",)), up[0]], strict=True)))
    if forms.vary is None:
        return _with_axes(body, {forms.axes[0]: ("omega", ("omega",))})
    if varied and body.keys().isdisjoint(NAMED):
        if len(varied) > 1:
            raise invalid("only one parameter may vary", f"values for one of {' and '.join(forms.values)}", "range")
        return _with_axes(body, {forms.axes[0]: varied[0]})
    axis = {"vary": body["vary"]} if "vary" in body else {"vary": forms.vary} if forms.vary else {}
    axis |= {"values": body["range"]} if "range" in body else {}
    others = {name: value for name, value in body.items() if name not in NAMED}
    return others | {forms.axes[0]: axis}, _places(forms.axes[0], ("vary",), ("range",))


def _with_the_side_that_varies(body: dict[str, Any], forms: ShortForms) -> dict[str, Any]:
    """Return a request in which an axis of the clearance is that of the one stop which is not given."""
    given = body.get("clearance")
    # along a branch both stops are given, as they are at its orbit
    if forms.vary == "clearance" or not isinstance(given, Mapping) or len(given) != 1 or not {*given} <= {*SIDES}:
        return body
    (other,) = {*SIDES} - {*given}
    of_other = f"clearance_{other}"
    if body.get("vary") == "clearance":
        return body | {"vary": of_other}
    axes = {name: body[name] for name in forms.axes if isinstance(body.get(name), Mapping)}
    return body | {name: {**axis, "vary": of_other} for name, axis in axes.items() if axis.get("vary") == "clearance"}


def _varied(body: Mapping[str, Any], field: str) -> Iterator[tuple[str, Place]]:
    """Yield the parameters of a field that have values instead of a number, and their places."""
    value = body.get(field)
    if not is_of_sides(value):
        if is_range_or_list(value):
            yield field, (field,)
    elif isinstance(value, Mapping):
        # where neither is a range or a list, what is no number is meant as one
        several = [side for side in SIDES if is_range_or_list(value.get(side))]
        for side in several or [side for side in SIDES if not isinstance(value.get(side), float | int | None)]:
            yield f"{field}_{side}", (field, side)


def _with_axes(body: Mapping[str, Any], axes: Mapping[str, tuple[str, Place]]) -> tuple[dict[str, Any], Places]:
    """Return a request whose values at some places are those of axes instead."""
    changed, places = dict(body), dict[Place, Place]()
    for axis, (vary, place) in axes.items():
        field, *side = place
        if side:
            changed[str(field)] = {name: value for name, value in changed[str(field)].items() if name != side[0]}
            values = {"values": body[str(field)][side[0]]}
        else:
            values = {"values": changed.pop(str(field))} if field in changed else {}
        changed[axis] = {"vary": vary, **values}
        places |= _places(axis, place, place)
    return changed, places


def _places(axis: str, vary: Place, values: Place) -> Places:
    return {(axis, "vary"): vary, (axis, "values"): values, (axis,): values}


def in_short_form(body: Mapping[str, Any], forms: ShortForms) -> dict[str, Any]:
    """Return a request as people write it: the inverse of `in_one_form`, where a plane has a short form."""
    if body.keys().isdisjoint(forms.axes):
        return dict(body)
    axes = [body[axis] for axis in forms.axes]
    short = {name: value for name, value in body.items() if name not in forms.axes}
    if len(axes) == 1 and forms.vary is not None:
        return {"vary": axes[0]["vary"], "range": axes[0]["values"], **short}
    names = [axis["vary"] for axis in axes]
    if names[0] != "omega" or not all(name == "omega" or name.startswith("clearance") for name in names):
        return dict(body)
    for axis in axes:
        field, _, side = axis["vary"].partition("_")
        short[field] = {side: axis["values"], **short.get(field, {})} if side else axis["values"]
    return short


def with_short_forms(properties: Mapping[str, Schema], short: ShortForms, root: dict[str, Any]) -> dict[str, Schema]:
    """Return the fields of a request with those that are written in place of axes; one axis has no flags itself."""
    axis = next(schema for schema in branches(properties[short.axes[0]], root) if "properties" in schema)
    values = axis["properties"]["values"]
    if ClearancePair.__name__ in root["$defs"]:
        pair = deepcopy(root["$defs"][ClearancePair.__name__])
        for side in pair["properties"].values():
            side["anyOf"] += [values]
        root["$defs"]["varied"] = pair
    alternatives = {"vary": [axis["properties"]["vary"]], "clearance": [values, {"$ref": "#/$defs/varied"}]}
    written: dict[str, Schema] = {}
    for name, text in short.fields.items():
        field = properties.get(name, {})
        numbers = [schema for schema in branches(field, root) if schema.get("type") == "number"]
        description = " ".join(filter(None, (field.get("description"), text)))
        usual = {"default": short.vary} if name == "vary" and short.vary else {}
        every = [*numbers, *alternatives.get(name, [values])]
        written[name] = {"anyOf": every, "description": description, **usual}
    axes = written if len(short.axes) == 1 else {name: properties[name] for name in short.axes}
    others = {name: field for name, field in properties.items() if name not in short.axes}
    first = {name: field for name, field in others.items() if name == "oscillator"}
    return first | written | axes | {name: field for name, field in others.items() if name not in written}
