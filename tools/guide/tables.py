"""Write the tables and signatures that follow from the code, in the guide: `python -m tools.guide.tables`.

A table stands between ``<!-- fields of NAME -->`` and ``<!-- end of fields -->``, where NAME is that of a result or a
record in the schemas, "request-PROCESS" for how a process is called and what it takes, "classes" for the classes of
results with their tables and methods, "processes" for the addresses of all processes, "settings" for the settings of
service and workers, "units" for the units of numbers, "clients" for how a client is made, or "methods" for those of a
client. A process without a page gets one, to be written on by hand.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import partial
from inspect import Parameter, signature
from pathlib import Path
from textwrap import fill
from typing import Any, cast
from unittest.mock import Mock

from grazemap import Client, local
from grazemap.client.process_methods import METHODS
from grazemap.results import RESULTS, SCHEMAS
from grazemap.results.base import Result
from grazemap.results.fields import Field, RecordSchema, ResultSchema
from grazemap.results.observables import OBSERVABLES
from grazemap.results.tables import CURVE, PLANE, POINTS, is_table
from grazemap.units import FIELD_UNITS, OSCILLATOR, units_of
from grazemap.wire import PROCESSES, ProcessRequest, parse_request
from grazemap_service.settings_list import settings

DOCS = Path(__file__).parents[2] / "docs"
REFERENCE = DOCS / "reference"
# The pages that describe records of requests, which many requests have.
_OTHERS = "oscillator.md#other-structures-forces-and-stops"
_PLACES = {"Oscillator": "oscillator.md", "OutputRow": "observables.md"} | {
    **dict.fromkeys(("ClearancePair", "Matrices", "Forcing", "Base", "RestitutionPair", "ContactRow"), _OTHERS),
    **dict.fromkeys(("Axis", "WindowAxis", "ProvenAxis", "Frequencies", "FrequencyWindow"), "varying.md"),
    **dict.fromkeys(("Range", "Interval", "PositiveRange", "PositiveInterval"), "varying.md"),
}
# Bounds beyond this keep powers of numbers finite, and tell nobody anything.
_LARGE = 1e30
# In a block of its own, or sent by curl.
_BODY = re.compile(r"(?:^```json\n|-d ')\s*(\{.*?)(?:```|')", re.DOTALL | re.MULTILINE)
_TABLE = re.compile(r"(<!-- fields of ([\w-]+) -->\n).*?(<!-- end of fields -->)", re.DOTALL)


def pages() -> list[Path]:
    """Return the pages that have tables."""
    return [DOCS / "sdk.md", DOCS / "operations.md", *sorted(REFERENCE.glob("*.md"))]


def written(text: str) -> str:
    """Return a page with its tables as they should be. Raises KeyError for a name that no schema has."""
    return _TABLE.sub(lambda found: found[1] + _table(found[2], _lead(text)) + found[3], text)


def _lead(text: str) -> str:
    """Return what is written by hand above the first section of a page."""
    return _TABLE.sub("", text).partition("\n## ")[0]


def requests_in(text: str, process: str) -> list[ProcessRequest]:
    """Return the requests of a process that a text shows as bodies, in JSON."""
    requests = []
    for body in _BODY.findall(text):
        with suppress(ValueError):  # a part of a result, or a request of another process
            requests.append(parse_request(process, json.loads(body)))
    return requests


def _results(process: str) -> list[ResultSchema]:
    return [schema for schema in SCHEMAS if schema.process == process]


def new_page(process: str) -> str:
    """Return a page about a process, to be written on by hand."""
    parts = [f"# {PROCESSES[process].operation.summary}"]
    parts.append(f"<!-- fields of request-{process} -->\n<!-- end of fields -->")
    for schema in _results(process):
        parts += [schema.description, f"<!-- fields of {schema.name} -->\n<!-- end of fields -->"]
    return "\n\n".join(parts) + "\n"


def _table(name: str, lead: str) -> str:
    parts: dict[str, Callable[[], Iterator[str]]] = {
        "classes": _classes,
        "processes": _processes,
        "clients": _clients,
        "methods": _methods,
        "settings": _settings,
        "units": _units,
    }
    parts |= {f"request-{process}": partial(_request, process, lead) for process in PROCESSES}
    rows = parts[name]() if name in parts else _fields(_records()[name])
    return "\n".join(rows) + "\n"


def _records(results: Iterable[ResultSchema] = SCHEMAS) -> dict[str, RecordSchema]:
    def inside(record: RecordSchema) -> Iterator[RecordSchema]:
        yield record
        for one in _all_fields(record):
            if isinstance(one.type, RecordSchema):
                yield from inside(one.type)

    return {record.name: record for schema in results for record in inside(schema)}


def _all_fields(record: RecordSchema) -> tuple[Field, ...]:
    return (*record, *record.in_json) if isinstance(record, ResultSchema) else record.fields


def _fields(record: RecordSchema) -> Iterator[str]:
    yield "| field | type | unit in SI | |"
    yield "|---|---|---|---|"
    named = [one for one in _all_fields(record) if one.name not in OBSERVABLES]
    for one in named:
        index = f" A position in `{one.index_of}`." if one.index_of else ""
        null = " May be null." if one.null else ""
        when = f" Only {one.when}." if one.when else ""
        text = (one.description + index + null + when).replace("|", "\\|")
        yield f"| `{one.name}` | {_type(one)} | {one.unit} | {text} |"
    if len(named) < len(_all_fields(record)):
        yield "| an observable |  |  | By its name, where [`observables`](observables.md) names it. |"


def _type(one: Field) -> str:
    if isinstance(one.type, RecordSchema):
        name = f"{one.type.name}"
    elif isinstance(one.type, str):
        name = {"str": "text", "complex": "complex"}.get(one.type, one.stored_dtype)
    else:
        name = "request"
    return f"{name} [{', '.join(one.dims)}]" if one.dims else name


def _request(process: str, lead: str) -> Iterator[str]:
    """Yield how a process is called, the fields of its request, and those of the records in it.

    A request in JSON is among them, unless `lead`, which is above the first section of the page, shows one.
    """
    request = PROCESSES[process]
    schema = request.model_json_schema()
    records, method = schema["$defs"], method_of(process)
    yield f"{request.operation.description}\n"
    yield "```py"
    yield _call(f"client.{method}", getattr(Client, method), width=88)
    yield "```\n"
    results = _or(_result_names(process))
    yield f"`POST /v1/{process}` over HTTP, `grazemap {process}` on the command line. The result is a {results}.\n"
    if not requests_in(lead, process):
        yield f"For example, over HTTP:\n\n```json\n{_example(request)}\n```\n"
    yield from _record({**schema, "properties": _with_short_forms(request, schema["properties"])}, records)
    for name in _own_records(schema, records):
        yield f"\n`{name}`: {records[name]['description'].partition(chr(10) * 2)[0].replace(chr(10), ' ')}\n"
        yield from _record(records[name], records)


def _example(request: type[ProcessRequest]) -> str:
    """Return the first example of a process as people write it, in JSON."""
    body = request.short_form(next(iter(request.operation.examples.values())))
    return fill(json.dumps(body), 118, subsequent_indent=" ", break_on_hyphens=False)


def _with_short_forms(request: type[ProcessRequest], fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a request with what may be written in place of its axes, after these."""
    short = request.short
    if short is None:
        return dict(fields)
    texts = short.fields
    instead = f"Or {_codes(texts)} in place of it."
    shown: dict[str, Any] = {}
    for name in short.axes:
        shown[name] = {**fields[name], "description": f"{fields[name]['description']} {instead}"}
    for name, text in texts.items():
        known = fields.get(name, {})
        shown[name] = {**known, "description": " ".join(filter(None, (known.get("description"), text)))}
    return {**shown, **{name: field for name, field in fields.items() if name not in shown}}


def _codes(names: Iterable[str]) -> str:
    *first, last = (f"`{name}`" for name in names)
    return f"{', '.join(first)} and {last}" if first else last


def _own_records(schema: Mapping[str, Any], records: Mapping[str, Any]) -> list[str]:
    """Return the records in a request that no page of their own describes, in the order in which they are named."""
    names: dict[str, None] = {}

    def look(part: Any) -> None:
        if isinstance(part, dict):
            name = part.get("$ref", "").rpartition("/")[2]
            if name and name not in _PLACES and name not in names and "properties" in records[name]:
                names[name] = None
                look(records[name]["properties"])
            for value in part.values():
                look(value)
        elif isinstance(part, list):
            for value in part:
                look(value)

    look(schema["properties"])
    return [*names]


def _record(schema: Mapping[str, Any], records: Mapping[str, Any]) -> Iterator[str]:
    """Yield the fields of a record of requests, the required ones first."""
    required = schema.get("required", [])
    yield "| field | default | allowed | |"
    yield "|---|---|---|---|"
    for name in sorted(schema["properties"], key=lambda name: (name not in required, name == "oscillator")):
        field = schema["properties"][name]
        default = "required" if name in required else _default(field)
        text = field.get("description", "").replace("|", "\\|")
        yield f"| `{name}` | {default} | {allowed(field, records)} | {text} |"


def _default(field: Mapping[str, Any]) -> str:
    value = field.get("default")
    # of a record, the fields say their defaults
    return "" if value is None or value == "" or isinstance(value, dict) else f"`{json.dumps(value)}`"


def method_of(process: str) -> str:
    """Return the client's method for a process."""
    (name,) = (name for name, method in METHODS.items() if method.process == process)
    return name


def _result_names(process: str) -> list[str]:
    return [f"`{schema.name}`" for schema in _results(process)]


def _or(names: list[str]) -> str:
    return " or ".join(names)


def allowed(field: Mapping[str, Any], records: Mapping[str, Any]) -> str:
    """Return what a field of a JSON schema may be, in a few words."""
    if "$ref" in field:
        return _named(field["$ref"].rpartition("/")[2])
    if "enum" in field:
        if field["enum"][0] in OBSERVABLES:
            return "[observables](observables.md)"
        return ", ".join(f"`{json.dumps(value)}`" for value in field["enum"])
    if "const" in field:
        return f"`{json.dumps(field['const'])}`"
    for union in ("oneOf", "anyOf"):
        if union in field:
            parts = [part for part in field[union] if part.get("type") != "null"]
            return _or([*dict.fromkeys(allowed(part, records) for part in parts)])
    kind = field.get("type")
    if kind == "array":
        return f"list of {allowed(field['items'], records)}"
    if kind in ("number", "integer"):
        return _numbers(field)
    if kind == "object":
        return f"{allowed(field['additionalProperties'], records)} by name"
    return {"boolean": "`true`, `false`", "string": "text", None: ""}[kind]


def _named(record: str) -> str:
    """Return the name of a record of requests, with a link where another page describes it."""
    place = _PLACES.get(record)
    return record if place is None else f"[{record}]({place})"


def _numbers(field: Mapping[str, Any]) -> str:
    """Return the range of a number; bounds that only keep powers of numbers finite are left out."""
    what = {"number": "number", "integer": "whole number"}[field["type"]]
    low, high = field.get("minimum"), field.get("maximum")
    if "exclusiveMinimum" in field:
        what += f" > {field['exclusiveMinimum']:g}"
    elif low is not None and abs(low) < _LARGE:
        what += f" >= {low:g}"
    if high is not None and high < _LARGE:
        what += f", at most {high:,}" if " >" in what else f" up to {high:,}"
    return what


def _processes() -> Iterator[str]:
    yield "| POST | |"
    yield "|---|---|"
    for process, request in PROCESSES.items():
        yield f"| `/v1/{process}` | {request.operation.description} |"


def _settings() -> Iterator[str]:
    yield "| variable | default | for | meaning |"
    yield "|---|---|---|---|"
    for setting in settings():
        yield f"| `{setting.variable}` | {setting.default} | {setting.readers} | {setting.meaning} |"


def _units() -> Iterator[str]:
    """Yield the fields whose numbers may have a unit, and the units; of parameters that vary too."""
    yield "| numbers of | may be in |"
    yield "|---|---|"
    fields: dict[tuple[str, ...], list[str]] = {}
    for name in FIELD_UNITS:
        field, of, which = name.removeprefix(f"{OSCILLATOR}.").partition(" ")
        fields.setdefault(tuple(units_of(name)), []).append(f"`{field}`{of}{which}")
    for units, names in fields.items():
        yield f"| {', '.join(dict.fromkeys(names))} | {', '.join(units)} |"


def _clients() -> Iterator[str]:
    yield "```py"
    yield _call("Client", Client)
    yield _call("local", local)
    yield "```"


def _methods() -> Iterator[str]:
    yield "| method | result |"
    yield "|---|---|"
    for process in PROCESSES:
        names = _or(_result_names(process))
        yield f"| [`client.{method_of(process)}(..)`](reference/{process}.md) | {names} |"


def _call(name: str, function: Callable[..., Any], width: int = 118) -> str:
    """Return how a function is called, with its defaults."""
    shown: list[str] = []
    for one in signature(function).parameters.values():
        if one.kind is Parameter.KEYWORD_ONLY and "*" not in shown:
            shown.append("*")
        if one.name != "self":
            shown.append(one.name if one.default is Parameter.empty else f"{one.name}={_literal(one.default)}")
    # lines are not broken inside a default
    lines = fill(f"{name}({', '.join(shown)})", width, subsequent_indent="    ", break_on_hyphens=False)
    return lines.replace("\u2007", " ")


def _literal(value: Any) -> str:
    return (json.dumps(value) if isinstance(value, str) else repr(value)).replace(" ", "\u2007")


def _classes() -> Iterator[str]:
    yield "| class | tables | properties and methods |"
    yield "|---|---|---|"
    for schema in SCHEMAS:
        kind = RESULTS[schema.name]
        shown = sorted(name for name, value in vars(kind).items() if _is_public(name, value))
        methods = ", ".join(f"`{name}()`" if callable(vars(kind)[name]) else f"`{name}`" for name in shown)
        tables = ", ".join(f"`{name}`" for name in _possible_tables(schema, kind))
        yield f"| [`{schema.name}`](reference/{schema.process}.md) | {tables} | {methods} |"


def _possible_tables(schema: ResultSchema, kind: type[Result]) -> Iterator[str]:
    """Yield the tables that results of a class may have, in the order of `grazemap.results.tables.tables`."""
    yield from filter(None, (schema.rows,))
    for field in filter(is_table, schema):
        # outputs over points are columns of another table
        if field.name != "outputs" or not any(inner.dims for inner in _all_fields(cast("RecordSchema", field.type))):
            yield field.name
    # their names need no numbers
    yield from kind.derived_tables(Mock())
    planes = (schema, *(field.type for field in schema if isinstance(field.type, ResultSchema)))
    over_a_plane = any(field.dims == PLANE for plane in planes for field in plane.derived)
    if over_a_plane or any(field.dims == CURVE for field in schema):
        yield POINTS


def _is_public(name: str, value: object) -> bool:
    if name.startswith("_") or hasattr(Result, name):
        return False
    return callable(value) or isinstance(value, property)


def main() -> None:
    """Write the pages."""
    for process in PROCESSES:
        path = REFERENCE / f"{process}.md"
        if not path.exists():
            path.write_text(new_page(process), "utf-8")
    for path in pages():
        path.write_text(written(path.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    main()
