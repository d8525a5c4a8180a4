"""Write the tables of results' fields in docs/api.md and docs/sdk.md: `python docs/field_tables.py`.

A table stands between ``<!-- fields of NAME -->`` and ``<!-- end of fields -->``, where NAME is that of a result or a
record in the schemas, or "classes" for the table of the client's classes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from grazemap.results import RESULTS
from grazemap.results.base import Result
from grazemap.schema import SCHEMAS, Field, Record, ResultSchema

FOLDER = Path(__file__).parent
PAGES = ("api.md", "sdk.md")
_TABLE = re.compile(r"(<!-- fields of ([\w-]+) -->\n).*?(<!-- end of fields -->)", re.DOTALL)
_DTYPES = {"float": "float64", "int": "int64", "bool": "bool", "str": "text", "complex": "complex"}


def written(text: str) -> str:
    """Return a page with its tables as they should be. Raises KeyError for a name that no schema has."""
    return _TABLE.sub(lambda found: found[1] + _table(found[2]) + found[3], text)


def _table(name: str) -> str:
    rows = _classes() if name == "classes" else _fields(_records()[name])
    return "\n".join(rows) + "\n"


def _records() -> dict[str, Record]:
    def inside(record: Record) -> Iterator[Record]:
        yield record
        for one in _all_fields(record):
            if isinstance(one.type, Record):
                yield from inside(one.type)

    return {record.name: record for schema in SCHEMAS for record in inside(schema)}


def _all_fields(record: Record) -> tuple[Field, ...]:
    return (*record, *record.in_json) if isinstance(record, ResultSchema) else record.fields


def _fields(record: Record) -> Iterator[str]:
    yield "| field | type | unit in SI | |"
    yield "|---|---|---|---|"
    for one in _all_fields(record):
        index = f" A position in `{one.index_of}`." if one.index_of else ""
        null = " May be null." if one.null else ""
        when = f" Only {one.when}." if one.when else ""
        text = (one.description + index + null + when).replace("|", "\\|")
        yield f"| `{one.name}` | {_type(one)} | {one.unit} | {text} |"


def _type(one: Field) -> str:
    if isinstance(one.type, Record):
        name = f"{one.type.name}"
    elif isinstance(one.type, str):
        name = one.dtype or _DTYPES[one.type]
    else:
        name = "request"
    return f"{name} [{', '.join(one.dims)}]" if one.dims else name


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


def _attributes(record: Record, kind: type | None = None) -> str:
    parts = []
    for one in record:
        if one.replaces or one.name == "at_computed":
            continue
        dims = f" [{', '.join(one.dims)}]" if one.dims else ""
        inner = ""
        if isinstance(one.type, Record) and one.type.name not in RESULTS and one.type.name != "TrajectoryRecord":
            inner = f": {one.type.name}"
        parts.append(f"{one.name}{dims}{inner}")
    return "; ".join(parts)


def main() -> None:
    """Write the pages."""
    for page in PAGES:
        path = FOLDER / page
        path.write_text(written(path.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    main()
