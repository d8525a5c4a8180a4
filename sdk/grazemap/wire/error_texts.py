"""What the errors of a model say: pydantic's message, and what is allowed where the error is.

The latter is described from the JSON schema of the model, so it cannot disagree with the validation.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from functools import cache
from typing import Any

from pydantic import BaseModel
from pydantic_core import InitErrorDetails, PydanticCustomError

from grazemap.constants import LARGEST_NUMBER, SMALLEST_NUMBER
from grazemap.suggestions import LONGEST_NAME, suggestion

Schema = Mapping[str, Any]
# In place of messages that name classes of Python or quote the input.
_NO_ALTERNATIVE, _NO_OBJECT = "Input is not valid here", "Input should be an object"
_MESSAGES = {
    "extra_forbidden": "Unknown field",
    "model_type": _NO_OBJECT,
    "model_attributes_type": _NO_OBJECT,
    "dict_type": _NO_OBJECT,
    "literal_error": "Input is none of the allowed values",
    "union_tag_invalid": _NO_ALTERNATIVE,
    "union_tag_not_found": _NO_ALTERNATIVE,
}
_OF_OBJECTS = {"extra_forbidden", "model_type", "model_attributes_type"}
_OF_EVERY_NUMBER = {SMALLEST_NUMBER, LARGEST_NUMBER}


def explained(error: Mapping[str, Any], model: type[BaseModel]) -> InitErrorDetails:
    """Return an error of a model, as from ``ValidationError.errors()``, that says what is allowed.

    Its context has the parts of its message: `detail`, what is wrong; `value`, what was sent, which a service does not
    repeat; `hint`, a name that may be meant; and `allowed`. Those of a validator, and of the model of a part, stay.
    """
    kind = error["type"]
    # the names of union branches, such as "[range]", are not in the body; an unknown field may have any name
    known = error["loc"][:-1] if kind == "extra_forbidden" else error["loc"]
    place = [part for part in known if not (isinstance(part, str) and part.startswith("["))]
    place += error["loc"][len(known) :]
    context = {"value": "", "hint": "", **error.get("ctx", {})}
    if "detail" not in context:
        context["detail"] = _MESSAGES.get(kind, error["msg"].replace(" after validation", ""))
        where = place[:-1] if kind == "extra_forbidden" else place
        schemas = [schema_of(model)]
        if kind in _OF_OBJECTS:  # which may have the fields of short forms
            written = written_schema(model)
            known_here = {name for branch in _at(written, where) for name in branch.get("properties", ())}
            # a short form that is unknown stands beside what it is short for
            if kind != "extra_forbidden" or place[-1] not in known_here:
                schemas.insert(0, written)
        here, schema = next(((there, root) for root in schemas if (there := _at(root, where))), ([], schemas[0]))
        context.setdefault("allowed", _describe_all(here, schema))
        if kind == "extra_forbidden":
            context["value"] = f" {json.dumps(str(place[-1])[:LONGEST_NAME])}"
            context["hint"] = suggestion(
                str(place[-1]), [name for branch in here for name in branch.get("properties", ())]
            )
    place += context.pop("at", ())
    message = "{detail}{value}{hint}" + (" (allowed: {allowed})" if context["allowed"] else "")
    return InitErrorDetails(type=PydanticCustomError(kind, message, context), loc=tuple(place), input=None)


@cache
def schema_of(model: type[BaseModel]) -> Schema:
    """Return the JSON schema of a model (computed once)."""
    return model.model_json_schema()


@cache
def written_schema(model: type[BaseModel]) -> Schema:
    """Return the JSON schema of what may be written for a model, with its short forms (computed once)."""
    schema = deepcopy(dict(schema_of(model)))
    written: Callable[[dict[str, Any]], None] | None = getattr(model, "write_short_forms", None)
    if written is not None:
        written(schema)
    return schema


def branches(schema: Schema, root: Schema) -> list[Schema]:
    """Return the alternatives of a schema, one level of union resolved."""
    while "$ref" in schema:
        schema = root["$defs"][schema["$ref"].rpartition("/")[2]]
    options = schema.get("oneOf") or schema.get("anyOf")
    return [branch for option in options for branch in branches(option, root)] if options else [schema]


def _at(root: Schema, where: Sequence[Any]) -> list[Schema]:
    """Return the alternatives of the schema at a place in the body, none where the schema has no such place."""
    alternatives = branches(root, root)
    for part in where:
        if isinstance(part, int):
            below = [schema["items"] for schema in alternatives if "items" in schema]
        else:
            below = [schema["properties"][part] for schema in alternatives if part in schema.get("properties", {})]
        alternatives = [branch for schema in below for branch in branches(schema, root)]
    return alternatives


def _describe_all(schemas: Sequence[Schema], root: Schema) -> str:
    texts = [text for schema in schemas if (text := _describe(schema, root))]
    # what is behind "each" ends at a semicolon
    return ("; or " if any(" each " in text for text in texts) else " or ").join(texts)


def _describe(schema: Schema, root: Schema) -> str:
    if "const" in schema:
        return json.dumps(schema["const"])
    if "enum" in schema:
        return "one of " + ", ".join(map(json.dumps, schema["enum"]))
    kind = schema.get("type")
    if kind in {"number", "integer"}:
        noun = "an integer" if kind == "integer" else "a finite number"
        return " ".join(filter(None, (noun, _bounds(schema))))
    if kind == "array":
        items = _describe_all(branches(schema.get("items", {}), root), root) or "any value"
        minimum, maximum = schema.get("minItems"), schema.get("maxItems")
        least = f"at least {minimum} " if minimum else ""
        counts = least if maximum is None else f"{maximum} " if minimum == maximum else f"{minimum or 0} to {maximum} "
        return f"a list of {counts}{'value' if counts == 'at least 1 ' else 'values'}, each {items}"
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
