"""Write the tables and signatures that follow from the code, in the guides: `python docs/field_tables.py`.

A table stands between ``<!-- fields of NAME -->`` and ``<!-- end of fields -->``, where NAME is that of a result or a
record in the schemas, "classes" for the table of the client's classes, "processes" for the addresses of all processes,
"settings" for the settings of service and workers, or "clients" and "methods" for the signatures of the client. A
process without a section in the guide of the API gets one, to be written on by hand.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator
from inspect import Parameter, signature
from pathlib import Path
from textwrap import fill
from typing import Any

from grazemap import Client, local
from grazemap.client.process_methods import METHODS
from grazemap.results import RESULTS, SCHEMAS
from grazemap.results.base import Result
from grazemap.results.fields import Field, RecordSchema, ResultSchema
from grazemap.wire import PROCESSES
from grazemap_service.settings_list import settings

FOLDER = Path(__file__).parent
PAGES = ("api.md", "sdk.md", "operations.md")
_TABLE = re.compile(r"(<!-- fields of ([\w-]+) -->\n).*?(<!-- end of fields -->)", re.DOTALL)
_LAST_PROCESS = "\n## Following a job\n"


def written(text: str) -> str:
    """Return a page with its tables as they should be. Raises KeyError for a name that no schema has."""
    return _TABLE.sub(lambda found: found[1] + _table(found[2]) + found[3], text)


def with_sections(guide: str) -> str:
    """Return the guide of the API with a section for every process of whose results it has no table."""
    tables = {found[2] for found in _TABLE.finditer(guide)}
    missing = [name for name in PROCESSES if not tables & _records(_results(name)).keys()]
    sections = "".join(f"\n{part}" for name in missing for part in _section(name))
    return guide.replace(_LAST_PROCESS, sections + _LAST_PROCESS)


def _results(process: str) -> list[ResultSchema]:
    return [schema for schema in SCHEMAS if schema.process == process]


def _section(process: str) -> Iterator[str]:
    operation = PROCESSES[process].operation
    yield f"## {operation.summary}\n"
    yield fill(f"{operation.description} `POST /v1/{process}` takes:", 120) + "\n"
    yield "```json"
    yield json.dumps(next(iter(operation.examples.values()))) + "\n```\n"
    for schema in _results(process):
        yield f"{schema.description}\n"
        yield f"<!-- fields of {schema.name} -->\n<!-- end of fields -->\n"


def _table(name: str) -> str:
    parts = {
        "classes": _classes,
        "processes": _processes,
        "clients": _clients,
        "methods": _methods,
        "settings": _settings,
    }
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
    for one in _all_fields(record):
        index = f" A position in `{one.index_of}`." if one.index_of else ""
        null = " May be null." if one.null else ""
        when = f" Only {one.when}." if one.when else ""
        text = (one.description + index + null + when).replace("|", "\\|")
        yield f"| `{one.name}` | {_type(one)} | {one.unit} | {text} |"


def _type(one: Field) -> str:
    if isinstance(one.type, RecordSchema):
        name = f"{one.type.name}"
    elif isinstance(one.type, str):
        name = {"str": "text", "complex": "complex"}.get(one.type, one.stored_dtype)
    else:
        name = "request"
    return f"{name} [{', '.join(one.dims)}]" if one.dims else name


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


def _clients() -> Iterator[str]:
    yield "```python"
    yield _call("Client", Client)
    yield _call("local", local)
    yield "```"


def _methods() -> Iterator[str]:
    yield "```python"
    for name in METHODS:
        yield _call(f"client.{name}", getattr(Client, name))
    yield "```"


def _call(name: str, function: Callable[..., Any]) -> str:
    """Return how a function is called, with its defaults."""
    shown: list[str] = []
    for one in signature(function).parameters.values():
        if one.kind is Parameter.KEYWORD_ONLY and "*" not in shown:
            shown.append("*")
        if one.name != "self":
            shown.append(one.name if one.default is Parameter.empty else f"{one.name}={_literal(one.default)}")
    # lines are not broken inside a default
    lines = fill(f"{name}({', '.join(shown)})", 118, subsequent_indent="    ", break_on_hyphens=False)
    return lines.replace("\u2007", " ")


def _literal(value: Any) -> str:
    return (json.dumps(value) if isinstance(value, str) else repr(value)).replace(" ", "\u2007")


def _classes() -> Iterator[str]:
    yield "| class | attributes | and |"
    yield "|---|---|---|"
    for schema in SCHEMAS:
        kind = RESULTS[schema.name]
        shown = sorted(name for name, value in vars(kind).items() if _is_public(name, value))
        methods = ", ".join(f"`{name}()`" if callable(vars(kind)[name]) else f"`{name}`" for name in shown)
        yield f"| `{schema.name}` | {_attributes(schema, kind)} | {methods} |"


def _is_public(name: str, value: object) -> bool:
    if name.startswith("_") or hasattr(Result, name):
        return False
    return callable(value) or isinstance(value, property)


def _attributes(record: RecordSchema, kind: type | None = None) -> str:
    parts = []
    for one in record:
        if one.stored_only:
            continue
        dims = f" [{', '.join(one.dims)}]" if one.dims else ""
        inner = ""
        if isinstance(one.type, RecordSchema) and one.type.name not in RESULTS and one.type.name != "TrajectoryRecord":
            inner = f": {one.type.name}"
        parts.append(f"{one.name}{dims}{inner}")
    return "; ".join(parts)


def main() -> None:
    """Write the pages."""
    for page in PAGES:
        path = FOLDER / page
        text = path.read_text("utf-8")
        path.write_text(written(with_sections(text) if page == "api.md" else text), "utf-8")


if __name__ == "__main__":
    main()
