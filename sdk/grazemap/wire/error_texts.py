"""The text of an error in a request, from pydantic's: where it is, what is wrong, and what is allowed.

`allowed` is taken from the JSON schema of the request's model at the place of the error, so it cannot disagree with the
validation.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from functools import cache
from typing import Any, NamedTuple

from pydantic import BaseModel

from grazemap.constants import LARGEST_NUMBER, SMALLEST_NUMBER

Schema = Mapping[str, Any]
# All known names are much shorter, and the comparison of longer names takes time.
_LONGEST_NAME = 64
# Messages of these types contain no input; every other type has a sentence below.
_QUOTABLE = {
    "greater_than",
    "greater_than_equal",
    "less_than",
    "less_than_equal",
    "too_short",
    "too_long",
    "finite_number",
    "float_type",
    "int_type",
    "bool_type",
    "list_type",
    "dict_type",
    "literal_error",
    "not_allowed",
}
_SENTENCES = {
    "missing": "Field required",
    "extra_forbidden": "Unknown field",
    "model_type": "Input should be an object",
    "model_attributes_type": "Input should be an object",
}
UNITS = {"omega": "rad/s", "clearance": "m", "clearance_right": "m", "clearance_left": "m"}
"""The units of parameters in SI."""
ONLY_IN_FLAGS = "; units are written on the command line only"
"""What is said of numbers that have a unit in SI."""
_OF_EVERY_NUMBER = {SMALLEST_NUMBER, LARGEST_NUMBER}
# Query parameters have no schema here.
_PARSED = {"int_parsing": "an integer", "bool_parsing": "true or false"}


class ErrorText(NamedTuple):
    """An error in a request."""

    source: str
    """Either "body" or "query"."""
    where: list[str | int]
    """The names and numbers that lead to the place; for an unknown field, to its object."""
    unknown: str
    """The name of an unknown field, else ""."""
    detail: str
    """What is wrong."""
    allowed: str
    """What is allowed, if that is said."""


def error_text(error: Mapping[str, Any], schema: Schema, naming: bool) -> ErrorText:
    """Return the text of one of pydantic's errors.

    Parameters
    ----------
    error : mapping
        As from ``ValidationError.errors()``; its location begins with "body" or "query".
    schema : JSON schema
        Of the model of the body, empty without one.
    naming : bool
        Whether an unknown field, or a value of a validator, is named; the service does not repeat it.
    """
    source, *rest = error["loc"] or ("body",)
    kind = str(error["type"])
    unknown = ""
    if kind == "extra_forbidden":
        unknown = str(rest.pop())
    # the names of union branches, such as "[range]", are not in the body
    where = [part for part in rest if not (isinstance(part, str) and part.startswith("["))]
    context = error.get("ctx") or {}
    where += context.get("at", ())
    # a message of our own ends with what is allowed, which has its own field here
    detail = (
        str(context.get("reason", error["msg"]))
        if kind in _QUOTABLE
        else _SENTENCES.get(kind, "Input is not valid here")
    )
    here = _at(schema, where)
    if kind == "extra_forbidden":
        detail += f" {json.dumps(unknown[:_LONGEST_NAME])}" if naming else ""
        detail += suggestion(unknown, [name for one in here for name in one.get("properties", ())])
    allowed = str(context["allowed"]) if "allowed" in context else _describe(here, schema)
    if naming and context.get("value"):
        detail += f", {context['value']}"
    if kind == "float_type" and (unit := next((UNITS[part] for part in reversed(where) if part in UNITS), "")):
        allowed += f", in {unit} in SI{ONLY_IN_FLAGS}"
    if source != "body" and not allowed:
        allowed = _allowed_of_context(context) or _PARSED.get(kind, "")
    return ErrorText(source, where, unknown, detail, allowed)


@cache
def schema_of(model: type[BaseModel]) -> Schema:
    """Return the JSON schema of a model (computed once)."""
    return model.model_json_schema()


def suggestion(unknown: str, known: Iterable[str]) -> str:
    """Return a suggestion of a known name for an unknown one, or "" where none is similar."""
    near = get_close_matches(unknown, list(known), n=1) if len(unknown) <= _LONGEST_NAME else []
    return f"; did you mean {near[0]}" if near else ""


def _allowed_of_context(context: Mapping[str, Any]) -> str:
    signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    bounds = [f"{sign} {context[key]}" for key, sign in signs.items() if key in context]
    if "pattern" in context:
        return f"text of the pattern {context['pattern']}"
    if "max_length" in context:
        return f"at most {context['max_length']} characters"
    return str(context["expected"]) if "expected" in context else ", ".join(bounds)


def _resolve(schema: Schema, root: Schema) -> Schema:
    while "$ref" in schema:
        schema = root["$defs"][schema["$ref"].rpartition("/")[2]]
    return schema


def branches(schema: Schema, root: Schema) -> list[Schema]:
    """Return the alternatives of a schema, one level of union resolved."""
    schema = _resolve(schema, root)
    options = schema.get("oneOf") or schema.get("anyOf")
    return [branch for option in options for branch in branches(option, root)] if options else [schema]


def _at(root: Schema, where: Sequence[Any]) -> list[Schema]:
    """Return the alternatives of the schema at a place in the body, none where the schema has no such place."""
    found = branches(root, root) if root else []
    for part in where:
        if isinstance(part, int):
            below = [schema["items"] for schema in found if "items" in schema]
        else:
            below = [schema["properties"][part] for schema in found if part in schema.get("properties", {})]
        found = [branch for schema in below for branch in branches(schema, root)]
    return found


def _describe(schemas: Sequence[Schema], root: Schema) -> str:
    return " or ".join(filter(None, (_describe_one(schema, root) for schema in schemas)))


def _describe_one(schema: Schema, root: Schema) -> str:
    if "const" in schema:
        return json.dumps(schema["const"])
    if "enum" in schema:
        return "one of " + ", ".join(map(json.dumps, schema["enum"]))
    kind = schema.get("type")
    if kind in {"number", "integer"}:
        noun = "an integer" if kind == "integer" else "a finite number"
        return " ".join(filter(None, (noun, _bounds(schema))))
    if kind == "array":
        items = _describe(branches(schema.get("items", {}), root), root) or "any value"
        minimum, maximum = schema.get("minItems"), schema.get("maxItems")
        counts = f"{minimum or 0} to {maximum}: " if maximum else f"at least {minimum}: " if minimum else ""
        return f"a list of {counts}{items}"
    if schema.get("properties"):
        return "an object with the fields " + ", ".join(schema["properties"])
    if kind == "object":
        return "an object"
    return str(kind) if kind and kind != "null" else ""


def _bounds(schema: Schema) -> str:
    signs = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
    bounds = [(sign, schema[key]) for key, sign in signs.items() if key in schema]
    # those of every number are said where a number is outside
    return " and ".join(f"{sign} {value:.15g}" for sign, value in bounds if abs(value) not in _OF_EVERY_NUMBER)
