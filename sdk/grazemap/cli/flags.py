"""The flags of a process, derived from the JSON schema of its request and its short forms.

Every field is a flag. A field of an object in the request has the name of the object in front, as in `--initial-phase`,
but fields of the oscillator have their own name alone. A range is written start:stop:points or start:stop, a list with
commas. What varies has the flags of the short forms: `--omega 0.26:0.3:64`, `--vary damping --range 0.5:1.5:41`. Lists
of objects, lists of lists, and objects that require such a list have no flag.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from grazemap import units
from grazemap.wire import PROCESSES
from grazemap.wire.error_texts import Schema, branches, schema_of, written_schema

_RANGE = ("start", "stop", "points")
_WORDS = {"number": "NUMBER", "integer": "INTEGER", "string": "TEXT", "boolean": "SWITCH"}


@dataclass(frozen=True)
class Flag:
    """The flag of a field."""

    place: tuple[str, ...]
    """The names that lead to the field in the request."""
    name: str
    """The name of the flag, with its hyphens."""
    alternatives: tuple[Schema, ...]
    """The schemas of the field's alternatives that can be written as text."""
    description: str
    """What it is, for the help."""

    @property
    def pointer(self) -> str:
        """The JSON pointer of the field, which is also the name of the flag's value among the options of a command."""
        return "/".join(("", *self.place))

    @property
    def field(self) -> str:
        """The name of the field that says which quantity it is: of `clearance.right` it is `clearance`."""
        if self.place[0] == units.OSCILLATOR:
            return ".".join(self.place)
        return self.place[-2] if self.place[-1] in ("right", "left") else self.place[-1]

    @property
    def forms(self) -> list[str]:
        """The forms in which a value can be written; none for a switch."""
        return [] if self.switch else list(map(_form, self.alternatives))

    @property
    def choices(self) -> list[str]:
        """The names that are allowed as values; empty where values are not names."""
        return [str(value) for alternative in self.alternatives for value in alternative.get("enum", ())]

    @property
    def switch(self) -> bool:
        """Whether the flag has no value."""
        return self._types == {"boolean"}

    @property
    def ambiguous(self) -> bool:
        """Whether both a range with points and a list can be written."""
        return "array" in self._types and any("points" in schema.get("properties", ()) for schema in self.alternatives)

    @property
    def _types(self) -> set[str]:
        return {alternative.get("type", "string") for alternative in self.alternatives}

    def value(self, text: str) -> Any:
        """Return the JSON value that a text stands for; a text of another form is returned as it is."""
        parts = text.split(":")
        if "object" in self._types and 2 <= len(parts) <= len(_RANGE):
            return {name: _number(part) for name, part in zip(_RANGE, parts, strict=False)}
        if "array" in self._types and ("," in text or self._types == {"array"}):
            return [_number(part) for part in text.removesuffix(",").split(",")]
        return text if self._types == {"string"} else _number(text)

    def words(self, value: Any) -> list[str]:
        """Return the words of a command line that stand for a JSON value."""
        if isinstance(value, bool):
            return [self.name if value else f"--no-{self.name[2:]}"]
        return [self.name, _written(value)]


@cache
def flags_of(process: str) -> tuple[Flag, ...]:
    """Return the flags of a process in the order of its fields."""
    schema = written_schema(PROCESSES[process])
    return tuple(_flags(schema, schema, ()))


def flags_of_short_forms(process: str) -> list[Flag]:
    """Return the flags whose fields the long form of the request lacks, or has with other values."""
    schema = schema_of(PROCESSES[process])
    long_form = list(_flags(schema, schema, ()))
    return [flag for flag in flags_of(process) if flag not in long_form]


def fields_without_flag(process: str) -> list[str]:
    """Return the names of the fields that have values which no flag can express."""
    schema = written_schema(PROCESSES[process])
    oscillator = _alternatives(schema["properties"][units.OSCILLATOR], schema)[0]
    return [
        name
        for name, field in (*schema["properties"].items(), *oscillator["properties"].items())
        if any(not _form(item) and not _has_flags(item, schema) for item in _alternatives(field, schema))
    ]


def add_flags(parser: argparse.ArgumentParser, process: str) -> None:
    """Add the flags of a process to a parser. The options have the values of flags that are used, by JSON pointer."""
    rest = fields_without_flag(process)
    request = parser.add_argument_group(
        "request", f"Only --json has every form of: {', '.join(rest)}." if rest else None
    )
    oscillator = parser.add_argument_group("oscillator")
    for flag in flags_of(process):
        group = oscillator if flag.place[0] == units.OSCILLATOR else request
        keywords: dict[str, Any] = {"action": argparse.BooleanOptionalAction}
        if not flag.switch:
            keywords = {"metavar": "|".join(flag.forms), "choices": _OpenChoices(flag.choices) or None}
        description = flag.description.replace("%", "%%")
        if flag.field in units.FIELD_UNITS:
            description += f" In SI also as {units.example(flag.field)}."
        group.add_argument(flag.name, dest=flag.pointer, default=argparse.SUPPRESS, help=description, **keywords)


def example(process: str) -> list[str]:
    """Return the words of a command line for the first example of a process."""
    model = PROCESSES[process]
    request = model.short_form(next(iter(model.operation.examples.values())))
    values = ((flag, value_at(request, flag.place)) for flag in flags_of(process))
    return [process, *(word for flag, value in values if value is not None for word in flag.words(value))]


def value_at(value: Any, place: tuple[str, ...]) -> Any:
    """Return the value at a place in a JSON value, None if there is none."""
    for part in place:
        if isinstance(value, Mapping):
            value = value.get(part)
        elif isinstance(value, list) and part.isdigit() and int(part) < len(value):
            value = value[int(part)]
        else:
            return None
    return value


class _OpenChoices(tuple[str, ...]):
    """Choices for help and completion only. Other values are refused by the model of the request, with all errors."""

    def __contains__(self, _: object) -> bool:
        return True


def _flags(schema: Schema, root: Schema, place: tuple[str, ...]) -> Iterator[Flag]:
    for field, subschema in schema["properties"].items():
        field_place = (*place, field)
        alternatives = _alternatives(subschema, root)
        simple = tuple(alternative for alternative in alternatives if _form(alternative))
        if simple:
            name = "-".join(part for part in field_place if part != units.OSCILLATOR).replace("_", "-")
            yield Flag(field_place, f"--{name}", simple, _description(subschema))
        for alternative in alternatives:
            if _has_flags(alternative, root):
                yield from _flags(alternative, root, field_place)


def _has_flags(schema: Schema, root: Schema) -> bool:
    """Return whether an alternative is an object that the flags of its fields can express."""
    if "properties" not in schema or _form(schema):
        return False
    required = (schema["properties"][name] for name in schema.get("required", ()))
    return all(any(_form(item) or _has_flags(item, root) for item in _alternatives(field, root)) for field in required)


def _alternatives(field: Schema, root: Schema) -> list[Schema]:
    """Return the schemas of the alternatives of a field; the schema of a list has the schema of its items inside."""
    schemas = [schema for schema in branches(field, root) if schema.get("type") != "null"]
    return [
        {**schema, "items": branches(schema["items"], root)[0]} if "items" in schema else schema for schema in schemas
    ]


def _form(schema: Schema) -> str:
    """Return the form in which a value is written, "" where no text can express it."""
    if "enum" in schema:
        return f"{{{','.join(map(str, schema['enum']))}}}"
    kind = schema.get("type", "")
    if kind == "array":
        is_enum, kind = "enum" in schema["items"], schema["items"].get("type")
        item = "NAME" if is_enum and kind == "string" else "" if kind in ("array", "object") else _form(schema["items"])
        return item and f"{item},{item},..."
    if kind == "object":
        names = tuple(schema.get("properties", ()))
        return ":".join(names).upper() if names in (_RANGE, _RANGE[:2]) else ""
    return _WORDS.get(kind, "")


def _description(field: Schema) -> str:
    default, text = field.get("default"), str(field.get("description", ""))
    simple = default not in (None, []) and not isinstance(default, dict)
    return f"{text} (default: {_written(default)})" if simple else text


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ":".join(str(value[name]) for name in _RANGE if name in value)
    if isinstance(value, list):
        return ",".join(map(str, value)) + ("," if len(value) == 1 else "")
    return str(value)


def _number(text: str) -> Any:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
