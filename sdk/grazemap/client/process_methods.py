"""The method of a process, derived from the model of its request: its signature, its docstring, its requests.

Every argument is a field of the request, in one of the forms of `arguments.py`. A method also has `points` or `shape`,
which complete ranges, and `progress`. What does not follow from the request stands in `_EXTRAS`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Coroutine, Mapping
from inspect import Parameter, Signature, cleandoc
from textwrap import fill, indent
from typing import Any, NamedTuple

from grazemap.client.arguments import (
    Argument,
    Form,
    Provable,
    as_statement,
    choices_of,
    form_of,
    short_forms,
    with_si_numbers,
)
from grazemap.constants import UNITS
from grazemap.results import RESULTS, Result
from grazemap.suggestions import suggestion
from grazemap.wire import PROCESSES, ProcessRequest
from grazemap.wire.base import plain
from grazemap.wire.observables import ObservedRequest
from grazemap.wire.problems import refusal
from grazemap.wire.process import ShortForms

_POINTS = Form("int", "int", more="Number of values from start to stop, both included.")
_SHAPE = Form(
    "tuple[int, int] | None",
    "(int, int)",
    more="Numbers of vertical and of horizontal values, where they are given as (start, stop).",
)
_PROGRESS = Form(
    "bool",
    "bool",
    more="Whether a bar is shown on a terminal or below a notebook's cell during the computation, and elsewhere a line "
    "on stderr for what it waits for longer than 5 s.",
)
_RAISES = "ParameterError, JobFailed, JobDismissed, QueueFull, ServiceUnavailable, ConnectionFailed"
_WIDTH = 108


class Extra(NamedTuple):
    """What a method has that does not follow from its request."""

    name: str = ""
    """The name of the method; "": derived from the name of the result's class."""
    result: str = ""
    """The class of the result, for a process whose results have several classes."""
    remark: str = ""
    """A paragraph of the docstring."""
    forms: Mapping[str, Form] = {}
    """Forms of arguments that replace the forms of the fields."""
    defaults: Mapping[str, Any] = {}
    """Defaults of arguments that replace the defaults of the fields; a required field with a default is optional."""
    fields: Callable[[Mapping[str, Any]], Mapping[str, Any]] = lambda _: {}
    """Returns the fields of the request that depend on several arguments."""
    several: tuple[str, str] | None = None
    """The name of an argument, and the class of the result where this argument is a sequence."""


def _provable_fields(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields `oscillator` and `statement` where a point or an orbit is given; else no fields."""
    provable = arguments["oscillator"]
    if not isinstance(provable, Provable):
        return {}
    if arguments["statement"] is not None:
        detail = "a point or an orbit knows its statement, and another one is given"
        raise refusal("/statement", detail, "no statement, or an oscillator with a statement")
    return {"oscillator": provable.oscillator, "statement": as_statement(Argument("statement"), provable.statement())}


_EXTRAS = {
    # processes with two classes of results
    "grazing-curves": Extra(
        result="GrazingCurve",
        remark="The result is of class StopGrazingCurves where the stops are not alike: with a fixed stop, a bias, or "
        "even and odd harmonics.",
    ),
    "trajectories": Extra(
        result="Trajectory",
        remark="The result is of class Trajectories for a sequence of states.",
        # the request has 200 only without times
        defaults={"samples_per_period": None},
        several=("initial", "Trajectories"),
    ),
    # a diagram needs no shape
    "unfolding-diagrams": Extra(defaults={"shape": (256, 256)}),
    "orbit-branches": Extra(
        remark="A branch that meets this one at a special point is another request: with ``beyond = "
        "point.beyond[0].request``, ``await client.orbit_branch(**beyond, range=...)`` computes the branch of twice "
        "the period, of lost symmetry, or beyond a graze.",
    ),
    # the name is an action, not a result; points and orbits know their statements
    "proofs": Extra(
        name="prove",
        remark="The result saved as .json is a certificate that ``grazemap check`` verifies without the core. Instead "
        "of an oscillator and a statement, a codimension-two point or a periodic orbit of a result can be given, whose "
        "statement has its own numbers. The worker needs python-flint.",
        forms={"oscillator": Form("OscillatorLike | Provable", "Oscillator or mapping, or a point or an orbit")},
        defaults={"statement": None},
        fields=_provable_fields,
    ),
}


class ProcessMethod:
    """The method of a process, whose name is that of the class of its result; `forms` says how arguments are given."""

    def __init__(self, process: str, result: type[Result]) -> None:
        self.process, self.extra, self._result = process, _EXTRAS.get(process, Extra()), result
        self.name = self.extra.name or re.sub(r"(?<!^)(?=[A-Z])", "_", result.__name__).lower()
        self._request = PROCESSES[process]
        self._request.describe_fields()
        self._fields, self._short = dict(self._request.model_fields), self._request.short
        axes = self._short.axes if self._short else ()
        names = {name: [*self._short.fields] if self._short and (name,) == axes else [name] for name in self._fields}
        self.forms = {name: form_of(field) for name, field in self._fields.items()}
        self.forms |= {**short_forms(self._request), **self.extra.forms}
        self._arguments = [*dict.fromkeys(argument for listed in names.values() for argument in listed)]
        self.forms = {name: self.forms[name] for name in self._arguments}
        self._counted = [name for name, form in self.forms.items() if form.counted]
        self._keyword = "shape" if "vertical" in self._counted else "points" if self._counted else ""
        self.signature = Signature(self._parameters(), return_annotation=result.__name__)

    def _parameters(self) -> list[Parameter]:
        # observables and outputs come last
        observed = [name for name in ObservedRequest.__annotations__ if name in self._fields]
        names = [name for name in self._arguments if name not in observed] + observed
        if self._counted:
            names.insert(names.index(self._counted[-1]) + 1, self._keyword)
            self.forms[self._keyword] = _POINTS if self._keyword == "points" else _SHAPE
        self.forms["progress"] = _PROGRESS
        shown = [Parameter("self", Parameter.POSITIONAL_OR_KEYWORD)]
        for name in (*names, "progress"):
            default = True if name == "progress" else self._default(name)
            kind = Parameter.POSITIONAL_OR_KEYWORD if name == "oscillator" else Parameter.KEYWORD_ONLY
            annotation = self.forms[name].annotation
            if default is None and name != "oscillator" and not annotation.endswith("None"):
                annotation += " | None"
            shown.append(Parameter(name, kind, default=default, annotation=annotation))
        return shown

    def _default(self, name: str) -> Any:
        """Return the default of an argument: that of the field, but None for models and mappings, () for lists."""
        if name in self.extra.defaults:
            return self.extra.defaults[name]
        if self._short and name in (*self._short.axes, *self._short.fields):
            return self._short_default(self._short, name)
        if name not in self._fields:
            return None
        field = self._fields[name]
        if field.is_required():
            return Parameter.empty
        if isinstance(field.default, list):
            return ()
        return field.default if isinstance(field.default, bool | int | float | str) else None

    def _short_default(self, short: ShortForms, name: str) -> Any:
        """Return the default of an argument for what varies: one that is the only way to say so has none."""
        if name == "vary":
            return short.vary or None
        only = short.fields.keys() - {"vary"} == {name}
        return Parameter.empty if only else None

    @property
    def doc(self) -> str:
        """The docstring of the asynchronous method."""
        operation, parameters = self._request.operation, self.signature.parameters
        sections = [
            fill(operation.description, _WIDTH + 4),
            cleandoc(self._request.__doc__ or ""),
            self.extra.remark and fill(self.extra.remark, _WIDTH + 4),
            "Parameters\n----------\n" + "\n".join(map(self._entry, list(parameters.values())[1:])),
            f"Returns\n-------\n{self._result.__name__}\n    {(self._result.__doc__ or '').partition(chr(10))[0]}",
            f"Raises\n------\n{_RAISES}",
            operation.references and f"References\n----------\n{fill(operation.references, _WIDTH + 4)}",
        ]
        return "\n\n".join(filter(None, sections)) + "\n"

    def _entry(self, parameter: Parameter) -> str:
        """Return the description of an argument."""
        name, form, field = parameter.name, self.forms[parameter.name], self._fields.get(parameter.name)
        choices = choices_of(field.annotation) if field else ()
        listed = ", ".join(map(json.dumps, choices))
        kind, more = form.text, form.more
        if choices and form.text == "str":
            kind = f"{{{listed}}}"
        elif choices:
            more = f"Any of {listed}."
        optional = ", optional" if parameter.default is None else ""
        unit = f"{UNITS[name]} in SI." if name in UNITS else ""
        short = self._short.fields.get(name, "") if self._short else ""
        text = " ".join(filter(None, (field.description if field else "", short, unit, more)))
        return f"{name} : {kind}{optional}\n{indent(fill(text, _WIDTH), '    ')}"

    def request_for(self, *arguments: Any, **keywords: Any) -> tuple[ProcessRequest, bool, tuple[str, ...]]:
        """Return the request for some arguments, whether progress is shown, and the units for the result.

        Raises TypeError, ParameterError.
        """
        values = self._bound(arguments, keywords)
        points, keyword = self._points(values), self._keyword
        usual = self.signature.parameters[keyword].default if keyword in self.signature.parameters else None
        is_usual = values.get(keyword) is not None and plain(values[keyword]) == plain(usual)
        body = dict(self.extra.fields(values))
        for name in self._arguments:
            if name not in body and not self._is_left_out(name, values[name]):
                place = Argument(name, points.get(name), keyword, body, is_usual)
                body[name] = self.forms[name].convert(place, values[name])
        body = {name: value for name, value in body.items() if not self._is_left_out(name, value)}
        fields, shown = with_si_numbers(body)
        return self._request.checked(fields), values["progress"], shown

    def _is_left_out(self, name: str, value: Any) -> bool:
        """Return whether a field is left out of the request: its argument is None, which is the default."""
        return value is None and self.signature.parameters[name].default is None

    def _bound(self, arguments: tuple[Any, ...], keywords: Mapping[str, Any]) -> dict[str, Any]:
        known = list(self.signature.parameters)[1:]
        for name in keywords:
            if name not in known:
                near = suggestion(name, known)
                raise TypeError(f"{self.name}() has no argument {name}{near} (allowed: {', '.join(known)})")
        try:
            bound = self.signature.bind(None, *arguments, **keywords)
        except TypeError as error:
            raise TypeError(f"{self.name}(): {error}") from None
        bound.apply_defaults()
        return bound.arguments

    def _points(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return the number of values of each field that may be a range. Raises ParameterError."""
        if self._keyword != "shape":
            return dict.fromkeys(self._counted, values.get("points"))
        try:
            rows, columns = (None, None) if values["shape"] is None else values["shape"]
        except (TypeError, ValueError):
            raise refusal("/shape", "shape is not two numbers", "(vertical points, horizontal points)") from None
        return {name: columns if name in ("omega", "horizontal") else rows for name in self._counted}

    def function(self) -> Callable[..., Coroutine[Any, Any, Result]]:
        """Return the method of the asynchronous client."""

        async def awaited(self_: Any, *arguments: Any, **keywords: Any) -> Result:
            request, progress, shown = self.request_for(*arguments, **keywords)
            result: Result = await self_._compute(self._result, request, progress)
            return result.in_units(*shown)

        method: Any = awaited
        method.__name__, method.__doc__, method.__signature__ = self.name, self.doc, self.signature
        method.__annotations__ = {
            **{name: parameter.annotation for name, parameter in list(self.signature.parameters.items())[1:]},
            "return": self._result.__name__,
        }
        return awaited


def _result_of(process: str) -> type[Result]:
    class_name = _EXTRAS.get(process, Extra()).result
    return next(result for name, result in RESULTS.items() if result.process == process and class_name in ("", name))


METHODS = {method.name: method for method in (ProcessMethod(process, _result_of(process)) for process in PROCESSES)}
"""The methods of all processes by their names."""
