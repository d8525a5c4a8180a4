"""The flags of a process, derived from the JSON schema of its request.

A field is a flag, and so is every field of an object in the request, with the names of both: `--initial-phase`. Fields
of the oscillator have their own name alone. A range is written start:stop:points or start:stop, a list with commas.
Lists of objects and of lists have no flag, nor has an object that needs one.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from grazemap.cli import units
from grazemap.wire import PROCESSES
from grazemap.wire.error_texts import Schema, branches, schema_of

_WITHOUT_PREFIX = "oscillator"
_RANGE = ("start", "stop", "points")
_WORDS = {"number": "NUMBER", "integer": "INTEGER", "string": "TEXT", "boolean": "SWITCH"}


@dataclass(frozen=True)
class Flag:
    """The flag of a field."""

    place: tuple[str, ...]
    """The names that lead to the field in the request."""
    name: str
    """With its hyphens."""
    alternatives: tuple[Schema, ...]
    """The schemas of the field's alternatives that can be written as text."""
    description: str
    """What it is, for the help."""

    @property
    def pointer(self) -> str:
        """The JSON pointer of the field, under which the flag is found among the options of a command."""
        return "/".join(("", *self.place))

    @property
    def field(self) -> str:
        """The name of the field that has the quantity: that above the two stops, else its own."""
        return self.place[-2] if self.place[-1] in ("right", "left") else self.place[-1]

    @property
    def forms(self) -> list[str]:
        """How a value is written; nothing for a switch."""
        return [] if self.switch else list(map(_form, self.alternatives))

    @property
    def choices(self) -> list[str]:
        """The texts that are values, where there are such."""
        return [str(value) for one in self.alternatives for value in one.get("enum", ())]

    @property
    def switch(self) -> bool:
        """Whether the flag has no value."""
        return self._types == {"boolean"}

    @property
    def ambiguous(self) -> bool:
        """Whether both a range with points and a list can be written."""
        return "array" in self._types and any("points" in one.get("properties", ()) for one in self.alternatives)

    @property
    def _types(self) -> set[str]:
        return {one.get("type", "string") for one in self.alternatives}

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
    schema = schema_of(PROCESSES[process])
    return tuple(_flags(schema, schema, ()))


def without_flag(process: str) -> list[str]:
    """Return the names of the fields of which some or all values have no flag."""
    schema = schema_of(PROCESSES[process])
    oscillator = _alternatives(schema["properties"][_WITHOUT_PREFIX], schema)[0]
    return [
        name
        for name, field in (*schema["properties"].items(), *oscillator["properties"].items())
        if any(not _form(one) and not _has_flags(one, schema) for one in _alternatives(field, schema))
    ]


def add_flags(parser: argparse.ArgumentParser, process: str) -> None:
    """Add the flags of a process to a parser; those that are given are in its options under their pointer."""
    rest = without_flag(process)
    request = parser.add_argument_group(
        "request", f"Only --json has every form of: {', '.join(rest)}." if rest else None
    )
    oscillator = parser.add_argument_group("oscillator")
    for flag in flags_of(process):
        group = oscillator if flag.place[0] == _WITHOUT_PREFIX else request
        keywords: dict[str, Any] = {"action": argparse.BooleanOptionalAction}
        if not flag.switch:
            keywords = {"metavar": "|".join(flag.forms), "choices": _Offered(flag.choices) or None}
        description = flag.description.replace("%", "%%")
        if units.has_units(flag.field):
            description += f" In SI also as {units.example(flag.field)}."
        group.add_argument(flag.name, dest=flag.pointer, default=argparse.SUPPRESS, help=description, **keywords)


def example(process: str) -> list[str]:
    """Return the words of a command line for the first example of a process."""
    request = next(iter(PROCESSES[process].operation.examples.values()))
    found = ((flag, at(request, flag.place)) for flag in flags_of(process))
    return [process, *(word for flag, value in found if value is not None for word in flag.words(value))]


def at(value: Any, place: tuple[str, ...]) -> Any:
    """Return the value at a place in a JSON value, None if there is none."""
    for part in place:
        if isinstance(value, Mapping):
            value = value.get(part)
        elif isinstance(value, list) and part.isdigit() and int(part) < len(value):
            value = value[int(part)]
        else:
            return None
    return value


class _Offered(tuple[str, ...]):
    """Choices for help and completion; the request's model refuses others, together with all other errors."""

    def __contains__(self, _: object) -> bool:
        return True


def _flags(schema: Schema, root: Schema, place: tuple[str, ...]) -> Iterator[Flag]:
    for field, below in schema["properties"].items():
        here = (*place, field)
        alternatives = _alternatives(below, root)
        simple = tuple(one for one in alternatives if _form(one))
        if simple:
            name = "-".join(part for part in here if part != _WITHOUT_PREFIX).replace("_", "-")
            yield Flag(here, f"--{name}", simple, _description(below))
        for one in alternatives:
            if _has_flags(one, root):
                yield from _flags(one, root, here)


def _has_flags(schema: Schema, root: Schema) -> bool:
    """Return whether an alternative is an object that can be given by the flags of its fields."""
    if "properties" not in schema or _form(schema):
        return False
    required = (schema["properties"][name] for name in schema.get("required", ()))
    return all(any(_form(one) or _has_flags(one, root) for one in _alternatives(field, root)) for field in required)


def _alternatives(field: Schema, root: Schema) -> list[Schema]:
    """Return the alternatives of a field; those of a list have its items resolved."""
    found = [one for one in branches(field, root) if one.get("type") != "null"]
    return [{**one, "items": branches(one["items"], root)[0]} if "items" in one else one for one in found]


def _form(schema: Schema) -> str:
    """Return how a value is written, "" where it cannot be."""
    if "enum" in schema:
        return f"{{{','.join(map(str, schema['enum']))}}}"
    kind = schema.get("type", "")
    if kind == "array":
        named, kind = "enum" in schema["items"], schema["items"].get("type")
        item = "NAME" if named and kind == "string" else "" if kind in ("array", "object") else _form(schema["items"])
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
